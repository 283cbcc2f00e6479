"""Turn blocks of a log into rows of the power model; derivatives stay within runs.

    d(f)/dt    second-order difference on uneven intervals; one-sided at a run's ends and at gaps
    ax, ay     d(vx)/dt - wz·vy,  d(vy)/dt + wz·vx
    gravity    g·(sin pitch, -cos pitch·sin roll, cos pitch·cos roll), REP-103
    slope_rate |d/dt| of the angle between the body's z and the vertical
    odometer   sum of speed times interval since the log began
    time_since_start   since one interval before the run's first row: a row's time is its end

A derivative needs the rows on both sides. One row is therefore held back until its successor is
known, and one emitted row stays as its predecessor. The result does not depend on where blocks end.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.errors import LogError
from planner.power.rows import gravity_columns
from planner.quantities import DEFAULT_ROW, INDEX, QUANTITIES, ROW_LENGTH, STANDARD_GRAVITY
from planner.telemetry.logs.checks import Checks
from planner.telemetry.logs.columns import MAY_BE_UNKNOWN, POSSIBLE, TEXT, is_wheel_current
from planner.telemetry.logs.files import Block
from planner.telemetry.logs.mapping import Column, Mapping

LOPSIDED = 3.0
"""Ratio of neighbouring intervals above which a derivative uses the shorter one alone."""
LEAST_GRAVITY_SQUARED = 1e-6
"""m²/s⁴ along the body's z, where logged gravity leaves none for it."""
_NEEDED = ("time", "vx", "vy", "wz", "power", "roll", "pitch", "payload")


Channels = AnyMapping[str, Array]
Some = TypeVar("Some", bound="Rows")


@dataclass(frozen=True, eq=False)
class Rows:
    """Finished rows of a log, see log.Telemetry for the units."""

    rows: Array
    power: Array
    run: Integers
    time: Array
    interval: Array

    def arrays(self) -> dict[str, Array]:
        """The arrays that have an entry for every row, by name."""
        return {one.name: getattr(self, one.name) for one in fields(Rows)}

    @staticmethod
    def joined(parts: Sequence[Rows], last: Some) -> Some:
        """Parts of a log as one; ``last`` is its last chunk, whose labels are complete."""
        arrays = [part.arrays() for part in parts]
        together = {name: np.concatenate([one[name] for one in arrays]) for name in arrays[0]}
        return replace(last, **together)


