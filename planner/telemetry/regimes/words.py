"""How conditions on an axis read within a sentence: "faster than 0.4 m/s", "sideways"."""

from __future__ import annotations

from dataclasses import dataclass

from planner.telemetry.quantities_of_motion import STANDSTILL

_AMOUNT = "more than {}", "less than {}", "{} to {}"
_RATE = "faster than {}", "slower than {}", "at {} to {}"


@dataclass(frozen=True)
class Words:
    """Sentences of an axis; # is a bound in words.

    Attributes:
        least: what a sensor can tell apart: smaller spreads and thresholds mean nothing.
        unit: of a figure, with the blank before it.
        positive: of values; on an axis with a sign, of those above zero.
        negative, size: of values below zero, and of magnitudes; "" on an axis without a sign.
        small: of magnitudes below a bound, where ``size`` does not read well.
        bounds: a bound from below, one from above, and both; {} is a figure with its unit.
    """

    least: float
    unit: str
    positive: str
    negative: str = ""
    size: str = ""
    small: str = ""
    bounds: tuple[str, str, str] = _AMOUNT

    @property
    def degrees(self) -> bool:
        """Whether figures are degrees; the axis itself is in rad."""
        return self.unit == "°"


_MASS = "with the centre of mass #"
_RISING = "with the slope rising # to the"
WORDS: dict[str, Words] = {
    "speed": Words(0.02, " m/s", "#", bounds=_RATE),
    "slope_along": Words(0.3, "°", "climbing #", "descending #", "climbing or descending #"),
    "slope_across": Words(
        0.3,
        "°",
        f"{_RISING} left of the travel",
        f"{_RISING} right of the travel",
        "across a slope of #",
    ),
    "yaw_rate": Words(
        0.02, " rad/s", "turning left #", "turning right #", "turning #", bounds=_RATE
    ),
    "acceleration": Words(
        0.03, " m/s²", "speeding up by #", "braking by #", "speeding up or braking by #"
    ),
    "load": Words(0.1, " kg", "with # of load"),
    "temperature": Words(
        1.0, " °C", "#", bounds=("warmer than {}", "colder than {}", "at {} to {}")
    ),
    "time_since_start": Words(
        1.0,
        " s",
        "#",
        bounds=("later than {} after the start", "in the first {}", "{} to {} after the start"),
    ),
    "headwind": Words(
        0.2,
        " m/s",
        "against a wind of #",
        "with # of wind from behind",
        "with # of wind along the travel",
    ),
    "sensor_rate": Words(0.5, " Hz", "sampling #", bounds=_RATE),
    "com_x": Words(0.004, " m", f"{_MASS} forward", f"{_MASS} back", f"{_MASS} forward or back"),
    "com_y": Words(
        0.004,
        " m",
        f"{_MASS} to the left",
        f"{_MASS} to the right",
        f"{_MASS} to one side",
        f"{_MASS} to either side",
    ),
    "slope_rate": Words(0.005, " rad/s", "where the slope changes #", bounds=_RATE),
    "odometer": Words(
        1.0,
        " m",
        "# of driving",
        bounds=("after more than {}", "in the first {}", "after {} to {}"),
    ),
    "predicted_power": Words(0.1, " W", "where the model predicts #"),
}

ONCE = {
    0: "forward",
    45: "diagonally forward left",
    90: "sideways to the left",
    135: "diagonally backward left",
    180: "backward",
    225: "diagonally backward right",
    270: "sideways to the right",
    315: "diagonally forward right",
}
TWICE = {
    0: "forward or backward",
    45: "diagonally forward left or backward right",
    90: "sideways",
    135: "diagonally forward right or backward left",
}
FOUR_TIMES = {0: "straight along or across the body", 45: "diagonally"}


def said(axis: str, low: float | None, high: float | None, magnitude: bool = False) -> str:
    """Bounds on an axis in words.

    Args:
        axis: name; not the heading nor the ground.
        low, high: in the axis's unit of words, degrees for angles; None is open. Of a signed axis
            both have one sign, and the one closer to zero is not open.
        magnitude: the bounds are of |value|.
    """
    say = WORDS[axis]
    if axis == "speed" and low == STANDSTILL:
        return "in motion" if high is None else f"moving slower than {figure_of(high)}{say.unit}"
    if axis == "speed" and high == STANDSTILL and low is None:
        return "standing still"
    if axis == "predicted_power" and high == 0.0 and low is None:
        return "where the model predicts negative power"
    template = say.size if magnitude else say.positive
    if magnitude and low is None:
        template = say.small or say.size
    if say.negative and not magnitude and high is not None and high <= 0.0:
        template, low, high = say.negative, -high, None if low is None else -low
    above, below, between = say.bounds
    bound = below if low is None else above if high is None else between
    figures = [figure_of(value) for value in (low, high) if value is not None]
    figures[-1] += say.unit
    return template.replace("#", bound.format(*figures))


def figure_of(value: float) -> str:
    """A threshold, with as many figures as it needs."""
    text = f"{value:.4g}"
    return f"{value:,.0f}" if "e" in text else text


def heading_words(centre: int, period: int, half: float) -> str:
    """A sector without a name of its own; degrees, repeated after ``period``."""
    angles = sorted((_half_turn(centre + k * period) for k in range(360 // period)), key=abs)
    names = [_bearing(angle) for angle in angles]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
    return f"heading {listed} (±{half:.0f}°)"


def _bearing(angle: int) -> str:
    if angle in (0, 180):
        return "forward" if angle == 0 else "backward"
    return f"{abs(angle)}° to the {'left' if angle > 0 else 'right'}"


def _half_turn(angle: int) -> int:
    return (angle + 179) % 360 - 179
