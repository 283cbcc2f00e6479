"""A measured log as rows of the power model, with findings and what was derived or assumed.

    log = Telemetry.read("drive.csv")
    log.power - model.watts(log.rows)          # (n,) W, the residual
    for finding in log.report: print(finding.sentence)

One row is one sample: averages over an interval that ends at ``time``. Units are SI, names those of
planner.quantities. A mapping file adapts other logs (mapping). Formats: CSV, also gzipped, and
Parquet (files), rosbag2 recordings (rosbag), tables in memory (formats). Rows are made by assemble
and checked by checks.

Sign
    power drawn from the supply is positive; pitch > 0 is nose down (REP-103).
Left out
    no smoothing and no resampling of tables: a derivative carries the noise of its channel.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from planner.arrays import Array, Integers, Mask
from planner.errors import LogError
from planner.quantities import INDEX
from planner.telemetry.logs.accelerometer import MeasuredAccelerations
from planner.telemetry.logs.assemble import Assembler, Rows, Steps
from planner.telemetry.logs.checks import GAP_INTERVALS, MOST_UNEVEN, UNEVEN, Checks
from planner.telemetry.logs.columns import (
    MAY_BE_UNKNOWN,
    REQUIRED,
    TEXT,
    UNITS,
    closest,
    is_quantity,
    is_wheel_current,
)
from planner.telemetry.logs.files import Block, LogFile
from planner.telemetry.logs.finding import Finding
from planner.telemetry.logs.formats import open_log, open_table
from planner.telemetry.logs.mapping import Column, Mapping, MappingLike, read_mapping
from planner.telemetry.logs.meter import Meter

__all__ = ["Finding", "Telemetry", "pieces_of"]


MOST_ROWS = 5_000_000
"""Rows that ``read`` takes into memory (240 bytes each); longer logs are read in chunks."""
LogLike = Any
"""A path, or a table in memory: a DataFrame of pandas, or another one with Arrow's interface."""
_RECORDINGS = (".db3", ".mcap")


