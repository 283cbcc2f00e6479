"""Whether a log means another sign, unit or axis than it was read with.

    found = misread(log, start, least_w)      # None where the log is read rightly
    found.sentence, found.error_w

A pitch that is positive uphill, a yaw rate in degrees, swapped axes or a power without its sign
make a log that no effect explains, or that wrong ones seem to. Each of these readings is tried with
the model as it is. One that leaves much less than all effects did in the reading at hand is said,
with what to do about it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.amounts import watts
from planner.arrays import Array
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict

MOST_OF_ERROR, WORTH_A_METER = 0.75, 0.85
"""Held-out error in another reading over that in the one at hand: little over half of the square,
as effects follow what a wrong reading does; and the ratio with the meter at hand, from which one is
looked for anew."""
LONG_FILTER = 1.0
"""s; a longer filter of the meter may blur what the wrong reading does."""


@dataclass(frozen=True)
class Reading:
    """Another reading of a log.

    Attributes:
        needs: columns that the log must have measured.
        said: what it takes the log to mean.
        advice: what to do about it, a sentence.
        read: the log read so; the model as it is may help to tell.
    """

    needs: tuple[str, ...]
    said: str
    advice: str
    read: Callable[[Telemetry, PowerModel], Telemetry]


@dataclass(frozen=True)
class Misread:
    """What a log seems to mean instead: in a sentence, and the held-out error that leaves, W."""

    sentence: str
    error_w: float


def misread(log: Telemetry, start: PowerModel, least_w: float) -> Misread | None:
    """The reading in which the model as it is does much better, if there is one.

    Args:
        log: the rows as they were read.
        start: the model as stated.
        least_w: W, the held-out error that must be undercut clearly.
    """
    blurred = log.meter is not None and log.meter.time_constant_s > LONG_FILTER
    quick = replace(log, meter=None) if blurred else log
    as_read = overall_error(quick, fit(quick, start))
    found: list[tuple[float, Reading]] = []
    for reading in READINGS:
        if not log.present.issuperset(reading.needs):
            continue
        other = reading.read(quick, start)
        if other is quick:
            continue
        if overall_error(other, fit(other, start)) <= WORTH_A_METER * as_read:
            found.append((overall_error(*metered_base_fit(other, start)), reading))
    error, reading = min(found, key=lambda one: one[0], default=(math.inf, READINGS[0]))
    # A model that errs more than the power itself varies explains none of it.
    if error > min(MOST_OF_ERROR * least_w, float(log.power.std())):
        return None
    said = (
        f"This log seems to be read wrongly: if {reading.said}, the error on unseen runs is "
        f"{watts(error)}, without any effect. {reading.advice}"
    )
    return Misread(said, error)


def _mapped(
    needs: tuple[str, ...], said: str, line: str, rows: Callable[[Telemetry], Array]
) -> Reading:
    """A reading with other rows, (n, ROW_LENGTH), which a line of a mapping file gives."""
    advice = f"A mapping file says so with {line}"
    return Reading(needs, said, advice, lambda log, _: replace(log, rows=rows(log)))


def _signed(log: Telemetry, model: PowerModel) -> Telemetry:
    """A log whose power is negative where the model's is."""
    negative = predict(model, log) < 0.0
    if not negative.any():
        return log
    return replace(log, power=np.where(negative, -np.abs(log.power), log.power))


def _scaled(**factors: float) -> Callable[[Telemetry], Array]:
    """Rows whose columns are multiplied by factors."""

    def rows(log: Telemetry) -> Array:
        changed = log.rows.copy()
        for name, factor in factors.items():
            changed[:, INDEX[name]] *= factor
        return changed

    return rows


def _exchanged(
    first: tuple[str, ...], second: tuple[str, ...], signs: tuple[float, float]
) -> Callable[[Telemetry], Array]:
    """Rows in which each of two sets of columns is the other, with a sign."""

    def rows(log: Telemetry) -> Array:
        changed = log.rows.copy()
        one, other = ([INDEX[name] for name in names] for names in (first, second))
        changed[:, one] = signs[0] * log.rows[:, other]
        changed[:, other] = signs[1] * log.rows[:, one]
        return changed

    return rows


