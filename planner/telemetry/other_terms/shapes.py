"""Plain shapes over the axes of motion, for effects outside the catalogue.

    dictionary = Dictionary.of(log)     # thresholds and centres from the log's own range
    columns = dictionary.columns(rows)  # (n, number of shapes)

A shape is one column: a power, bump or hinge of the speed, a harmonic of the heading, a hinge of
the slope, a step of the temperature, a decay since the start, alone and times the speed. Shapes
show *that* something is missing, over which quantity, and with which curve. The proposed formula
then has its thresholds and widths fitted (planner.telemetry.diagnosis.unknown_effect).

A log that was driven at three speeds and nothing in between does not determine a curve: any bump on
one of them would fit, and be wrong at the next speed. Such an axis has no shapes. Two loads tell
that something goes with the load: they have straight lines alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import (
    STANDSTILL,
    STEADY_YAW,
    motion_axes,
    temperature_of,
)
from planner.telemetry.sampling import noise_of_motion

HARMONICS = (1, 2, 3, 4, 5, 6, 8)
"""Orders of the harmonics over the heading."""
AIR = "air"
"""Axis of the air's temperature in logs that know the motors' as well: what depends on either is
told as one over the temperature."""
LEAST_RANGE = {
    "speed": 0.05,
    "heading": 0.3,
    "slope_along": 0.01,
    "slope_across": 0.01,
    "yaw_rate": 0.05,
    "acceleration": 0.05,
    "load": 0.1,
    "temperature": 2.0,
    AIR: 2.0,
    "time_since_start": 5.0,
}
"""SI; an axis that varies less (1st to 99th percentile) gets no shapes."""
NOISE_RANGE = 4.65
"""1st to 99th percentile of white noise over its standard deviation."""


AT_ONCE = ("fading", "step")
"""Kinds of shapes that begin or end at once."""
LEAST_LEVELS, LEAST_LOADS = 4, 3
"""Separate levels of an axis; with fewer, a log says nothing about a curve in between. Over the
load shapes go one way only, and three tell a threshold from a straight line. Of two, a line says
all that the log knows."""
LEVEL_GAP, LEVEL_WIDTH = 0.2, 0.25
"""Least gap between levels and largest width of one, as shares of the axis' range."""
STEPS = (0.2, 0.4, 0.6, 0.8)
"""Where something may be switched on or off, as shares of the axis' range."""
STEP_WIDTH = 0.03
"""Width of a step, as a share of the axis' range: a smooth one can be moved by a fit."""
FINE_STEPS = 24
"""Parts of an axis' range between which steps stand beside a meter."""
SWITCHING = ("load", "temperature", AIR, "time_since_start")
"""Axes beside the speed along which something is switched; along slope, turn and acceleration most
rows are near zero, on which side decides the sensor."""
FADING = (0.08, 0.2, 0.5)
"""Speeds over which something fades that starts with the motion, as shares of the top speed."""
KNEES = (0.3, 0.5, 0.7)
"""Speeds from which on something rises, as shares of the top speed."""
LOBES, LOBE_WIDTH = 8, 0.9
"""Headings around which something acts on one side, and how widely, rad; a cosine acts with the
opposite sign on the other side."""
RATES, RATE_WIDTH = (0.2, 0.5), 0.3
"""Yaw rates at which something is strongest, and how widely, as shares of the fastest turn."""