@dataclass(frozen=True, eq=False)
class Telemetry(Rows):
    """A log, or a chunk of one.

    Attributes:
        rows: (n, ROW_LENGTH) inputs of the power model; ``surface`` counts in ``surfaces``.
        power: (n,) W measured.
        run: (n,) number of the run, an index into ``run_names``.
        time: (n,) s as logged, the end of a row's interval.
        interval: (n,) s that a row stands for.
        run_names: labels of the runs; of a chunk, those up to its end.
        surfaces: labels of the ground in the order of their first row.
        present: quantities that the log measured or its mapping gave as constants.
        derived: what was computed from other columns, in sentences.
        assumed: what was taken for granted, in sentences.
        report: what was found; of a chunk, up to its end, so that the last chunk's is complete.
        source: path of the log; of a table in memory the name of its class.
        power_at: "terminals" or "source", from the mapping file.
        meter: what the power was read from, beside this motion; None shows the power as it is.
        ahead: whether the motion is that between each row and the next.
    """

    run_names: tuple[str, ...]
    surfaces: tuple[str, ...]
    present: frozenset[str]
    derived: tuple[str, ...]
    assumed: tuple[str, ...]
    report: tuple[Finding, ...]
    source: str
    power_at: str = "terminals"
    meter: Meter | None = None
    ahead: bool = False

    SPEED_ERROR: ClassVar[tuple[float, float, float]] = (0.01, 0.01, 0.03)
    """m/s, m/s and rad/s: what odometry usually errs by in vx, vy and wz."""

    def __len__(self) -> int:
        return len(self.power)

    @classmethod
    def read(cls, log: LogLike, mapping: MappingLike | None = None) -> Telemetry:
        """Read a whole log.

        Args:
            log: path of a CSV, gzipped CSV, Parquet, or a rosbag2 recording (.db3, .mcap or its
                folder); or a table in memory, such as a DataFrame of pandas.
            mapping: a mapping file for other names, units and signs, or its content.

        Raises:
            LogError: the log or the mapping file cannot be used; one sentence says why.
        """
        parts: list[Telemetry] = []
        for part in cls.chunks(log, mapping, rows=500_000):
            parts.append(part)
            if sum(map(len, parts)) > MOST_ROWS:
                raise LogError(
                    part.source,
                    f"has more than {MOST_ROWS} rows",
                    accepted="Telemetry.chunks for longer logs",
                )
        return parts[0] if len(parts) == 1 else cls.joined(parts, parts[-1])

    @classmethod
    def chunks(
        cls, log: LogLike, mapping: MappingLike | None = None, *, rows: int = 200_000
    ) -> Iterator[Telemetry]:
        """The log in chunks of about ``rows`` rows; together they are what ``read`` gives.

        Memory does not grow with the length of the log (it does with the number of runs).

        Raises:
            LogError: as ``read``; what only the whole log shows is raised after the last chunk.
        """
        if rows < 1:
            raise LogError("rows", "too few rows for a chunk", value=rows, accepted="at least 1")
        used = Mapping() if mapping is None else read_mapping(mapping)
        file, blocks = _opened(log, used)
        where = str(file.path)
        resolved = used.resolve(file.columns, where, file.dates)
        given = {*resolved, *used.constants}
        _require(given, file.columns, where)
        checks = Checks(
            where, "power" not in given, ragged=file.ragged, notes=_format_notes(file, resolved)
        )
        if not blocks:
            numeric = [c.heading for name, c in resolved.items() if name not in TEXT]
            text = [c.heading for name, c in resolved.items() if name in TEXT]
            blocks = file.blocks(numeric, text, rows)
        assembler = Assembler(used, resolved, checks)
        derived, assumed = _sentences(given)

        def chunk(part: Rows) -> Telemetry:
            return cls(
                **part.arrays(),  # type: ignore[arg-type]
                run_names=tuple(assembler.labels["run"]),
                surfaces=tuple(assembler.labels["surface"]),
                present=frozenset(given),
                derived=derived,
                assumed=assumed,
                report=tuple(checks.findings()),
                source=where,
                power_at=used.power_at,
            )

        waiting: list[Rows] = []
        for block in blocks:
            part = assembler.feed(block)
            checks.refuse(finished=False)
            if part is not None:
                yield from map(chunk, waiting)
                waiting = [part]
        last = assembler.finish()
        checks.refuse(finished=True)
        # The last row of a log would be a chunk of its own otherwise.
        waiting += [] if last is None else [last]
        yield chunk(waiting[0] if len(waiting) == 1 else Rows.joined(waiting, waiting[-1]))

    def segments(self) -> list[tuple[int, int]]:
        """Stretches of consecutive rows: the same run, no gap in time."""
        return self._segments

    @cached_property
    def _segments(self) -> list[tuple[int, int]]:
        step = np.diff(self.time)
        same = np.diff(self.run) == 0
        usual = float(np.median(step[same])) if same.any() else 0.0
        return _between(~same | (step > GAP_INTERVALS * usual), len(self))

    def has_uneven_clock(self) -> bool:
        """Whether many rows are not one usual interval after the row before."""
        steps = np.diff(self.time)[np.diff(self.run) == 0]
        usual = float(np.median(steps)) if len(steps) else 0.0
        return bool(len(steps) and np.mean(np.abs(steps - usual) > UNEVEN * usual) > MOST_UNEVEN)

    def odd_accelerations(self, derived: Array) -> list[Finding]:
        """What is odd about measured ax and ay beside those (n, 2) that follow from the speeds."""
        measured = MeasuredAccelerations()
        for name, gravity, along in (("ax", "gravity_x", 0), ("ay", "gravity_y", 1)):
            if name in self.present:
                logged, pull = self.rows[:, INDEX[name]], self.rows[:, INDEX[gravity]]
                measured.add(logged, derived[:, along], pull)
        return list(measured.findings(len(self)))

    def without_accelerometer(self) -> Telemetry:
        """The log as it is read without ``ax`` and ``ay``: these follow from the speeds."""
        steps = Steps(self.time, self.run)
        vx, vy, wz = (self.rows[:, INDEX[name]] for name in ("vx", "vy", "wz"))
        felt = {"ax": steps.derivative(vx) - wz * vy, "ay": steps.derivative(vy) + wz * vx}
        rows, dropped = self.rows.copy(), sorted(self.present.intersection(felt))
        for name in dropped:
            rows[:, INDEX[name]] = felt[name]
        said = (*self.derived, *(f"{name}: {_DERIVED[name]}" for name in dropped))
        return replace(self, rows=rows, present=self.present.difference(dropped), derived=said)

    def run_pieces(self) -> list[tuple[int, int]]:
        """Stretches of rows of one run."""
        return pieces_of(self.run)

    def take(self, chosen: ArrayLike | slice) -> Telemetry:
        """The rows of an index array, mask or slice; labels and report stay those of the log."""
        at = chosen if isinstance(chosen, slice) else np.asarray(chosen)
        chosen_rows = {name: values[at] for name, values in self.arrays().items()}
        return replace(self, **chosen_rows)  # type: ignore[arg-type]

    def rows_for(self, surfaces: Sequence[str]) -> Array:
        """(n, ROW_LENGTH) rows whose ``surface`` counts in a model's list; -1 is none of them."""
        table = [surfaces.index(label) if label in surfaces else -1 for label in self.surfaces]
        rows = self.rows.copy()
        column = INDEX["surface"]
        rows[:, column] = np.array([*table, -1], float)[rows[:, column].astype(np.int64)]
        return rows

    @property
    def meter_as_logged(self) -> Meter | None:
        """The meter beside the motion of the rows as they were logged."""
        if not self.ahead:
            return self.meter
        meter = (self.meter or Meter()).half_a_row_later(float(np.median(self.interval)))
        return None if meter.plain else meter

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the log's bytes (of a folder: of its files in the order of their names)."""
        digest = hashlib.sha256()
        path = Path(self.source)
        files = sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
        for one in files:
            with one.open("rb") as file:
                while part := file.read(1 << 20):
                    digest.update(part)
        return digest.hexdigest()


