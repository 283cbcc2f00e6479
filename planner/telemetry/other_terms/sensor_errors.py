"""Sensor faults that look like missing physics: what each would add to the residual.

    for sensor in SENSORS.values():
        column = sensor.column(log, model, watts)          # (n,) W per unit of the error
    corrected = sensor.correct(log, value)                 # the log as a right sensor would have it

A sensor fault competes with the catalogue: with a slope sensor that is two degrees off, a robot
seems to climb for nothing.

    slope_offset          rad   added to pitch: gravity is turned about the left axis
    roll_offset           rad   added to roll
    speed_scale           1     vx and vy are too large by this share (with derived acceleration)
    heading_misalignment  rad   velocity is turned by this angle in the body frame
    power_scale           1     power is too large by this share

A biased accelerometer does what a tilted angle does: where acceleration was measured, the sentence
names both. An offset of the power is not among them: it is aliased with the electronics' constant
load. Neither is a delay, which belongs to the meter (planner.telemetry.estimation.meter_fit).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict


@dataclass(frozen=True)
class Sensor:
    """One error of a sensor.

    Attributes:
        kind: its name.
        unit: of its size.
        least: the smallest size that is called an error; below it, what rows average over and
            what derivatives blur looks the same.
        usual: standard deviation of such errors over sensors in use.
        limit: the largest size that is believed.
        step: size at which its column is taken at first.
        sentence: with places for the size and for words about its sign.
        signs: of each place, the words above and below zero.
        correct: log and size → the log without this error.
    """

    kind: str
    unit: str
    least: float
    usual: float
    limit: float
    step: float
    sentence: str
    signs: tuple[str, ...]
    correct: Callable[[Telemetry, float], Telemetry]

    def is_read_in(self, present: Collection[str]) -> bool:
        """Whether a log that measured these quantities reads this sensor at all."""
        angle, acceleration, _ = _TILTED.get(self.kind, ((), "", 0.0))
        return not angle or acceleration in present or any(name in present for name in angle)

    def said(self, value: float, stderr: float, present: Collection[str] = ()) -> str:
        """An error in words, its size in degrees or per cent, and what does the same.

        Args:
            value: SI.
            stderr: its standard error.
            present: names of the quantities that were measured.
        """
        scale, unit = (180.0 / np.pi, "°") if self.unit == "rad" else (100.0, " %")
        size = f"{scale * abs(value):.3g}{unit} (± {scale * stderr:.1g}{unit})"
        chosen = self.signs[::2] if value > 0.0 else self.signs[1::2]
        sentence = self.sentence.format(size, *chosen)
        angle, name, sign = _TILTED.get(self.kind, ((), "", 0.0))
        if name in present:
            also = sign * STANDARD_GRAVITY * value
            biased = f"{abs(also):.2g} m/s² too {_HIGH[0 if also > 0.0 else 1]}"
            if not any(one in present for one in angle):
                return f"{name} reads {biased}"
            sentence += f", or {name} {biased}"
        return sentence

    def column(
        self, log: Telemetry, model: PowerModel, watts: Array, size: float | None = None
    ) -> Array:
        """What an error of this sensor adds to the residual.

        Args:
            log: the rows as measured.
            model: the model.
            watts: (n,) W that the model says for the rows as measured.
            size: of the error at which the secant is taken; None takes ``step``.

        Returns:
            (n,) W per unit of the error.
        """
        if self.kind == "power_scale":
            return watts.copy()
        size = self.step if size is None else size
        return (predict(model, self.correct(log, size)) - watts) / size


def _changed(log: Telemetry, **columns: Array) -> Telemetry:
    rows = log.rows.copy()
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    return replace(log, rows=rows)


def _column(log: Telemetry, name: str) -> Array:
    return log.rows[:, INDEX[name]]


def _pitched(log: Telemetry, offset: float) -> Telemetry:
    x, z = _column(log, "gravity_x"), _column(log, "gravity_normal")
    cos, sin = np.cos(offset), np.sin(offset)
    return _changed(log, gravity_x=x * cos - z * sin, gravity_normal=z * cos + x * sin)


def _rolled(log: Telemetry, offset: float) -> Telemetry:
    y, z = _column(log, "gravity_y"), _column(log, "gravity_normal")
    cos, sin = np.cos(offset), np.sin(offset)
    return _changed(log, gravity_y=y * cos + z * sin, gravity_normal=z * cos - y * sin)


def _from_velocity(log: Telemetry) -> list[tuple[str, str]]:
    """Pairs of columns that an error of the velocity is in."""
    # Where acceleration was measured its sensor may be aligned or not; the velocity's may not.
    return [("vx", "vy"), *([("ax", "ay")] if "ax" not in log.present else [])]


def _slower(log: Telemetry, share: float) -> Telemetry:
    names = [name for pair in _from_velocity(log) for name in pair]
    return _changed(log, **{name: _column(log, name) / (1.0 + share) for name in names})


def _turned(log: Telemetry, angle: float) -> Telemetry:
    cos, sin = np.cos(angle), np.sin(angle)
    changed = {}
    for first, second in _from_velocity(log):
        x, y = _column(log, first), _column(log, second)
        changed[first], changed[second] = x * cos + y * sin, y * cos - x * sin
    return _changed(log, **changed)


def _smaller_power(log: Telemetry, share: float) -> Telemetry:
    return replace(log, power=log.power / (1.0 + share))


# Of each kind of error: the smallest that is named, the usual one, the largest that is believed,
# and the size that its column is taken at first.
_TILT = 0.004, 0.02, 0.12, 0.01
"""rad."""
_SPEED = 0.01, 0.04, 0.25, 0.02
"""Share of the speed."""
_TURN = 0.01, 0.05, 0.3, 0.02
"""rad."""
_POWER = 0.01, 0.05, 0.4, 0.02
"""Share of the power."""
_HIGH = "high", "low"
_TILTED: dict[str, tuple[tuple[str, ...], str, float]] = {
    "slope_offset": (("pitch", "gravity_x"), "ax", -1.0),
    "roll_offset": (("roll", "gravity_y"), "ay", 1.0),
}
"""Of a tilted angle: columns that it stands in, and what a biased accelerometer reads that does the
same, g times the angle with this sign. The wheels of a moving robot give the sum of both forces;
only rows at rest differ."""
_TURNED = "the velocity in the body frame is turned {} to the {}"
_SCALED = "power reads {} too {}, or the mass in the data sheet is too {} by as much"
SENSORS: dict[str, Sensor] = {
    kind: Sensor(kind, unit, *sizes, sentence, signs, correct)
    for kind, unit, sizes, sentence, signs, correct in (
        ("slope_offset", "rad", _TILT, "pitch reads {} too {}", _HIGH, _pitched),
        ("roll_offset", "rad", _TILT, "roll reads {} too {}", _HIGH, _rolled),
        ("speed_scale", "1", _SPEED, "speeds read {} too {}", _HIGH, _slower),
        ("heading_misalignment", "rad", _TURN, _TURNED, ("left", "right"), _turned),
        ("power_scale", "1", _POWER, _SCALED, (*_HIGH, *_HIGH[::-1]), _smaller_power),
    )
}
"""By kind."""


def measured_residual(residual: Array, corrections: dict[str, float]) -> Array:
    """Residuals or powers (n,) W of a corrected log, in watts as they were measured.

    Args:
        residual: (n,) W, of the corrected rows.
        corrections: kind of a sensor's error → its size.
    """
    return residual * (1.0 + corrections.get("power_scale", 0.0))
