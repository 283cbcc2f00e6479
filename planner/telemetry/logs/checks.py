"""What is odd about a log: findings for its report, and the reasons to refuse it.

The checks run while the rows pass by once (counts, extremes, a histogram of intervals). Memory
does not grow with the log. A finding never changes a row. Rows that the reader left out are
counted by column and reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.errors import LogError
from planner.telemetry.logs.accelerometer import MeasuredAccelerations
from planner.telemetry.logs.columns import OFTEN_MISTAKEN, POSSIBLE, unit_of
from planner.telemetry.logs.finding import Finding

MOST_IMPOSSIBLE = 0.01
"""Share of rows with impossible values; above it, the unit is wrong and not the sensor."""
MOST_RAGGED = 0.05
"""Share of rows with a wrong number of cells; above it, the file is not a table."""
MOST_BACKWARDS = 0.01
"""Share of rows before an earlier one that are stragglers of a buffer; more are another drive."""
MOST_STRAGGLERS = 5
"""Late rows one after the other; after more, a buffer is empty, and it is the clock."""
LONGEST_PLAUSIBLE_INTERVAL = 100.0
"""s between samples; at this or more, time is not in seconds."""
LATEST_PLAUSIBLE_TIME = 1e11
"""s; above it, time is not in seconds: seconds since 1970 stay below 1e10 for 300 years."""
STEEPEST_PLAUSIBLE = 0.7
"""rad; no wheel grips on 40°, and a floor that is level within 1° seems as steep in degrees."""
GAP_INTERVALS = 2.5
"""Usual intervals; a longer one is a gap, and its rows are not consecutive."""
UNEVEN = 0.1
"""Share by which an interval may differ from the usual one and be even."""
MOST_UNEVEN = 0.1
"""Share of intervals that differ by more where a clock is not even: gaps are rarer."""
_ENOUGH_ROWS = 1000
"""Rows before a share is judged while the log is still being read."""
_DECADES, _BINS_PER_DECADE = (-9, 9), 100
"""Range (powers of ten, s) and resolution of the histogram of intervals."""
_CLIPS = ("vx", "vy", "wz", "ax", "ay", "power", "battery_current")
_VARY = ("vx", "vy", "wz", "power", "ax", "ay", "roll", "pitch", "battery_voltage")
_REASONS = {
    "missing": "no value",
    "impossible": "a value that cannot be",
    "doubled": "the time of a row before",
    "late": "a time before that of an earlier row",
}
_UNBELIEVABLE = "unbelievable"
"""Key of cells that are taken as not known; their rows stay."""


@dataclass
class _Channel:
    least: float = np.inf
    most: float = -np.inf
    at_least: int = 0
    at_most: int = 0
    known: int = 0

    def add(self, values: Array) -> None:
        values = values[~np.isnan(values)]
        if not len(values):
            return
        self.known += len(values)
        least, most = float(values.min()), float(values.max())
        if least <= self.least:
            count = int(np.count_nonzero(values == least))
            self.at_least = count + (self.at_least if least == self.least else 0)
            self.least = least
        if most >= self.most:
            count = int(np.count_nonzero(values == most))
            self.at_most = count + (self.at_most if most == self.most else 0)
            self.most = most


@dataclass
class _Count:
    first: int
    rows: int = 0


@dataclass
class Checks:
    """Running account of one log."""

    where: str
    multiplied: bool = False
    """Whether the power is battery_voltage · battery_current."""
    kept: int = 0
    seen: int = 0
    notes: list[Finding] = field(default_factory=list)
    ragged: list[int] = field(default_factory=list)
    streak: int = 0
    """Late rows since the last one that was not."""
    late: str = ""
    """The first time that is before an earlier one, as an error says it."""
    odd: dict[tuple[str, str], _Count] = field(default_factory=dict)
    filled: dict[str, int] = field(default_factory=dict)
    channels: dict[str, _Channel] = field(default_factory=dict)
    intervals: Integers = field(
        default_factory=lambda: np.zeros((_DECADES[1] - _DECADES[0]) * _BINS_PER_DECADE, np.int64)
    )
    longest: tuple[float, int] = (0.0, 0)
    short_runs: int = 0
    repeated: int = 0
    negative: int = 0
    latest: float = 0.0
    products: Array = field(default_factory=lambda: np.zeros(2))
    accelerations: MeasuredAccelerations = field(default_factory=MeasuredAccelerations)

    def leave_out(self, kind: str, column: str, rows: Integers) -> None:
        """Count rows that do not enter the result."""
        if len(rows):
            self.odd.setdefault((kind, column), _Count(int(rows[0]))).rows += len(rows)

    def add_late(self, late: Mask, rows: Integers) -> None:
        """Rows (n,) whose time is before that of an earlier one, at most a few in a row.

        Raises:
            LogError: so many that the clock was set back, or a time is far ahead.
        """
        self.leave_out("late", "time", rows[late])
        if not late.any():
            self.streak = 0
            return
        for one in late:
            self.streak = self.streak + 1 if one else 0
            if self.streak > MOST_STRAGGLERS:
                self._refuse_late()

    def _refuse_late(self) -> None:
        raise LogError(
            f"{self.where}: time",
            self.late,
            accepted="time that increases within a run; another label after a restart",
        )

    def disbelieve(self, column: str, rows: Integers) -> None:
        """Count impossible cells of an optional column, which are taken as not known."""
        self.leave_out(_UNBELIEVABLE, column, rows)

    def fill(self, column: str, count: int) -> None:
        """Count cells that were replaced by the quantity's default."""
        self.filled[column] = self.filled.get(column, 0) + count

    def add_intervals(self, intervals: Array, rows: Integers) -> None:
        """Intervals in s between samples of one run, and the later sample's row."""
        if not len(intervals):
            return
        np.add.at(self.intervals, _bin_of(intervals).clip(0, len(self.intervals) - 1), 1)
        at = int(np.argmax(intervals))
        if intervals[at] > self.longest[0]:
            self.longest = (float(intervals[at]), int(rows[at]))

    def add_rows(self, values: dict[str, Array], same: Mask) -> None:
        """Kept rows; ``same`` is whether the row before is in the block and of the same run."""
        power = values["power"]
        self.kept += len(power)
        for name, column in values.items():
            if name != "time":
                self.channels.setdefault(name, _Channel()).add(column)
        self.negative += int(np.count_nonzero(power < 0.0))
        self.latest = max(self.latest, float(np.abs(values["time"]).max(initial=0.0)))
        alike = same.copy()
        for name in ("vx", "vy", "wz", "power"):
            alike[1:] &= values[name][1:] == values[name][:-1]
        self.repeated += int(np.count_nonzero(alike))
        if "battery_voltage" in values and "battery_current" in values:
            product = values["battery_voltage"] * values["battery_current"]
            good = np.isfinite(product)
            self.products += [power[good].sum(), product[good].sum()]

    @property
    def interval(self) -> float:
        """Median interval between samples, s, to 2 %; 0 when no run has two samples."""
        total = int(self.intervals.sum())
        if not total:
            return 0.0
        at = int(np.searchsorted(np.cumsum(self.intervals), 0.5 * total))
        return float(10.0 ** (_DECADES[0] + (at + 0.5) / _BINS_PER_DECADE))

    @property
    def has_uneven_clock(self) -> bool:
        """Whether many intervals are not the usual one, as where rows arrive in bunches."""
        usual = self.interval
        if not usual:
            return False
        low, high = (_bin_of((1.0 + side * UNEVEN) * usual) for side in (-1.0, 1.0))
        even = int(self.intervals[int(low) : int(high) + 1].sum())
        return even < (1.0 - MOST_UNEVEN) * int(self.intervals.sum())

    def refuse(self, *, finished: bool) -> None:
        """Raise LogError for a log whose rows cannot be used.

        Args:
            finished: the whole log was read; before that, only what is certain is judged.
        """
        if not finished and self.seen < _ENOUGH_ROWS:
            return
        for judged in ("impossible", _UNBELIEVABLE):
            for (kind, column), odd in self.odd.items():
                if kind == judged and odd.rows > MOST_IMPOSSIBLE * self.seen:
                    self._refuse_unit(column, odd)
        late = self.odd.get(("late", "time"), _Count(0))
        if finished and late.rows > MOST_BACKWARDS * self.seen:
            self._refuse_late()
        if len(self.ragged) > MOST_RAGGED * (self.seen + len(self.ragged)):
            raise LogError(
                self.where,
                f"{len(self.ragged)} rows have more or fewer cells than there are headings, the "
                f"first is row {self.ragged[0]}",
                accepted="one cell a heading in every row",
            )
        if finished and not self.kept:
            reasons = "; ".join(
                f"{odd.rows} have {_REASONS[kind]} in {column!r}"
                for (kind, column), odd in self.odd.items()
                if kind in _REASONS
            )
            raise LogError(
                self.where,
                f"none of its {self.seen} rows can be used" + (f": {reasons}" if reasons else ""),
                accepted="rows with run, time, vx, vy, wz and power; joulepath logs join for "
                "channels that have rows of their own",
            )
        if self.latest > LATEST_PLAUSIBLE_TIME or self.interval >= LONGEST_PLAUSIBLE_INTERVAL:
            raise LogError(
                f"{self.where}: time",
                f"the unit is not s: samples are {self.interval:.3g} apart and the time reaches "
                f"{self.latest:.4g} (perhaps ms, µs or ns)",
                accepted='s, or a mapping file that names the unit, e.g. unit = "ms"',
            )
        if self.kept >= 20 and self.negative > 0.95 * self.kept:
            raise LogError(
                f"{self.where}: power",
                f"{self._source}is negative in {self.negative} of {self.kept} rows",
                accepted=f"power drawn is positive; {self._turned}",
            )

    @property
    def _source(self) -> str:
        return "which is battery_voltage · battery_current, " if self.multiplied else ""

    @property
    def _turned(self) -> str:
        which = "battery_current" if self.multiplied else "it"
        return f"a mapping file turns {which} with sign = -1"

    def _refuse_unit(self, column: str, odd: _Count) -> None:
        low, high = POSSIBLE.get(column, (-1e4, 1e4))
        unit = unit_of(column)
        guess = f" (perhaps {OFTEN_MISTAKEN[column]})" if column in OFTEN_MISTAKEN else ""
        source = ""
        if column == "power" and self.multiplied:
            source, guess = self._source, " (perhaps mA or mV are read as A and V)"
        raise LogError(
            f"{self.where}: {column}",
            f"{source}{odd.rows} of {self.seen} rows are out of the possible range, the first is "
            f"row {odd.first}; the unit is not {unit}{guess}",
            accepted=f"{low:.4g} to {high:.4g} {unit}, or a mapping file that names the unit",
        )

    def findings(self) -> list[Finding]:
        """All that was found so far."""
        parts = (self._of_rows(), self._of_time(), self._of_channels(), self._of_power())
        return [*self.notes, *(finding for part in parts for finding in part)]

    def _of_rows(self) -> Iterator[Finding]:
        for (kind, name), odd in self.odd.items():
            if kind in _REASONS:
                rows = f"{odd.rows} row{'s' if odd.rows > 1 else ''} with {_REASONS[kind]}"
                text = f"{name}: {rows} left out, the first is row {odd.first}"
                if kind == "missing" and 2 * odd.rows > self.seen:
                    text += "; where it has a rate of its own, joulepath logs join makes its rows"
                if kind == "doubled" and 2 * odd.rows > self.seen:
                    text += "; of times that are rounded only one row each is kept: log finer ones"
                yield Finding(kind, name, odd.rows, text)
        if self.ragged:
            text = (
                f"{len(self.ragged)} rows with more or fewer cells than headings left out, "
                f"the first is row {self.ragged[0]}"
            )
            yield Finding("ragged", "", len(self.ragged), text)
        for name, count in self.filled.items():
            text = f"{name}: {count} cells without a value take the default"
            yield Finding("filled", name, count, text)
        for (kind, name), odd in self.odd.items():
            if kind == _UNBELIEVABLE:
                text = (
                    f"{name}: {odd.rows} values that cannot be are taken as not known, the first "
                    f"is in row {odd.first}"
                )
                yield Finding("impossible", name, odd.rows, text)

    def _of_time(self) -> Iterator[Finding]:
        usual = self.interval
        if usual:
            gaps = int(self.intervals[_bin_of(GAP_INTERVALS * usual) + 1 :].sum())
            if gaps:
                text = (
                    f"time: {gaps} gaps above {GAP_INTERVALS} intervals of {usual:.3g} s, the "
                    f"longest {self.longest[0]:.4g} s before row {self.longest[1]}; no derivative "
                    "is taken across a gap"
                )
                yield Finding("gap", "time", gaps, text)
            if usual >= 5.0 or usual < 1e-4:
                text = (
                    f"time: samples are {usual:.3g} s apart; if the unit is not s, name it in "
                    "a mapping file"
                )
                yield Finding("unit", "time", self.kept, text)
        if self.short_runs:
            text = f"run: {self.short_runs} runs have one row; their derived accelerations are 0"
            yield Finding("one-row run", "run", self.short_runs, text)
        if self.repeated > 0.02 * self.kept:
            text = (
                f"{self.repeated} of {self.kept} rows repeat velocity and power of the row "
                "before: doubled samples, or a channel that is slower than the log"
            )
            yield Finding("repeated", "", self.repeated, text)

    def _of_channels(self) -> Iterator[Finding]:
        for name, channel in self.channels.items():
            unknown = self.kept - channel.known
            if unknown:
                yield Finding("unknown", name, unknown, f"{name}: not known in {unknown} rows")
            if channel.least == channel.most and self.kept > 1:
                if name in _VARY or name.endswith("_temp"):
                    level = f"{name}: constant at {channel.least:.6g}"
                    text = f"{level}; effects that depend on it cannot be identified"
                    yield Finding("constant", name, channel.known, text)
                yield from self._steep(name, channel)
                continue
            yield from self._steep(name, channel)
            if name not in _CLIPS and not name.startswith("wheel_current"):
                continue
            ends = (channel.least, channel.at_least), (channel.most, channel.at_most)
            for value, count in ends:
                if value != 0.0 and self._often(count):
                    text = (
                        f"{name}: {count} rows at exactly {value:.6g}, the outermost value: "
                        "clipped, or a set-point"
                    )
                    yield Finding("clipped", name, count, text)

    def _steep(self, name: str, channel: _Channel) -> Iterator[Finding]:
        steepest = max(abs(channel.least), abs(channel.most))
        if name in ("roll", "pitch") and channel.known and steepest > STEEPEST_PLAUSIBLE:
            text = f"{name}: reaches {np.degrees(steepest):.0f}°, which no wheel holds; if the log "
            text += "has degrees, name the unit in a mapping file"
            yield Finding("unit", name, channel.at_most, text)

    def _often(self, count: int) -> bool:
        return count >= max(20, 0.005 * self.kept)

    def _of_power(self) -> Iterator[Finding]:
        power = self.channels.get("power", _Channel())
        largest = max(abs(power.least), abs(power.most)) if power.known else 0.0
        if power.known and largest < 0.5:
            text = f"power: never above {largest:.3g} W; kW perhaps"
            yield Finding("unit", "power", self.kept, text)
        if power.known and power.most > 5e4:
            text = f"power: reaches {power.most:.3g} W; mW perhaps"
            yield Finding("unit", "power", power.at_most, text)
        if power.least == 0.0 and self._often(power.at_least):
            text = (
                f"power: {power.at_least} rows at exactly 0 and none below: what is fed back when "
                "braking may be cut off"
            )
            yield Finding("clipped", "power", power.at_least, text)
        if self.negative > 0.5 * self.kept:
            which = " for battery_current" if self.multiplied else ""
            text = f"power: negative in {self.negative} of {self.kept} rows; sign = -1{which}"
            text += " perhaps"
            yield Finding("sign", "power", self.negative, text)
        measured, product = self.products
        if product and abs(measured / product - 1.0) > 0.1:
            ratio = f"{measured / product:.3g}"
            text = f"power: its mean is {ratio} times battery_voltage · battery_current"
            yield Finding("disagrees", "power", self.kept, text)
        # Changes over intervals that are wrong are no accelerations; see as_measured.
        if not self.has_uneven_clock:
            yield from self.accelerations.findings(self.kept)


def _bin_of(interval: Array | float) -> Integers:
    """Place of intervals in s in the histogram."""
    return np.asarray(np.floor((np.log10(interval) - _DECADES[0]) * _BINS_PER_DECADE).astype(int))
