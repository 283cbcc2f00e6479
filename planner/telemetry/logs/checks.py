"""What is odd about a log: findings for its report, and the reasons to refuse it.

Everything is gathered while the rows pass by once (counts, extremes, a histogram of intervals), so
that a log of any length is checked in constant memory. A finding never changes a row; rows that
the reader left out are counted here, by column and reason.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array, Integers
from planner.errors import LogError
from planner.telemetry.logs.columns import OFTEN_MISTAKEN, POSSIBLE, unit_of

MOST_IMPOSSIBLE = 0.01  # share of rows; above it, the unit is wrong and not the sensor
MOST_RAGGED = 0.05
_ENOUGH = 1000  # rows before a share is judged while the log is still being read
_DECADES, _BINS = (-9, 9), 100
_CLIPS = ("vx", "vy", "wz", "ax", "ay", "power", "battery_current")
_VARY = ("vx", "vy", "wz", "power", "ax", "ay", "roll", "pitch", "battery_voltage")
_REASONS = {
    "missing": "no value",
    "impossible": "a value that cannot be",
    "doubled": "the time of the row before",
}


@dataclass(frozen=True)
class Finding:
    """One thing that a user should know about a log.

    Attributes:
        kind: "missing", "impossible", "doubled", "gap", "constant", "clipped", ...
        column: the quantity or heading concerned; "" for the whole log.
        rows: how many rows are concerned.
        sentence: what was found and what was done about it.
    """

    kind: str
    column: str
    rows: int
    sentence: str


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
class _Left:
    rows: int = 0
    first: int = 0


@dataclass
class Checks:
    """Running account of one log."""

    where: str
    kept: int = 0
    seen: int = 0
    notes: list[Finding] = field(default_factory=list)
    ragged: list[int] = field(default_factory=list)
    left_out: dict[tuple[str, str], _Left] = field(default_factory=dict)
    disbelieved: dict[str, _Left] = field(default_factory=dict)
    filled: dict[str, int] = field(default_factory=dict)
    channels: dict[str, _Channel] = field(default_factory=dict)
    intervals: Integers = field(
        default_factory=lambda: np.zeros((_DECADES[1] - _DECADES[0]) * _BINS, np.int64)
    )
    longest: tuple[float, int] = (0.0, 0)
    short_runs: int = 0
    repeated: int = 0
    negative: int = 0
    latest: float = 0.0
    products: Array = field(default_factory=lambda: np.zeros(2))
    leak: Array = field(default_factory=lambda: np.zeros(3))

    def leave_out(self, kind: str, column: str, rows: Integers) -> None:
        """Count rows that do not enter the result."""
        if len(rows):
            left = self.left_out.setdefault((kind, column), _Left(0, int(rows[0])))
            left.rows += len(rows)

    def disbelieve(self, column: str, rows: Integers) -> None:
        """Count cells of an optional column that cannot be and are taken as not known."""
        left = self.disbelieved.setdefault(column, _Left(0, int(rows[0])))
        left.rows += len(rows)

    def fill(self, column: str, count: int) -> None:
        """Count cells that were replaced by the quantity's default."""
        if count:
            self.filled[column] = self.filled.get(column, 0) + count

    def add_intervals(self, intervals: Array, rows: Integers) -> None:
        """Intervals in s between samples of one run, and the later sample's row."""
        if not len(intervals):
            return
        bins = np.floor((np.log10(intervals) - _DECADES[0]) * _BINS)
        np.add.at(self.intervals, np.clip(bins, 0, len(self.intervals) - 1).astype(np.int64), 1)
        at = int(np.argmax(intervals))
        if intervals[at] > self.longest[0]:
            self.longest = (float(intervals[at]), int(rows[at]))

    def add_rows(self, values: dict[str, Array], same: NDArray[np.bool_]) -> None:
        """Kept rows; ``same`` tells whether the row before is in the block and of the same run."""
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

    def add_acceleration(self, surplus: Array, gravity: Array) -> None:
        """Acceleration as logged minus as derived, beside gravity on the same axis, m/s²."""
        good = np.isfinite(surplus)
        s, g = surplus[good], gravity[good]
        self.leak += [float(s @ g), float(g @ g), float(s @ s)]

    @property
    def interval(self) -> float:
        """Median interval between samples, s, to 2 %; 0 when no run has two samples."""
        total = int(self.intervals.sum())
        if not total:
            return 0.0
        at = int(np.searchsorted(np.cumsum(self.intervals), 0.5 * total))
        return float(10.0 ** (_DECADES[0] + (at + 0.5) / _BINS))

    def refuse(self, *, finished: bool) -> None:
        """Raise LogError for a log whose rows cannot be used.

        Args:
            finished: the whole log was read; before that, only what is certain is judged.
        """
        if not finished and self.seen < _ENOUGH:
            return
        for (kind, column), left in self.left_out.items():
            if kind == "impossible" and left.rows > MOST_IMPOSSIBLE * self.seen:
                self._refuse_unit(column, left)
        for column, left in self.disbelieved.items():
            if left.rows > MOST_IMPOSSIBLE * self.seen:
                self._refuse_unit(column, left)
        if len(self.ragged) > MOST_RAGGED * (self.seen + len(self.ragged)):
            raise LogError(
                self.where,
                f"{len(self.ragged)} rows have more or fewer cells than there are headings, the "
                f"first is row {self.ragged[0]}",
                accepted="one cell a heading in every row",
            )
        if finished and not self.kept:
            reasons = "; ".join(
                f"{left.rows} have {_REASONS[kind]} in {column!r}"
                for (kind, column), left in self.left_out.items()
            )
            raise LogError(
                self.where,
                f"none of its {self.seen} rows can be used" + (f": {reasons}" if reasons else ""),
                accepted="rows with run, time, vx, vy, wz and power",
            )
        self._refuse_time()
        if self.kept >= 20 and self.negative > 0.95 * self.kept:
            raise LogError(
                f"{self.where}: power",
                f"is negative in {self.negative} of {self.kept} rows",
                accepted="power drawn is positive; a mapping file turns it with sign = -1",
            )

    def _refuse_unit(self, column: str, left: _Left) -> None:
        low, high = POSSIBLE.get(column, (-1e4, 1e4))
        unit = unit_of(column)
        guess = f" (perhaps {OFTEN_MISTAKEN[column]})" if column in OFTEN_MISTAKEN else ""
        raise LogError(
            f"{self.where}: {column}",
            f"{left.rows} of {self.seen} rows are out of the possible range, the first is row "
            f"{left.first}; the unit is not {unit}{guess}",
            accepted=f"{low:.4g} to {high:.4g} {unit}, or a mapping file that names the unit",
        )

    def _refuse_time(self) -> None:
        if self.latest > 1e11 or self.interval >= 100.0:
            raise LogError(
                f"{self.where}: time",
                f"the unit is not s: samples are {self.interval:.3g} apart and the time reaches "
                f"{self.latest:.4g} (perhaps ms, µs or ns)",
                accepted='s, or a mapping file that names the unit, e.g. unit = "ms"',
            )

    def findings(self) -> list[Finding]:
        """All that was found so far."""
        found = [*self.notes]
        found += [
            Finding(
                kind,
                column,
                left.rows,
                f"{column}: {left.rows} row{'s' if left.rows > 1 else ''} with {_REASONS[kind]} "
                f"left out, the first is row {left.first}",
            )
            for (kind, column), left in self.left_out.items()
        ]
        if self.ragged:
            found.append(
                Finding(
                    "ragged",
                    "",
                    len(self.ragged),
                    f"{len(self.ragged)} rows with more or fewer cells than headings left out, "
                    f"the first is row {self.ragged[0]}",
                )
            )
        found += [
            Finding(
                "filled", name, count, f"{name}: {count} cells without a value take the default"
            )
            for name, count in self.filled.items()
        ]
        found += [
            Finding(
                "impossible",
                name,
                left.rows,
                f"{name}: {left.rows} values that cannot be are taken as not known, the first is "
                f"in row {left.first}",
            )
            for name, left in self.disbelieved.items()
        ]
        return found + self._of_time() + self._of_channels() + self._of_power()

    def _of_time(self) -> list[Finding]:
        found = []
        usual = self.interval
        if usual:
            edge = int(np.floor((np.log10(2.5 * usual) - _DECADES[0]) * _BINS))
            gaps = int(self.intervals[edge + 1 :].sum())
            if gaps:
                found.append(
                    Finding(
                        "gap",
                        "time",
                        gaps,
                        f"time: {gaps} gaps above 2.5 intervals of {usual:.3g} s, the longest "
                        f"{self.longest[0]:.4g} s before row {self.longest[1]}; no derivative is "
                        "taken across a gap",
                    )
                )
            if usual >= 5.0 or usual < 1e-4:
                found.append(
                    Finding(
                        "unit",
                        "time",
                        self.kept,
                        f"time: samples are {usual:.3g} s apart; if the unit is not s, name it in "
                        "a mapping file",
                    )
                )
        if self.short_runs:
            found.append(
                Finding(
                    "one-row run",
                    "run",
                    self.short_runs,
                    f"run: {self.short_runs} runs have one row; their derived accelerations are 0",
                )
            )
        if self.repeated > 0.02 * self.kept:
            found.append(
                Finding(
                    "repeated",
                    "",
                    self.repeated,
                    f"{self.repeated} of {self.kept} rows repeat velocity and power of the row "
                    "before: doubled samples, or a channel that is slower than the log",
                )
            )
        return found

    def _of_channels(self) -> list[Finding]:
        found = []
        for name, channel in self.channels.items():
            unknown = self.kept - channel.known
            if unknown:
                found.append(
                    Finding("unknown", name, unknown, f"{name}: not known in {unknown} rows")
                )
            if channel.least == channel.most and self.kept > 1:
                if name in _VARY or name.endswith("_temp"):
                    found.append(
                        Finding(
                            "constant",
                            name,
                            channel.known,
                            f"{name}: constant at {channel.least:.6g}; what depends on it cannot "
                            "be told",
                        )
                    )
                continue
            if name not in _CLIPS and not name.startswith("wheel_current"):
                continue
            for value, count in (
                (channel.least, channel.at_least),
                (channel.most, channel.at_most),
            ):
                if value != 0.0 and count >= max(20, 0.005 * self.kept):
                    found.append(
                        Finding(
                            "clipped",
                            name,
                            count,
                            f"{name}: {count} rows at exactly {value:.6g}, the outermost value: "
                            "clipped, or a set-point",
                        )
                    )
        return found

    def _of_power(self) -> list[Finding]:
        found = []
        power = self.channels.get("power", _Channel())
        largest = max(abs(power.least), abs(power.most)) if power.known else 0.0
        if power.known and largest < 0.5:
            text = f"power: never above {largest:.3g} W; kW perhaps"
            found.append(Finding("unit", "power", self.kept, text))
        if power.known and power.most > 5e4:
            text = f"power: reaches {power.most:.3g} W; mW perhaps"
            found.append(Finding("unit", "power", power.at_most, text))
        if power.least == 0.0 and power.at_least >= max(20, 0.005 * self.kept):
            text = (
                f"power: {power.at_least} rows at exactly 0 and none below: what is fed back when "
                "braking may be cut off"
            )
            found.append(Finding("clipped", "power", power.at_least, text))
        if self.negative > 0.5 * self.kept:
            text = f"power: negative in {self.negative} of {self.kept} rows; sign = -1 perhaps"
            found.append(Finding("sign", "power", self.negative, text))
        measured, product = self.products
        if product and abs(measured / product - 1.0) > 0.1:
            text = (
                f"power: its mean is {measured / product:.3g} times battery_voltage · "
                "battery_current"
            )
            found.append(Finding("disagrees", "power", self.kept, text))
        along, gravity, _ = self.leak
        if gravity > 0.01 * self.kept and abs(along / gravity) > 0.5:
            text = (
                f"ax, ay: follow gravity along the slope with a factor of {along / gravity:.2f} "
                "beside the change of velocity: gravity seems to be in them"
            )
            found.append(Finding("gravity", "ax", self.kept, text))
        return found