class Assembler:
    """Turns blocks into finished rows.

    Args:
        mapping: columns, as ``resolved`` below names them, and constants.
        resolved: quantity to column of this log.
        checks: running account of what is found.
    """

    def __init__(self, mapping: Mapping, resolved: AnyMapping[str, Column], checks: Checks) -> None:
        self.mapping = mapping
        self.columns = dict(resolved)
        self.checks = checks
        self.labels: dict[str, dict[str, int]] = {"run": {}, "surface": {}}
        self._tail: dict[str, Array] = {}
        self._context = False
        self._last: tuple[int, float] = (-1, -np.inf)
        self._start = 0.0
        self._odometer = 0.0
        self._run_length = 0
        self._current = -1.0

    def feed(self, block: Block) -> Rows | None:
        """Take a block; the rows that are finished by it."""
        self.checks.seen += len(block.rows)
        values = self._in_si(block)
        rows = block.rows.astype(np.float64)
        keep = self._usable(values, block.rows)
        values = {name: column[keep] for name, column in values.items()}
        values["row"] = rows[keep]
        self._order(values)
        return self._emit(values, finish=False)

    def finish(self) -> Rows | None:
        """The rows held back."""
        if not self._tail:
            return None
        if self._run_length == 1:
            self.checks.short_runs += 1
        return self._emit({name: column[:0] for name, column in self._tail.items()}, finish=True)

    def _in_si(self, block: Block) -> dict[str, Array]:
        count = len(block.rows)
        values: dict[str, Array] = {}
        for name, column in self.columns.items():
            heading = column.heading
            if name in TEXT:
                codes, labels = block.labels[heading]
                known = self.labels[name]
                table = [known.setdefault(x, len(known)) if x else -1 for x in labels]
                values[name] = np.array([*table, -1], float)[codes]
            else:
                cells = block.numbers[heading]
                factor, offset = column.factor, column.offset
                values[name] = cells if (factor, offset) == (1.0, 0.0) else cells * factor + offset
        for name, constant in self.mapping.constants.items():
            if isinstance(constant, str):
                known = self.labels[name]
                constant = known.setdefault(constant, len(known))
            values[name] = np.full(count, float(constant))
        if "power" not in values:
            values["power"] = values["battery_voltage"] * values["battery_current"]
        return values

    def _usable(self, values: dict[str, Array], rows: Integers) -> Mask:
        keep = values["run"] >= 0
        self.checks.leave_out("missing", "run", rows[~keep])
        for name in list(values):
            if name in TEXT:
                continue
            column = values[name]
            if name in _NEEDED:
                bad = ~np.isfinite(column)
                self.checks.leave_out("missing", name, rows[bad & keep])
                keep &= ~bad
            key = "battery_current" if is_wheel_current(name) else name
            low, high = POSSIBLE.get(key, (-np.inf, np.inf))
            with np.errstate(invalid="ignore"):
                impossible = (column < low) | (column > high)
            if not impossible.any():
                continue
            if name in MAY_BE_UNKNOWN or is_wheel_current(name):
                values[name] = np.where(impossible, np.nan, column)
                self.checks.disbelieve(name, rows[impossible])
            else:
                self.checks.leave_out("impossible", name, rows[impossible & keep])
                keep &= ~impossible
        return keep

    def _order(self, values: dict[str, Array]) -> None:
        """Refuse runs that come again; drop rows whose time is not later than all before."""
        run, time, rows = values["run"], values["time"], values["row"].astype(np.int64)
        if not len(run):
            return
        before_run = np.concatenate([[self._last[0]], run[:-1]])
        same = run == before_run
        latest = self._latest_before(time, same)
        names = list(self.labels["run"])
        late = same & (time < latest)
        for k in np.flatnonzero(late)[:1]:
            said = f"runs backwards by {latest[k] - time[k]:.6g} s in row {rows[k]}, run "
            self.checks.late = self.checks.late or said + repr(names[int(run[k])])
        self.checks.add_late(late, rows)
        repeated = same & (time == latest)
        self.checks.leave_out("doubled", "time", rows[repeated])
        known = self._last[0]
        for start in np.flatnonzero(~same):
            if run[start] <= known:
                raise LogError(
                    f"{self.checks.where}: run",
                    f"the rows of run {names[int(run[start])]!r} are not consecutive: it comes "
                    f"again in row {rows[start]}",
                    accepted="consecutive rows in every run",
                )
            known = int(run[start])
        forward = same & (time > latest)
        self.checks.add_intervals((time - latest)[forward], rows[forward])
        last = float(time[-1])
        self._last = (int(run[-1]), max(last, float(latest[-1])) if same[-1] else last)
        if not np.all(kept := ~(late | repeated)):
            for name in values:
                values[name] = values[name][kept]
        self._count_short_runs(values["run"])

    def _latest_before(self, time: Array, same: Mask) -> Array:
        """(n,) latest time of a run's rows before each one; of any other at its first row."""
        latest = np.concatenate([[self._last[1]], time[:-1]])
        for start, stop in itertools.pairwise([0, *np.flatnonzero(~same[1:]) + 1, len(time)]):
            begin = start if same[start] else start + 1
            latest[begin:stop] = np.maximum.accumulate(latest[begin:stop])
        return latest

    def _count_short_runs(self, run: Array) -> None:
        codes, counts = np.unique(run, return_counts=True)
        if not len(codes):
            return
        if codes[0] == self._current:
            counts[0] += self._run_length
        elif self._run_length == 1:
            self.checks.short_runs += 1
        self.checks.short_runs += int(np.count_nonzero(counts[:-1] == 1))
        self._current, self._run_length = float(codes[-1]), int(counts[-1])

    def _emit(self, new: dict[str, Array], *, finish: bool) -> Rows | None:
        values = new
        if self._tail:
            values = {name: np.concatenate([self._tail[name], new[name]]) for name in new}
        total = len(values["time"])
        first, end = int(self._context), total if finish else total - 1
        if end <= first:
            self._tail = values if total else {}
            return None
        self._context = True
        self._tail = {name: column[end - 1 :] for name, column in values.items()}
        return self._rows(values, first, end)

    def _rows(self, values: dict[str, Array], first: int, end: int) -> Rows:
        step = Steps(values["time"], values["run"])
        vx, vy, wz = values["vx"], values["vy"], values["wz"]
        zero = np.zeros(len(vx))
        speed = np.hypot(vx, vy)
        interval = step.interval()
        computed: dict[str, Array] = {
            "ax": step.derivative(vx) - wz * vy,
            "ay": step.derivative(vy) + wz * vx,
            "yaw_acceleration": step.derivative(wz),
        }
        if "roll" in values or "pitch" in values or "gravity_x" not in values:
            computed |= gravity_columns(
                values.get("roll", zero), values.get("pitch", zero), gravity=STANDARD_GRAVITY
            )
        gravity = computed | {k: v for k, v in values.items() if k.startswith("gravity")}
        x, y = (np.nan_to_num(gravity.get(name, zero)) for name in ("gravity_x", "gravity_y"))
        if "gravity_normal" not in gravity:
            normal = np.sqrt(np.maximum(STANDARD_GRAVITY**2 - (x**2 + y**2), LEAST_GRAVITY_SQUARED))
            computed["gravity_normal"] = gravity["gravity_normal"] = normal
        angle = np.arctan2(np.hypot(x, y), gravity["gravity_normal"])
        computed["slope_rate"] = np.abs(step.derivative(angle))
        computed = {name: column[first:end] for name, column in computed.items()}
        inside = {name: column[first:end] for name, column in values.items()}
        driven = np.concatenate([[self._odometer], (speed * interval)[first:end]])
        computed["odometer"] = np.cumsum(driven)[1:]
        self._odometer = float(computed["odometer"][-1])
        computed["time_since_start"] = self._since_start(inside["time"], step, interval, first, end)
        rows = np.empty((end - first, ROW_LENGTH))
        rows[:] = DEFAULT_ROW
        for quantity in QUANTITIES:
            self._fill(rows[:, INDEX[quantity.name]], quantity.name, inside, computed)
        measured = {k: v for k, v in inside.items() if k not in (*TEXT, "row")}
        self.checks.add_rows(measured, step.follows[first:end] & (np.arange(first, end) > first))
        for axis, name in (("ax", "gravity_x"), ("ay", "gravity_y")):
            if axis in inside:
                self.checks.accelerations.add(inside[axis], computed[axis], rows[:, INDEX[name]])
        return Rows(
            rows,
            power=inside["power"].copy(),
            run=inside["run"].astype(np.int64),
            time=inside["time"].copy(),
            interval=interval[first:end].copy(),
        )

    def _fill(self, target: Array, name: str, measured: Channels, computed: Channels) -> None:
        if name not in measured:
            if name in computed:
                target[:] = computed[name]
            return
        column = measured[name]
        target[:] = column
        if name in MAY_BE_UNKNOWN or name == "surface":
            return
        unknown = ~np.isfinite(column)
        if name in computed:
            target[unknown] = computed[name][unknown]
        elif unknown.any():
            target[unknown] = DEFAULT_ROW[INDEX[name]]
            self.checks.fill(name, int(np.count_nonzero(unknown)))

    def _since_start(
        self, time: Array, step: Steps, interval: Array, first: int, end: int
    ) -> Array:
        begins = ~step.follows[first:end]
        # The row before the first one is known unless the log begins here.
        starts = np.where(begins, time - interval[first:end], 0.0)
        place = np.maximum.accumulate(np.where(begins, np.arange(end - first), -1))
        since = np.where(place >= 0, starts[np.maximum(place, 0)], self._start)
        self._start = float(since[-1])
        return time - since


