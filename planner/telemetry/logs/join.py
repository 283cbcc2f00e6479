"""Several files of one drive, each with its own clock and rate, joined to one log.

    joined = join_logs(["odom.csv", "power.csv", "imu.csv"], vehicle=load_vehicle("minibalance"))
    joined.write("drive.csv")
    joined.said                     # row interval; what was averaged, held, shifted

A row of a log holds averages over one interval that ends at its time. The slowest of the channels
that every row needs (speeds and power) gives these intervals; faster channels are averaged over
them, slower ones hold their last value. A meter that repeats its last value between updates is
taken at its updates. A table of several topics, with empty cells between their samples, is taken
topic by topic. Wheel speeds become body velocities by the vehicle's kinematics (least
squares, Muir & Neuman 1987).

Clocks: stamps since 1970 in s, ms, µs or ns are told by their size. What is left between two files
is found where the speeds of one agree best with those, or with the power, of the other. A shift
below one interval of the slower file is left alone: it may be the meter's own delay, which the
diagnosis estimates.

Left out
    drift of one clock against another; interpolation, because it invents measurements.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner.arrays import Array
from planner.errors import LogError
from planner.power.kinematics import RIM
from planner.power.vehicles import Vehicle
from planner.telemetry.logs.checks import MOST_BACKWARDS
from planner.telemetry.logs.clocks import Source, clock_of, on_one_clock
from planner.telemetry.logs.columns import TEXT, is_wheel_speed
from planner.telemetry.logs.formats import open_log
from planner.telemetry.logs.mapping import Column, Mapping, MappingLike, read_mapping

MOST_FILES = 20
"""Files of one drive that are joined."""
MOST_ROWS = 5_000_000
"""Rows of one file that are held in memory."""
REPEATED_SHARE = 0.5
"""Share of equal neighbours above which a channel is one that repeats its last value."""
OWN_ROWS_RATIO = 1.5
"""Interval of a channel's samples over that of the rows above which it has a rate of its own."""
OTHER_UNIT_RATIO = 2.0
"""Speed over the vehicle's limit from which wheel speeds may be in another unit: rpm are 9.5."""
_SPEEDS = ("vx", "vy", "wz")


@dataclass(frozen=True, eq=False)
class JoinedLog:
    """The log that several files make.

    Attributes:
        columns: quantity to (n,) values; ``time`` is the end of a row's interval, s from the start.
        run: label of the drive.
        interval: median length of a row, s.
        said: what was done, in sentences.
        findings: what is odd about the files, in sentences.
    """

    columns: dict[str, Array]
    run: str
    interval: float
    said: tuple[str, ...]
    findings: tuple[str, ...]

    def write(self, path: str | Path) -> None:
        """Write a CSV file that Telemetry.read takes."""
        table = np.column_stack(list(self.columns.values()))
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["run", *self.columns])
            for row in table:
                writer.writerow([self.run, *("" if math.isnan(v) else f"{v:.9g}" for v in row)])


def join_logs(
    paths: Sequence[str | Path],
    *,
    vehicle: Vehicle | None = None,
    mapping: MappingLike | None = None,
    interval: float | None = None,
    shifts: AnyMapping[str, float] | None = None,
    run: str = "",
) -> JoinedLog:
    """One log out of the files of one drive.

    Args:
        paths: CSV or Parquet files, each with ``time`` and some quantities of a log, or
            ``wheel_speed_1 … n`` in rad/s in the order of the vehicle's wheels.
        vehicle: whose kinematics turn wheel speeds into body velocities.
        mapping: a mapping file for other names and units, or its content; a file need not have all
            its columns.
        interval: length of the rows, s, instead of that of the slowest needed channel.
        shifts: by file name, s to add to its times; the others are found.
        run: label of the drive; the first file's name by default.

    Raises:
        LogError: a file cannot be used, needed channels are missing, or the clocks share no time.
    """
    if not 1 <= len(paths) <= MOST_FILES:
        raise LogError(
            "files", "cannot be joined", value=len(paths), accepted=f"1 to {MOST_FILES} files"
        )
    used = Mapping() if mapping is None else read_mapping(mapping, wheel_speeds=True)
    findings: list[str] = []
    said: list[str] = []
    sources = [
        _without_repeats(source, findings)
        for number, path in enumerate(paths)
        for source in _by_rows(_read(Path(path), used, vehicle, findings, number))
    ]
    taken = _owners(sources, used, said)
    base = sources[taken["vx"]]
    sources = on_one_clock(sources, base, shifts or {}, said)
    ends, starts, step = _intervals(sources, taken, interval, findings, said)
    columns = _columns(sources, taken, (starts, ends), step, said, findings)
    constants = {k: v for k, v in used.constants.items() if isinstance(v, float)}
    columns |= {name: np.full(len(ends), value) for name, value in constants.items()}
    columns = {"time": ends - starts[0]} | columns
    label = str(used.constants.get("run", run or Path(paths[0]).stem))
    return JoinedLog(columns, label, step, tuple(said), tuple(findings))


