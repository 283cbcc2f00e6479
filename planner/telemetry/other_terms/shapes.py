"""Plain shapes over the axes of motion, for what the catalogue does not have.

    dictionary = Dictionary.of(log)     # thresholds and centres from the log's own range
    columns = dictionary.columns(rows)  # (n, number of shapes)

A shape is one column: a power or a bump of the speed, a harmonic of the heading, a hinge of the
slope, a decay since the start, each alone and times the speed. Shapes are there to show *that*
something is missing, over which quantity, and with which curve; the formula that is proposed then
has its thresholds and widths fitted (planner.telemetry.diagnosis.unknown_effect).

A quantity that was driven at three speeds, say, and nothing in between says nothing about a curve:
any bump on one of them would fit, and be wrong at the next speed. Such an axis has no shapes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import STANDSTILL, motion_axes, temperature_of

HARMONICS = (1, 2, 3, 4, 5, 6, 8)
LEAST_RANGE = {
    "speed": 0.05,
    "heading": 0.3,
    "slope_along": 0.01,
    "slope_across": 0.01,
    "yaw_rate": 0.05,
    "acceleration": 0.05,
    "load": 0.1,
    "temperature": 2.0,
    "time_since_start": 5.0,
}
"""An axis that varies less than this (1st to 99th percentile) tells nothing."""


LEAST_LEVELS = 4
"""An axis on which values stand at fewer places than this, far apart, tells no curve."""
FAR_APART, NARROW = 0.2, 0.25
"""Gap between such places, and the most that each may be wide, as shares of the axis' range."""