def _mirrored(axes: tuple[tuple[float, float], tuple[float, float]]) -> Callable[..., Array]:
    """Rows whose vx and vy are these sums of both; accelerations derived of them follow."""

    def rows(log: Telemetry) -> Array:
        changed = log.rows.copy()
        speeds = [INDEX["vx"], INDEX["vy"]]
        wz = log.rows[:, INDEX["wz"]]
        changed[:, speeds] = log.rows[:, speeds] @ np.transpose(axes)
        if not {"ax", "ay"} & log.present:
            pushes = [INDEX["ax"], INDEX["ay"]]
            rates = log.rows[:, pushes] - _of_turning(log.rows[:, speeds], wz)
            changed[:, pushes] = rates @ np.transpose(axes) + _of_turning(changed[:, speeds], wz)
        return changed

    return rows


def _of_turning(speeds: Array, wz: Array) -> Array:
    """Acceleration of a steady speed in a body that turns, (n, 2)."""
    turned: Array = np.column_stack((-wz * speeds[:, 1], wz * speeds[:, 0]))
    return turned


def _yaw_rate(factor: float) -> Callable[[Telemetry], Array]:
    """Rows of another yaw rate; accelerations that were derived with it are derived anew."""

    def rows(log: Telemetry) -> Array:
        changed = _scaled(wz=factor, yaw_acceleration=factor)(log)
        less = log.rows[:, INDEX["wz"]] - changed[:, INDEX["wz"]]
        if "ax" not in log.present:
            changed[:, INDEX["ax"]] += less * log.rows[:, INDEX["vy"]]
        if "ay" not in log.present:
            changed[:, INDEX["ay"]] -= less * log.rows[:, INDEX["vx"]]
        return changed

    return rows


READINGS = (
    _mapped(
        ("pitch",), "its pitch is positive uphill", "sign = -1 for pitch", _scaled(gravity_x=-1.0)
    ),
    _mapped(
        ("roll",),
        "its roll is positive with the left side down",
        "sign = -1 for roll",
        _scaled(gravity_y=-1.0),
    ),
    _mapped(
        ("pitch", "roll"),
        "its pitch is positive uphill and its roll with the left side down",
        "sign = -1 for both",
        _scaled(gravity_x=-1.0, gravity_y=-1.0),
    ),
    _mapped(
        ("pitch", "roll"),
        "its pitch and its roll are exchanged",
        "the two names exchanged",
        _exchanged(("gravity_x",), ("gravity_y",), (-1.0, -1.0)),
    ),
    _mapped(
        ("vx", "vy"),
        "its vx is to the right and its vy ahead",
        "the two names exchanged, and sign = -1 for what is named vy then",
        _exchanged(("vx", "ax"), ("vy", "ay"), (1.0, -1.0)),
    ),
    _mapped(
        ("vx", "vy"),
        "its vx and its vy are exchanged",
        "the two names exchanged",
        _mirrored(((0.0, 1.0), (1.0, 0.0))),
    ),
    _mapped(
        ("vy",),
        "its vy is positive to the right",
        "sign = -1 for vy",
        _mirrored(((1.0, 0.0), (0.0, -1.0))),
    ),
    _mapped(("wz",), "its wz is in degrees per second", 'unit = "deg/s"', _yaw_rate(math.pi / 180)),
    _mapped(("wz",), "its wz is positive clockwise", "sign = -1 for wz", _yaw_rate(-1.0)),
    _mapped(
        ("vx", "vy"),
        "its vx and its vy are in km/h",
        'unit = "km/h"',
        _scaled(**dict.fromkeys(("vx", "vy", "ax", "ay", "odometer"), 1.0 / 3.6)),
    ),
    Reading(
        (),
        "its power has lost its sign",
        "Log the power as negative where braking gives energy back",
        _signed,
    ),
)
"""All of them; the first of two that fit alike is said."""