def _read(
    path: Path, used: Mapping, vehicle: Vehicle | None, findings: list[str], number: int
) -> Source:
    file = open_log(path)
    where = str(path)
    own = {name: c for name, c in used.columns.items() if c.heading in file.columns}
    resolved = replace(used, columns=own, constants={}).resolve(file.columns, where, file.dates)
    taken = {column.heading for column in own.values()}
    resolved |= {n: Column(n) for n in file.columns if is_wheel_speed(n) and n not in taken}
    if "time" not in resolved:
        raise LogError(where, "has no column 'time'", accepted="time in s, or since 1970 in ns")
    wanted = {name: c for name, c in resolved.items() if name not in TEXT}
    headings = [c.heading for c in wanted.values()]
    parts: list[dict[str, Array]] = []
    for block in file.blocks(headings, [], 200_000):
        parts.append(block.numbers)
        if sum(len(part[headings[0]]) for part in parts) > MOST_ROWS:
            raise LogError(where, f"has more than {MOST_ROWS} rows", accepted="a shorter drive")
    if not parts:
        raise LogError(where, "has no rows", accepted="one row for each sample")
    cells = {name: np.concatenate([part[name] for part in parts]) for name in headings}
    channels = {n: c.factor * cells[c.heading] + c.offset for n, c in wanted.items()}
    wheels = {name: channels.pop(name) for name in wanted if is_wheel_speed(name)}
    time = channels.pop("time")
    scale, absolute = clock_of(time, where)
    time = time * scale
    good = np.isfinite(time)
    latest = np.maximum.accumulate(np.where(good, time, -np.inf))
    good[1:] &= time[1:] > latest[:-1]
    back = np.flatnonzero(time[1:] < latest[:-1]) + 1
    if len(back) > MOST_BACKWARDS * len(time):
        raise LogError(
            f"{where}: time",
            f"runs backwards by {latest[back[0] - 1] - time[back[0]]:.6g} s in row {back[0] + 1}",
            accepted="one drive, whose time increases; join each run of a log by itself",
        )
    if len(time) - good.sum():
        findings.append(f"{path.name}: {len(time) - good.sum()} rows without a later time left out")
    if good.sum() < 2:
        raise LogError(where, "has no two rows of increasing time", accepted="times that increase")
    if wheels:
        channels |= _body_velocities(wheels, vehicle, where, findings)
    if not channels:
        raise LogError(where, "has no column that a log may have", accepted="docs/logs.md, Columns")
    channels = {name: values[good] for name, values in channels.items()}
    return Source(path.name, time[good], channels, absolute, number)


def _by_rows(source: Source) -> list[Source]:
    """A file by the channels that share their rows: a table of several topics has empty cells.

    A channel with fewer samples than rows has them at its own rate; one that a few cells lack stays
    with the others.
    """
    groups: dict[bytes, list[str]] = {}
    for name, values in source.channels.items():
        known = np.isfinite(values)
        rare = known.sum() > 2 and (
            np.median(np.diff(source.time[known])) > OWN_ROWS_RATIO * source.interval
        )
        groups.setdefault(known.tobytes() if rare else b"", []).append(name)
    parts = []
    for rows, names in groups.items():
        chosen = np.frombuffer(rows, bool) if rows else slice(None)
        channels = {name: source.channels[name][chosen] for name in names}
        parts.append(replace(source, time=source.time[chosen], channels=channels))
    return parts