def _opened(log: LogLike, mapping: Mapping) -> tuple[LogFile, Iterable[Block]]:
    """A log's headings; and its rows where they come at once."""
    if hasattr(log, "__arrow_c_stream__"):
        return open_table(log), ()
    if not isinstance(log, str | Path):
        accepted = "a path, a DataFrame, or what Telemetry.read gave"
        raise LogError("log", "is not a log", value=log, accepted=accepted)
    path = Path(log)
    if path.suffix in _RECORDINGS or (path.is_dir() and (path / "metadata.yaml").exists()):
        from planner.telemetry.logs.rosbag import read_recording

        headings, block, notes = read_recording(path, mapping)
        return LogFile(path, "recording", headings, notes), (block,)
    return open_log(path), ()


def pieces_of(values: Integers) -> list[tuple[int, int]]:
    """Start and stop of every stretch of equal neighbours in values (n,)."""
    return _between(np.diff(values) != 0, len(values))


def _between(breaks: Mask, rows: int) -> list[tuple[int, int]]:
    """Stretches of rows between breaks; (rows - 1,) says whether one follows a row."""
    borders = [0, *(np.flatnonzero(breaks) + 1).tolist(), *([rows] if rows else [])]
    return list(itertools.pairwise(borders))


def _require(given: set[str], headings: Sequence[str], where: str) -> None:
    missing = [name for name in REQUIRED if name not in given]
    if "power" in missing and {"battery_voltage", "battery_current"} <= given:
        missing.remove("power")
    if not missing:
        return
    unused = [heading for heading in headings if not is_quantity(heading)]
    near = {name: closest(name, unused) for name in missing}
    hints = [f"{heading!r} for {name}" for name, heading in near.items() if heading]
    hint = f"; did you mean {', '.join(hints)}?" if hints else ""
    names = ", ".join(repr(name) for name in missing)
    raise LogError(
        where,
        f"has no column {names}{hint}",
        accepted=f"columns {', '.join(REQUIRED)} (power may be battery_voltage and "
        "battery_current), or a mapping file that says which columns they are"
        + (', and [constants] run = "drive" for a single one' if "run" in missing else "")
        + ("; from wheel speeds, joulepath logs join" if {"vx", "vy", "wz"} <= {*missing} else ""),
    )


def _format_notes(file: LogFile, resolved: dict[str, Column]) -> list[Finding]:
    begin = "read as csv with " if file.kind == "csv" else ""
    notes = [Finding("format", "", 0, f"{begin}{note}") for note in file.notes]
    used = {column.heading for column in resolved.values()}
    for heading in file.columns:
        if heading in used:
            continue
        near = closest(heading, [name for name in UNITS if name not in resolved])
        hint = f"; if it is {near}, a mapping file says so" if near else ""
        notes.append(Finding("not used", heading, 0, f"column {heading!r} is not used{hint}"))
    return notes


_DERIVED = {
    "power": "battery_voltage · battery_current",
    "ax": "d(vx)/dt - wz·vy",
    "ay": "d(vy)/dt + wz·vx",
    "yaw_acceleration": "d(wz)/dt",
    "slope_rate": "change of the angle between body and vertical",
}
"""Quantities that are computed where a log does not have them."""


def _sentences(given: set[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    angles = given & {"roll", "pitch"}
    sloped = bool(angles) or "gravity_x" in given
    missing = [name for name in _DERIVED if name not in given and (sloped or name != "slope_rate")]
    assumed = [] if sloped else ["no roll and pitch: the ground is taken as flat"]
    if angles:
        assumed += [f"no {name}: taken as 0" for name in ("pitch", "roll") if name not in given]
    if "payload" not in given:
        assumed.append("no payload: taken as 0 kg")
    if not {"wind_x", "wind_y"} <= given:
        assumed.append("no wind: the air is taken as still")
    unknown = [name for name in MAY_BE_UNKNOWN if name not in given]
    if unknown:
        assumed.append(
            f"not known: {', '.join(unknown)}; effects that read them cannot be identified"
        )
    if "surface" not in given:
        assumed.append("no surface: one ground everywhere")
    if not any(is_wheel_current(name) for name in given):
        assumed.append("no wheel currents: resistance and torque constant stay one number, R/k_t²")
    return tuple(f"{name}: {_DERIVED[name]}" for name in missing), tuple(assumed)
