"""How conditions on an axis read within a sentence: "faster than 0.4 m/s", "sideways"."""

from __future__ import annotations

from dataclasses import dataclass

from planner.telemetry.quantities_of_motion import STANDSTILL


@dataclass(frozen=True)
class Words:
    """Templates of an axis; {} is a figure with its unit.

    ``least`` is what a sensor can tell apart: smaller spreads and thresholds mean nothing.
    """

    least: float
    unit: str
    above: str
    below: str
    between: str
    negative_above: str = ""
    size_above: str = ""
    size_below: str = ""
    negative_between: str = ""
    degrees: bool = False


WORDS: dict[str, Words] = {
    "speed": Words(0.02, " m/s", "faster than {}", "slower than {}", "at {} to {}"),
    "slope_along": Words(
        0.3, "°",
        "climbing more than {}",
        "",
        "climbing {} to {}",
        "descending more than {}",
        "climbing or descending more than {}",
        "climbing or descending less than {}",
        "descending {} to {}",
        degrees=True,
    ),
    "slope_across": Words(
        0.3, "°",
        "with the slope rising more than {} to the left of the travel",
        "",
        "with the slope rising {} to {} to the left of the travel",
        "with the slope rising more than {} to the right of the travel",
        "across a slope of more than {}",
        "across a slope of less than {}",
        "with the slope rising {} to {} to the right of the travel",
        degrees=True,
    ),
    "yaw_rate": Words(
        0.02, " rad/s",
        "turning left faster than {}",
        "",
        "turning left at {} to {}",
        "turning right faster than {}",
        "turning faster than {}",
        "turning slower than {}",
        "turning right at {} to {}",
    ),
    "acceleration": Words(
        0.03, " m/s²",
        "speeding up by more than {}",
        "",
        "speeding up by {} to {}",
        "braking by more than {}",
        "speeding up or braking by more than {}",
        "speeding up or braking by less than {}",
        "braking by {} to {}",
    ),
    "load": Words(0.1, " kg", "with more than {} of load", "with less than {} of load",
                   "with {} to {} of load"),
    "temperature": Words(1.0, " °C", "warmer than {}", "colder than {}", "at {} to {}"),
    "time_since_start": Words(1.0, " s", "later than {} after the start", "in the first {}",
                               "{} to {} after the start"),
    "headwind": Words(
        0.2, " m/s",
        "against a wind of more than {}",
        "",
        "against a wind of {} to {}",
        "with more than {} of wind from behind",
        "with more than {} of wind along the travel",
        "with less than {} of wind along the travel",
        "with {} to {} of wind from behind",
    ),
    "sensor_rate": Words(0.5, " Hz", "sampling faster than {}", "sampling slower than {}",
                          "sampling at {} to {}"),
    "com_x": Words(
        0.004, " m",
        "with the centre of mass more than {} forward",
        "",
        "with the centre of mass {} to {} forward",
        "with the centre of mass more than {} back",
        "with the centre of mass more than {} forward or back",
        "with the centre of mass less than {} forward or back",
        "with the centre of mass {} to {} back",
    ),
    "com_y": Words(
        0.004, " m",
        "with the centre of mass more than {} to the left",
        "",
        "with the centre of mass {} to {} to the left",
        "with the centre of mass more than {} to the right",
        "with the centre of mass more than {} to one side",
        "with the centre of mass less than {} to either side",
        "with the centre of mass {} to {} to the right",
    ),
    "slope_rate": Words(0.005, " rad/s", "where the slope changes faster than {}",
                         "where the slope changes slower than {}",
                         "where the slope changes at {} to {}"),
    "odometer": Words(1.0, " m", "after more than {} of driving", "in the first {} of driving",
                       "after {} to {} of driving"),
}  # fmt: skip

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
    if low is not None and high is not None:
        if high <= 0.0 and say.negative_between:
            low, high = -high, -low
            return say.negative_between.format(figure_of(low), figure_of(high) + say.unit)
        return say.between.format(figure_of(low), figure_of(high) + say.unit)
    if low is not None:
        template = say.size_above if magnitude else say.above
        return template.format(figure_of(low) + say.unit)
    assert high is not None
    if say.negative_above and not magnitude:
        return say.negative_above.format(figure_of(-high) + say.unit)
    template = say.size_below if magnitude else say.below
    return template.format(figure_of(high) + say.unit)


def figure_of(value: float) -> str:
    """A threshold, with as many figures as it needs."""
    text = f"{value:.4g}"
    return f"{value:,.0f}" if "e" in text else text


def heading_words(centre: int, period: int, half: float) -> str:
    """A sector without a name of its own; degrees, repeated after ``period``."""
    around = sorted((_half_turn(centre + k * period) for k in range(360 // period)), key=abs)
    names = [_bearing(angle) for angle in around]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
    return f"heading {listed} (±{half:.0f}°)"


def _bearing(angle: int) -> str:
    if angle in (0, 180):
        return "forward" if angle == 0 else "backward"
    return f"{abs(angle)}° to the {'left' if angle > 0 else 'right'}"


def _half_turn(angle: int) -> int:
    return (angle + 179) % 360 - 179