@dataclass(frozen=True)
class Shape:
    """One column over one axis.

    Attributes:
        axis: name of the quantity.
        kind: which function.
        at: its threshold, centre, order or time constant.
        width: of a bump or a step.
        times_speed: 0, 1 or 2: multiplied by this power of the speed.
        own_load: kg, multiplied by this and the payload together; None where the load does nothing.
    """

    axis: str
    kind: str
    at: float = 0.0
    width: float = 0.0
    times_speed: int = 0
    own_load: float | None = None

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names for ``outside_catalogue.quantities``, the telling one first."""
        axis = "temperature" if self.axis == AIR else self.axis
        speed = ("speed",) if self.times_speed and axis != "speed" else ()
        return (axis, *speed, *(() if self.own_load is None else ("load",)))

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
        axes = _beyond_noise(log, _axes(log.rows, temperature))
        ranges: dict[str, tuple[float, float]] = {}
        shapes: list[Shape] = []
        for name, values in axes.items():
            known = values[np.isfinite(values)]
            if len(known) < 0.5 * len(values) or not len(known):
                continue
            low, high = np.percentile(known, [1, 99])
            if high - low >= LEAST_RANGE[name]:
                over = _identifiable(levels(known), shapes_over(name, float(low), float(high)))
                ranges |= {shape.axis: (float(low), float(high)) for shape in over}
                shapes += over
        return cls(tuple(shapes), temperature, ranges)

    def columns(self, rows: Array) -> Array:
        """(n, shapes) values for rows (n, ROW_LENGTH); 0 where an axis is not known."""
        axes = self.axes(rows)
        speed = axes["speed"]
        moving = speed / np.hypot(speed, STANDSTILL)
        known = {name: np.where(np.isfinite(v), v, 0.0) for name, v in axes.items()}
        columns = np.empty((len(rows), len(self.shapes)))
        powers = (np.ones_like(speed), speed, speed * speed)
        for k, shape in enumerate(self.shapes):
            values = values_of(shape, known[shape.axis])
            if shape.axis == "heading" and shape.times_speed == 0:
                values = values * moving
            if shape.own_load is not None:
                values = values * (known["load"] + shape.own_load)
            columns[:, k] = values * powers[shape.times_speed]
            if shape.axis in ("temperature", AIR):
                columns[~np.isfinite(axes[shape.axis]), k] = 0.0
        return columns

    def axes(self, rows: Array) -> dict[str, Array]:
        """Values of every axis that may have shapes, name → (n,), for rows (n, ROW_LENGTH)."""
        return _axes(rows, self.temperature)

    def quadrature(self, number: int) -> int:
        """Number of the sine to a cosine, and of the cosine to a sine."""
        shape = self.shapes[number]
        return self.shapes.index(replace(shape, kind="sin" if shape.kind == "cos" else "cos"))

    @property
    def gradual(self) -> Dictionary:
        """Without shapes that begin or end at once: what a slow meter leaves looks like them."""
        return self.only(shape for shape in self.shapes if shape.kind not in AT_ONCE)

    def switched(self, axis: str) -> Dictionary:
        """With gradual shapes, and steps everywhere along an axis; none where nothing switches."""
        if axis not in (*SWITCHING, "speed"):
            return self.only(())
        low, high = self.ranges[axis]
        places = low + (high - low) * np.arange(1, FINE_STEPS) / FINE_STEPS
        width = STEP_WIDTH * (high - low)
        steps = (Shape(axis, "step", float(place), width) for place in places)
        return self.only((*self.gradual.shapes, *steps))

    def only(self, shapes: Iterable[Shape]) -> Dictionary:
        """The dictionary with other shapes over the axes of the log."""
        return replace(self, shapes=tuple(shapes))


def _axes(rows: Array, temperature: str) -> dict[str, Array]:
    axes = motion_axes(rows, temperature=temperature)
    if temperature == "motor_temp":
        axes[AIR] = rows[:, INDEX["ambient_temp"]].copy()
    return axes


def _beyond_noise(log: Telemetry, axes: dict[str, Array]) -> dict[str, Array]:
    """The axes, without slopes whose readings vary by hardly more than the noise of the tilt.

    On flat ground the tilt is noise, and what it makes of the predicted power goes along with it.
    """
    noise = noise_of_motion(log)
    own = NOISE_RANGE * max(noise["gravity_x"], noise["gravity_y"]) / STANDARD_GRAVITY
    kept = dict(axes)
    for name in ("slope_along", "slope_across"):
        low, high = np.percentile(axes[name], [1, 99])
        if (high - low) ** 2 - own**2 < LEAST_RANGE[name] ** 2:
            del kept[name]
    return kept


def _identifiable(count: float, shapes: list[Shape]) -> list[Shape]:
    """Those of the shapes over an axis that so many separate levels of it identify."""
    if shapes[0].axis != "load":
        return shapes if count >= LEAST_LEVELS else []
    lines = [shape for shape in shapes if (shape.kind, shape.at) == ("power", 1.0)]
    return shapes if count >= LEAST_LOADS else lines


def levels(values: Array) -> float:
    """At how many places values (n,) stand; infinite where they are spread out."""
    low, high = np.percentile(values, [1, 99])
    inside = np.sort(values[(values >= low) & (values <= high)])
    borders = np.flatnonzero(np.diff(inside) > LEVEL_GAP * (high - low)) + 1
    widths = [float(np.ptp(place)) for place in np.split(inside, borders)]
    return len(widths) if max(widths) <= LEVEL_WIDTH * (high - low) else np.inf


def shapes_over(axis: str, low: float, high: float) -> list[Shape]:
    """Shapes over an axis that ranges from ``low`` to ``high`` in a log."""
    span, most = high - low, max(abs(low), abs(high))
    powers: tuple[int, ...] = (0, 1)
    wanted: list[tuple[str, float]]
    places: list[tuple[float, float]]
    # Fans, heaters, brakes and radios are on or off.
    steps = [Shape(axis, "step", low + part * span, STEP_WIDTH * span) for part in STEPS]
    match axis:
        case "speed":
            shapes = [Shape(axis, "power", float(p)) for p in (1, 2, 3)]
            places = [(k, high / count) for count in (6, 12) for k in range(count)]
            shapes += [Shape(axis, "bump", (k + 0.5) * part, 0.7 * part) for k, part in places]
            shapes += [Shape(axis, "above", k * high) for k in KNEES]
            return shapes + [Shape(axis, "fading", k * high) for k in FADING] + steps
        case "heading":
            wanted, powers = [(kind, n) for n in HARMONICS for kind in ("cos", "sin")], (0, 1, 2)
            places = [(2.0 * np.pi * k / LOBES - np.pi, LOBE_WIDTH) for k in range(LOBES)]
            steps = [Shape(axis, "lobe", *place, p) for place in places for p in powers]
        case "slope_along" | "slope_across":
            wanted = [("power", 1), ("size", 1), ("power", 2)]
            for place in (0.25 * most, 0.45 * most, 0.65 * most):
                wanted.append(("outside", place))
                wanted += [("above", place)] if high > place else []
                wanted += [("below", -place)] if -low > place else []
            wanted += [("above", 0), ("below", 0)]
        case "yaw_rate":
            wanted = [("power", 1), ("power", 2), ("size", 1), ("outside", 0.4 * most)]
            wanted += [("above", 0), ("below", 0)]
            places = [(part * most, RATE_WIDTH * most) for part in RATES]
            steps = [Shape(axis, "hump", *place, p) for place in places for p in powers]
        case "acceleration":
            wanted = [("size", 1), ("power", 2), ("above", 0), ("below", 0)]
        case "load":
            wanted = [("power", 1), ("power", 2), ("above", low + 0.5 * span)]
        case "temperature" | "air":
            wanted = [("above", low + part * span) for part in (0.0, 0.35, 0.7)]
        case "time_since_start":
            constants = np.geomspace(max(0.02 * span, 1.0), 0.6 * span, 6)
            wanted = [("power", 1), *(("decay", tau) for tau in constants)]
    shapes = [Shape(axis, kind, float(at), times_speed=p) for kind, at in wanted for p in powers]
    return shapes + steps if axis in (*SWITCHING, "heading", "yaw_rate") else shapes


_FUNCTIONS: dict[str, Callable[[Array, Shape], Array]] = {
    "power": lambda x, shape: x ** int(shape.at),
    "size": lambda x, shape: np.abs(x),
    "bump": lambda x, shape: np.exp(-(((x - shape.at) / shape.width) ** 2)),
    "lobe": lambda x, shape: np.exp((np.cos(x - shape.at) - 1.0) / shape.width**2),
    "hump": lambda x, shape: (
        np.tanh(np.abs(x) / STEADY_YAW) * np.exp(-(((np.abs(x) - shape.at) / shape.width) ** 2))
    ),
    "fading": lambda x, shape: np.tanh(x / STANDSTILL) * np.exp(-x / shape.at),
    "moving": lambda x, shape: np.tanh(x / STANDSTILL),
    "step": lambda x, shape: 0.5 + 0.5 * np.tanh((x - shape.at) / shape.width),
    "cos": lambda x, shape: np.cos(shape.at * x),
    "sin": lambda x, shape: np.sin(shape.at * x),
    "outside": lambda x, shape: np.maximum(np.abs(x) - shape.at, 0.0),
    "above": lambda x, shape: np.maximum(x - shape.at, 0.0),
    "below": lambda x, shape: np.maximum(shape.at - x, 0.0),
    "decay": lambda x, shape: np.exp(-x / shape.at),
}


def values_of(shape: Shape, x: Array) -> Array:
    """A shape's function of its axis alone, (n,)."""
    return np.asarray(_FUNCTIONS[shape.kind](x, shape))