@dataclass(frozen=True)
class Shape:
    """One column over one axis.

    Attributes:
        axis: name of the quantity.
        kind: which function.
        at: its threshold, centre, order or time constant.
        width: of a bump.
        times_speed: 0, 1 or 2: multiplied by this power of the speed.
    """

    axis: str
    kind: str
    at: float = 0.0
    width: float = 0.0
    times_speed: int = 0

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names for ``outside_catalogue.quantities``, the telling one first."""
        if self.times_speed and self.axis != "speed":
            return (self.axis, "speed")
        return (self.axis,)

    @property
    def family(self) -> tuple[str, str, int]:
        """Shapes of one family differ in their place only."""
        kind = "harmonic" if self.kind in ("cos", "sin") else self.kind
        return self.axis, kind, self.times_speed


@dataclass(frozen=True)
class Dictionary:
    """All shapes for one log.

    Attributes:
        shapes: the columns in order.
        temperature: quantity that stands for the temperature axis.
        ranges: axis → 1st and 99th percentile of the axes that vary.
    """

    shapes: tuple[Shape, ...]
    temperature: str
    ranges: dict[str, tuple[float, float]]

    @classmethod
    def of(cls, log: Telemetry) -> Dictionary:
        """The dictionary for a log: only axes that vary, with places inside their range."""
        temperature = temperature_of(log.rows)
        axes = motion_axes(log.rows, temperature=temperature)
        ranges: dict[str, tuple[float, float]] = {}
        for name, values in axes.items():
            known = values[np.isfinite(values)]
            if len(known) < 0.5 * len(values) or not len(known):
                continue
            low, high = np.percentile(known, [1, 99])
            if high - low >= LEAST_RANGE[name] and levels(known) >= LEAST_LEVELS:
                ranges[name] = (float(low), float(high))
        shapes: list[Shape] = []
        for name, (low, high) in ranges.items():
            shapes += _OF_AXIS[name](low, high)
        return cls(tuple(shapes), temperature, ranges)

    def columns(self, rows: Array) -> Array:
        """(n, shapes) values for rows (n, ROW_LENGTH); 0 where an axis is not known."""
        axes = motion_axes(rows, temperature=self.temperature)
        speed = axes["speed"]
        moving = speed / np.hypot(speed, STANDSTILL)
        known = {name: np.where(np.isfinite(v), v, 0.0) for name, v in axes.items()}
        columns = np.empty((len(rows), len(self.shapes)))
        powers = (np.ones_like(speed), speed, speed * speed)
        for k, shape in enumerate(self.shapes):
            values = values_of(shape, known[shape.axis])
            if shape.axis == "heading" and shape.times_speed == 0:
                values = values * moving
            columns[:, k] = values * powers[shape.times_speed]
            if shape.axis == "temperature":
                columns[~np.isfinite(axes["temperature"]), k] = 0.0
        return columns

    def only(self, shapes: Iterable[Shape]) -> Dictionary:
        """The dictionary with other shapes over the axes of the log."""
        return replace(self, shapes=tuple(shapes))


def levels(values: Array) -> float:
    """At how many places values (n,) stand; infinite where they are spread out."""
    low, high = np.percentile(values, [1, 99])
    inside = np.sort(values[(values >= low) & (values <= high)])
    borders = np.flatnonzero(np.diff(inside) > FAR_APART * (high - low)) + 1
    widths = [float(np.ptp(place)) for place in np.split(inside, borders)]
    return len(widths) if max(widths) <= NARROW * (high - low) else np.inf


def _times(shapes: list[Shape], powers: tuple[int, ...] = (0, 1)) -> list[Shape]:
    return [Shape(s.axis, s.kind, s.at, s.width, p) for s in shapes for p in powers]


def _speed(low: float, high: float) -> list[Shape]:
    del low
    shapes = [Shape("speed", "power", float(p)) for p in (1, 2, 3)]
    for count in (6, 12):
        step = high / count
        shapes += [Shape("speed", "bump", (k + 0.5) * step, 0.7 * step) for k in range(count)]
    return shapes


def _heading(low: float, high: float) -> list[Shape]:
    del low, high
    shapes = [Shape("heading", kind, float(n)) for n in HARMONICS for kind in ("cos", "sin")]
    return _times(shapes, (0, 1, 2))


def _slope(axis: str, low: float, high: float) -> list[Shape]:
    most = max(abs(low), abs(high))
    shapes = [Shape(axis, "power", 1.0), Shape(axis, "size", 1.0), Shape(axis, "power", 2.0)]
    for part in (0.25, 0.45, 0.65):
        shapes.append(Shape(axis, "outside", part * most))
        if high > part * most:
            shapes.append(Shape(axis, "above", part * most))
        if -low > part * most:
            shapes.append(Shape(axis, "below", -part * most))
    shapes += [Shape(axis, "above", 0.0)]
    return _times(shapes)


def _along(low: float, high: float) -> list[Shape]:
    return _slope("slope_along", low, high)


def _across(low: float, high: float) -> list[Shape]:
    return _slope("slope_across", low, high)


def _yaw(low: float, high: float) -> list[Shape]:
    most = max(abs(low), abs(high))
    shapes = [Shape("yaw_rate", "power", 1.0), Shape("yaw_rate", "power", 2.0)]
    shapes += [Shape("yaw_rate", "size", 1.0), Shape("yaw_rate", "outside", 0.4 * most)]
    return _times(shapes)


def _acceleration(low: float, high: float) -> list[Shape]:
    del low, high
    shapes = [Shape("acceleration", "size", 1.0), Shape("acceleration", "power", 2.0)]
    shapes += [Shape("acceleration", "above", 0.0), Shape("acceleration", "below", 0.0)]
    return _times(shapes)


def _load(low: float, high: float) -> list[Shape]:
    shapes = [Shape("load", "power", 1.0), Shape("load", "power", 2.0)]
    shapes += [Shape("load", "above", low + 0.5 * (high - low))]
    return _times(shapes)


def _temperature(low: float, high: float) -> list[Shape]:
    shapes = [Shape("temperature", "above", low + part * (high - low)) for part in (0.0, 0.35, 0.7)]
    return _times(shapes)


def _time(low: float, high: float) -> list[Shape]:
    shapes = [Shape("time_since_start", "power", 1.0)]
    constants = np.geomspace(max(0.02 * (high - low), 1.0), 0.6 * (high - low), 6)
    shapes += [Shape("time_since_start", "decay", float(tau)) for tau in constants]
    return _times(shapes)


_OF_AXIS = {
    "speed": _speed,
    "heading": _heading,
    "slope_along": _along,
    "slope_across": _across,
    "yaw_rate": _yaw,
    "acceleration": _acceleration,
    "load": _load,
    "temperature": _temperature,
    "time_since_start": _time,
}


def values_of(shape: Shape, x: Array) -> Array:
    """A shape's function of its axis alone, (n,)."""
    if shape.kind == "power":
        return np.asarray(x ** int(shape.at))
    if shape.kind == "size":
        return np.abs(x)
    if shape.kind == "bump":
        return np.asarray(np.exp(-(((x - shape.at) / shape.width) ** 2)))
    if shape.kind == "cos":
        return np.cos(shape.at * x)
    if shape.kind == "sin":
        return np.sin(shape.at * x)
    if shape.kind == "outside":
        return np.maximum(np.abs(x) - shape.at, 0.0)
    if shape.kind == "above":
        return np.maximum(x - shape.at, 0.0)
    if shape.kind == "below":
        return np.maximum(shape.at - x, 0.0)
    if shape.kind == "decay":
        return np.asarray(np.exp(-x / shape.at))
    raise ValueError(shape.kind)