def _body_velocities(
    wheels: dict[str, Array], vehicle: Vehicle | None, where: str, found: list[str]
) -> dict[str, Array]:
    if vehicle is None:
        raise LogError(where, "has wheel speeds", accepted="the vehicle whose wheels they are")
    layout = vehicle.layout
    count = layout.wheel_count
    names = [f"wheel_speed_{k}" for k in range(1, count + 1)]
    if sorted(wheels) != sorted(names):
        raise LogError(
            where,
            f"has {len(wheels)} wheel speeds, {vehicle.name} has {count} wheels",
            value=", ".join(wheels),
            accepted=", ".join(names),
        )
    rims = layout.radius * np.column_stack([wheels[name] for name in names])
    velocity = rims @ np.linalg.pinv(layout.table[:, RIM : RIM + 3]).T
    if count > 3:
        misfit = rims - velocity @ layout.table[:, RIM : RIM + 3].T
        share = math.sqrt(float(np.nanmean(misfit**2)) / max(float(np.nanmean(rims**2)), 1e-12))
        if share > 0.05:
            found.append(
                f"{Path(where).name}: wheel speeds disagree with each other by {share:.0%}; "
                "wheels slip, or their order or signs are not those of the vehicle"
            )
    top = float(np.nanquantile(np.hypot(velocity[:, 0], velocity[:, 1]), 0.99))
    if top > OTHER_UNIT_RATIO * vehicle.limits.speed:
        found.append(
            f"{Path(where).name}: wheel speeds taken as rad/s give {top:.3g} m/s, "
            f"{top / vehicle.limits.speed:.3g} times the limit of {vehicle.name}; where they are "
            'rpm, a mapping file says so: { quantity = "wheel_speed_1", unit = "rpm" }'
        )
    return dict(zip(_SPEEDS, velocity.T, strict=True))


def _without_repeats(source: Source, findings: list[str]) -> Source:
    """The file at its updates, where power, voltage and current are held between them."""
    names = [n for n in ("power", "battery_voltage", "battery_current") if n in source.channels]
    if not names or any(name in source.channels for name in _SPEEDS):
        names = [n for n in names if _repeats(source.channels[n]) > REPEATED_SHARE]
        if names:
            findings.append(_held_sentence(source, names[0]) + "; the rows keep the held values")
        return source
    table = np.column_stack([source.channels[name] for name in names])
    new = np.append(True, (np.diff(table, axis=0) != 0.0).any(axis=1))
    if 1.0 - new.mean() <= REPEATED_SHARE or new.sum() < 3:
        return source
    findings.append(_held_sentence(source, names[0]) + "; it is taken at its updates")
    # The last update of the file may have been cut off; the held samples behind it say nothing.
    return replace(
        source,
        time=source.time[new],
        channels={name: values[new] for name, values in source.channels.items()},
    )


def _repeats(values: Array) -> float:
    return float(np.mean(np.diff(values) == 0.0))


def _held_sentence(source: Source, name: str) -> str:
    values = source.channels[name]
    updates = source.time[np.append(True, np.diff(values) != 0.0)]
    every = float(np.median(np.diff(updates))) if len(updates) > 1 else math.inf
    return (
        f"{source.name}: {name} is held: sampled every {source.interval:.3g} s, new every "
        f"{every:.3g} s"
    )


def _owners(sources: list[Source], used: Mapping, said: list[str]) -> dict[str, int]:
    """Quantity to the number of the file that gives it; the first one named."""
    taken: dict[str, int] = {}
    for number, source in enumerate(sources):
        for name in source.channels:
            if name in taken:
                said.append(f"{name} from {sources[taken[name]].name}, not from {source.name}")
            elif name not in used.constants:
                taken[name] = number
    if "power" not in taken and {"battery_voltage", "battery_current"} <= set(taken):
        both = (taken["battery_voltage"], taken["battery_current"])
        taken["power"] = max(both, key=lambda n: sources[n].interval)
        said.append("power is battery_voltage · battery_current")
    missing = [name for name in (*_SPEEDS, "power") if name not in taken]
    if missing:
        raise LogError(
            ", ".join(source.name for source in sources),
            f"have no column {', '.join(map(repr, missing))}",
            accepted="files that together have vx, vy, wz (or wheel_speed_1 … n) and power (or "
            "battery_voltage and battery_current)",
        )
    return taken