class Steps:
    """Neighbours of every row within its run."""

    def __init__(self, time: Array, run: Array | Integers) -> None:
        count = len(time)
        self.follows = np.zeros(count, bool)
        self.follows[1:] = run[1:] == run[:-1]
        self.back, self.ahead = np.ones(count), np.ones(count)
        self.back[1:] = np.where(self.follows[1:], np.diff(time), 1.0)
        self.ahead[:-1] = self.back[1:]
        self.leads = leads = np.append(self.follows[1:], False)
        both = self.follows & leads
        self.use_back = self.follows & ~(both & (self.back > LOPSIDED * self.ahead))
        self.use_ahead = leads & ~(both & (self.ahead > LOPSIDED * self.back))

    def derivative(self, f: Array) -> Array:
        """Time derivative; 0 where a run has one row."""
        slope_back, slope_ahead = np.zeros_like(f), np.zeros_like(f)
        slope_back[1:] = np.diff(f) / self.back[1:]
        slope_ahead[:-1] = slope_back[1:]
        both = (self.back * slope_ahead + self.ahead * slope_back) / (self.back + self.ahead)
        one = np.where(self.use_back, slope_back, np.where(self.use_ahead, slope_ahead, 0.0))
        return np.where(self.use_back & self.use_ahead, both, one)

    def interval(self) -> Array:
        """Length of the interval that a row stands for, s; 0 where a run has one row."""
        return np.where(
            self.use_back,
            self.back,
            np.where(self.leads, self.ahead, np.where(self.follows, self.back, 0.0)),
        )
