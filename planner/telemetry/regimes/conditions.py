"""Conditions that a regime is made of: which there are on an axis, and how they read.

    axis = conditions_on("speed", values)       # bins, and every set of bins that has words
    axis.sets[3].words                          # "faster than 0.4 m/s"
    axis.sets[3].holds(values)                  # (n,) bool, on any rows

Thresholds are round figures from the start (0.4 m/s, 5°, 20 s) and lie where few rows are, so that
a cluster of equal speeds is not cut in two. A row belongs to a set by the same comparison that the
words say.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.telemetry.quantities_of_motion import AXES, FURTHER, STANDSTILL
from planner.telemetry.regimes.thresholds import LEAST_ROW_SHARE, best_bounds, thresholds
from planner.telemetry.regimes.words import FOUR_TIMES, ONCE, TWICE, WORDS, heading_words, said

MOST_BINS = 12
"""Bins of an axis, about equally full; a signed axis has half as many on each side."""
SECTOR_DEGREES = 15.0
"""Width of a bin of the heading; borders lie at odd multiples of 7.5°."""


@dataclass(frozen=True)
class Condition:
    """Values of one axis that count in; half open, ``low <= value < high``.

    Attributes:
        axis: name as in quantities_of_motion, or "surface".
        words: how it reads within a sentence.
        low, high: SI or rad; None is open. Of a heading, the middle of the sector is
            (low + high)/2 and low may lie below -π.
        magnitude: True compares |value|.
        period: rad after which a heading's sector repeats; 2π is once.
        label: name of the ground, for "surface".
        number: of that label in the log's list.
        plain: how simple it reads, 1 is simplest.
    """

    axis: str
    words: str
    low: float | None = None
    high: float | None = None
    magnitude: bool = False
    period: float | None = None
    label: str | None = None
    number: int = -1
    plain: float = 1.0

    def holds(self, values: Array) -> Mask:
        """Rows that meet the condition.

        Args:
            values: (n,) of the axis; NaN never meets it.

        Returns:
            (n,) bool.
        """
        if self.label is not None:
            return np.equal(values, self.number)
        if self.period is not None:
            assert self.low is not None
            assert self.high is not None
            return np.mod(values - self.low, self.period) < self.high - self.low
        size = np.abs(values) if self.magnitude else values
        met = np.isfinite(values)
        if self.low is not None:
            met &= size >= self.low
        if self.high is not None:
            met &= size < self.high
        return met

    @property
    def rest(self) -> Condition | None:
        """The other side of a single bound; None where that is no condition."""
        if self.axis in ("heading", "surface") or (self.low is None) == (self.high is None):
            return None
        if {**AXES, **FURTHER}[self.axis].signed and not self.magnitude:
            return None
        unit = _unit(self.axis)
        low, high = (None if bound is None else bound / unit for bound in (self.high, self.low))
        return within(self.axis, low, high, magnitude=self.magnitude)

    def to_json(self) -> dict[str, object]:
        """Axis and bounds, ready for JSON."""
        document: dict[str, object] = {"axis": self.axis}
        if self.label is not None:
            return {**document, "label": self.label}
        document |= {"low": self.low, "high": self.high}
        if self.magnitude:
            document["magnitude"] = True
        if self.period is not None:
            document["period"] = self.period
        return document


@dataclass(frozen=True)
class AxisBins:
    """One axis cut into bins, and the sets of bins that make a condition.

    Attributes:
        name: of the axis.
        code: (n,) bin of every row; the last bin is "not known" and in no set.
        count: number of bins, that one included.
        sets: conditions.
        member: (sets, count) 1.0 where a bin belongs to a set.
        paired: (sets,) whether it is also tried together with a condition on another axis.
    """

    name: str
    code: Integers
    count: int
    sets: tuple[Condition, ...]
    member: Array
    paired: Mask


def conditions_on(name: str, values: Array, *, labels: Sequence[str] = ()) -> AxisBins | None:
    """Bins and conditions of an axis; None when its values do not vary.

    Args:
        name: of the axis; "surface" with ``labels``.
        values: (n,), NaN where not known.
        labels: names of the grounds that the values of "surface" number.
    """
    if name == "surface":
        return _surfaces(values, labels)
    known = values[np.isfinite(values)]
    if len(known) < 2 * MOST_BINS:
        return None
    if name == "heading":
        return _sectors(values)
    say, unit = WORDS[name], _unit(name)
    axis = {**AXES, **FURTHER}[name]
    if axis.signed:
        bounds = thresholds(np.abs(known) / unit, MOST_BINS // 2, say.least)
        sets = [*_signed_sets(name, bounds)]
        edges = np.unique(np.concatenate([-bounds, bounds])) * unit
    else:
        bounds = thresholds(known / unit, MOST_BINS, say.least)
        if name == "speed":
            bounds = _with_standstill(known, bounds)
        elif name == "predicted_power":
            bounds = _with_reversal(known, bounds)
        sets = [*_plain_sets(name, bounds)]
        edges = bounds * unit
    # Half-open to the right: -0.3 itself is not below -0.3.
    if not len(edges):
        return None
    code = np.searchsorted(edges, values, side="right")
    code[~np.isfinite(values)] = len(edges) + 1
    # A value inside every bin tells which sets it belongs to; magnitudes are symmetrical.
    inside = np.concatenate([[edges[0] - 1.0], (edges[:-1] + edges[1:]) / 2.0, [edges[-1] + 1.0]])
    return _binned(name, code, inside, sets)


def _binned(
    name: str, code: Integers, inside: Array, sets: Sequence[tuple[Condition, bool]]
) -> AxisBins:
    """An axis by the bins of its rows (n,), a value inside every bin (k,), sets and their use."""
    conditions, paired = zip(*sets, strict=True)
    member = np.array([np.append(c.holds(inside), False) for c in conditions], dtype=float)
    return AxisBins(name, code, len(inside) + 1, conditions, member, np.array(paired))


# Conditions

_DEGREE = np.pi / 180.0


def within(
    name: str, low: float | None, high: float | None, *, magnitude: bool = False
) -> Condition:
    """A condition by its bounds.

    Args:
        name: of an axis, not the heading nor the ground.
        low, high: in the unit of words; None is open.
        magnitude: bounds of |value|.
    """
    unit = _unit(name)
    plain = 0.85 if name in FURTHER else 1.0
    if low is not None and high is not None and low != STANDSTILL:
        plain *= 0.9
    begin, end = (None if bound is None else float(bound * unit) for bound in (low, high))
    return Condition(name, said(name, low, high, magnitude), begin, end, magnitude, plain=plain)


def refined(condition: Condition, values: Array, residual: Array) -> Condition:
    """The condition with nearby bounds that explain more of a residual.

    Args:
        condition: on a heading or a ground it stays as it is.
        values: (n,) of its axis, over the rows that all other conditions let through.
        residual: (n,) W of these rows.
    """
    name = condition.axis
    if name in ("heading", "surface"):
        return condition
    unit, known = _unit(name), np.isfinite(values)
    if not known.any():
        return condition  # the others, moved already, let nothing through that has a value here
    size = (np.abs(values) if condition.magnitude else values)[known] / unit
    low, high = (None if v is None else v / unit for v in (condition.low, condition.high))
    # What stands is known from the start.
    fixed = {"speed": STANDSTILL, "predicted_power": 0.0}.get(name)
    best = best_bounds(size, residual[known], low, high, WORDS[name].least)
    low, high = (old if old == fixed else new for old, new in zip((low, high), best, strict=True))
    return within(name, low, high, magnitude=condition.magnitude)


def _unit(name: str) -> float:
    return _DEGREE if WORDS[name].degrees else 1.0


def _with_standstill(values: Array, bounds: Array) -> Array:
    """Bounds on the speed with STANDSTILL as the first one, where some rows stand."""
    if not len(bounds) or np.mean(values < STANDSTILL) < LEAST_ROW_SHARE:
        return bounds
    return np.append(STANDSTILL, bounds[bounds > 2.0 * STANDSTILL])


def _with_reversal(values: Array, bounds: Array) -> Array:
    """Bounds on the predicted power with 0 among them, where enough rows flow back."""
    if np.mean(values < 0.0) < LEAST_ROW_SHARE or np.mean(values > 0.0) < LEAST_ROW_SHARE:
        return bounds
    return np.unique(np.append(bounds, 0.0))


def _plain_sets(name: str, bounds: Array) -> Iterator[tuple[Condition, bool]]:
    for k, low in enumerate(bounds):
        yield within(name, low, None), True
        yield within(name, None, low), True
        for high in bounds[k + 1 :]:
            yield within(name, low, high), name == "speed" and low == STANDSTILL


def _signed_sets(name: str, bounds: Array) -> Iterator[tuple[Condition, bool]]:
    for k, low in enumerate(bounds):
        yield within(name, low, None), True
        yield within(name, None, -low), True
        yield within(name, low, None, magnitude=True), True
        yield within(name, None, low, magnitude=True), True
        for high in bounds[k + 1 :]:
            yield within(name, low, high), False
            yield within(name, -high, -low), False


# Headings and grounds


def _sectors(values: Array) -> AxisBins | None:
    bins = round(360.0 / SECTOR_DEGREES)
    place = np.floor((np.degrees(values) + SECTOR_DEGREES / 2.0) / SECTOR_DEGREES)
    code = np.where(np.isfinite(values), np.mod(place, bins), bins).astype(np.int64)
    if len(np.unique(code[code < bins])) < 2:
        return None
    middles = np.radians(np.arange(bins) * SECTOR_DEGREES)
    return _binned("heading", code, middles, [(sector, True) for sector in _heading_sets()])


def _heading_sets() -> Iterator[Condition]:
    for period, names, halves in (
        (360, ONCE, (22.5, 52.5, 82.5)),
        (180, TWICE, (22.5, 37.5, 52.5)),
        (120, {}, (22.5,)),
        (90, FOUR_TIMES, (22.5,)),
    ):
        for centre in range(0, period, round(SECTOR_DEGREES)):
            for half in halves:
                named = names.get(centre)
                if named is None:
                    words, plain = heading_words(centre, period, half), 0.75
                elif half == halves[0]:
                    words, plain = named, 1.0
                else:
                    words, plain = f"{named} (±{half:.0f}°)", 0.95
                sector = (centre - half, centre + half, period)
                low, high, turn = (float(np.radians(angle)) for angle in sector)
                yield Condition("heading", words, low, high, period=turn, plain=plain)


def _surfaces(values: Array, labels: Sequence[str]) -> AxisBins | None:
    numbers = [k for k in range(len(labels)) if np.any(values == k)]
    if len(numbers) < 2:
        return None
    code = np.full(len(values), len(numbers))
    for place, number in enumerate(numbers):
        code[values == number] = place
    sets = [
        (Condition("surface", f"on {labels[number]}", label=labels[number], number=number), True)
        for number in numbers
    ]
    return _binned("surface", code, np.array(numbers, float), sets)