def _intervals(
    sources: list[Source],
    taken: dict[str, int],
    interval: float | None,
    findings: list[str],
    said: list[str],
) -> tuple[Array, Array, float]:
    """Ends and starts of the rows, s, and their usual length."""
    needed = [sources[n] for n in dict.fromkeys(taken[name] for name in (*_SPEEDS, "power"))]
    first = max(source.time[0] for source in needed)
    last = min(source.time[-1] for source in needed)
    slowest = max(needed, key=lambda source: source.interval)
    if last - first < 2.0 * slowest.interval:
        spans = ", ".join(f"{s.name} {s.time[0]:.6g} to {s.time[-1]:.6g} s" for s in needed)
        raise LogError(
            ", ".join(s.name for s in needed),
            f"share no time ({spans})",
            accepted="files of one drive, on one clock or with --shift FILE=SECONDS",
        )
    if interval is None:
        marks = slowest.time[(slowest.time >= first) & (slowest.time <= last)]
        ends, starts = marks[1:], marks[:-1]
        # Beside a gap the row stands for one usual interval, not for the whole gap.
        starts = np.maximum(starts, ends - 3.0 * slowest.interval)
        said.append(f"rows of {slowest.interval:.4g} s, the samples of {slowest.name}")
        return ends, starts, slowest.interval
    if not 0.0 < interval <= last - first:
        raise LogError(
            "interval", "no length of a row", value=interval, accepted=f"0 to {last - first:.4g} s"
        )
    count = int((last - first) / interval + 1e-9)
    if count > MOST_ROWS:
        raise LogError("interval", f"makes {count} rows", accepted=f"at most {MOST_ROWS}")
    ends = first + interval * np.arange(1.0, count + 1.0)
    said.append(f"rows of {interval:.4g} s, as given")
    for source in needed:
        if source.interval > 1.5 * interval:
            findings.append(
                f"{source.name}: a sample every {source.interval:.3g} s is held over several rows"
            )
    return ends, ends - interval, interval


def _columns(
    sources: list[Source],
    taken: dict[str, int],
    rows: tuple[Array, Array],
    step: float,
    said: list[str],
    findings: list[str],
) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    methods: dict[str, list[str]] = {"averaged": [], "taken as sampled": [], "held": []}
    for name, number in taken.items():
        source = sources[number]
        if name == "power" and name not in source.channels:
            continue
        if source.interval < 0.75 * step:
            method, values = "averaged", _averages(source, name, rows)
        else:
            method = "held" if source.interval > 1.5 * step else "taken as sampled"
            values = _last_values(source, name, rows)
        methods[method].append(f"{name} ({source.name}, {1.0 / source.interval:.3g} Hz)")
        columns[name] = values
    if "power" not in columns:
        columns["power"] = columns["battery_voltage"] * columns["battery_current"]
    for method, names in methods.items():
        if names:
            said.append(f"{method}: {', '.join(names)}")
    for name in (*_SPEEDS, "power"):
        empty = int(np.isnan(columns[name]).sum())
        if empty:
            findings.append(f"{name}: {empty} of {len(columns[name])} rows have no sample")
    return columns


def _averages(source: Source, name: str, rows: tuple[Array, Array]) -> Array:
    """Mean of the samples in each (start, end]; NaN where there is none."""
    good = np.isfinite(source.channels[name])
    time, values = source.time[good], source.channels[name][good]
    sums = np.append(0.0, np.cumsum(values))
    low, high = (np.searchsorted(time, edge, side="right") for edge in rows)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean: Array = (sums[high] - sums[low]) / (high - low)
    return mean


def _last_values(source: Source, name: str, rows: tuple[Array, Array]) -> Array:
    """The last sample at or before each end, at most three of its intervals old; NaN otherwise."""
    good = np.isfinite(source.channels[name])
    time, values = source.time[good], source.channels[name][good]
    if not len(time):
        return np.full(len(rows[1]), np.nan)
    place = np.searchsorted(time, rows[1] + 1e-9, side="right") - 1
    fresh = (place >= 0) & (rows[1] - time[np.maximum(place, 0)] <= 3.0 * source.interval)
    return np.where(fresh, values[np.maximum(place, 0)], np.nan)
