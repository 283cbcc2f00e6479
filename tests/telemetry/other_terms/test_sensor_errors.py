"""Errors of sensors: what each does to a log, taken back, and seen in the residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import diagnose
from planner.power.rows import gravity_columns
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.other_terms.given_errors import GIVEN, given_columns
from planner.telemetry.other_terms.sensor_errors import SENSORS
from planner.telemetry.prediction import predict
from tests.telemetry.rows import measured


def column(log, name):
    return log.rows[:, INDEX[name]]


def with_columns(log, **columns):
    rows = log.rows.copy()
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    return replace(log, rows=rows)


SIGNS = [("slope_offset", "ax", -1.0), ("roll_offset", "ay", 1.0)]


# Every error as it comes about, by its own formula.


def tilted(log, roll, pitch):
    """Gravity as sensors of roll and pitch say it."""
    return with_columns(log, **gravity_columns(roll, pitch, gravity=STANDARD_GRAVITY))


def faster(log, share):
    return with_columns(
        log, vx=column(log, "vx") * (1.0 + share), vy=column(log, "vy") * (1.0 + share)
    )


def turned(log, angle):
    motion = (column(log, "vx") + 1j * column(log, "vy")) * np.exp(1j * angle)
    return with_columns(log, vx=motion.real, vy=motion.imag)


def test_slopes_are_turned_back(motion):
    angle = np.linspace(-0.2, 0.2, len(motion))
    flat = np.zeros(len(motion))
    pitched = SENSORS["slope_offset"].correct(tilted(motion, flat, angle + 0.03), 0.03)
    assert pitched.rows == pytest.approx(tilted(motion, flat, angle).rows, abs=1e-12, nan_ok=True)
    rolled = SENSORS["roll_offset"].correct(tilted(motion, angle + 0.03, flat), 0.03)
    assert rolled.rows == pytest.approx(tilted(motion, angle, flat).rows, abs=1e-12, nan_ok=True)


@pytest.mark.parametrize("kind", ["slope_offset", "roll_offset"])
def test_gravity_keeps_its_length(motion, kind):
    names = ("gravity_x", "gravity_y", "gravity_normal")
    corrected = SENSORS[kind].correct(motion, 0.1)
    before, after = (sum(column(log, n) ** 2 for n in names) for log in (motion, corrected))
    assert after == pytest.approx(before, rel=1e-12)


def test_velocity_is_scaled_and_turned_back(motion):
    corrected = SENSORS["speed_scale"].correct(faster(motion, 0.07), 0.07)
    assert corrected.rows == pytest.approx(motion.rows, abs=1e-12, nan_ok=True)
    corrected = SENSORS["heading_misalignment"].correct(turned(motion, 0.1), 0.1)
    assert corrected.rows == pytest.approx(motion.rows, abs=1e-12, nan_ok=True)


def test_acceleration_that_was_derived_follows_the_velocity(motion):
    derived = replace(motion, present=motion.present - {"ax", "ay"})
    corrected = SENSORS["speed_scale"].correct(derived, 0.25)
    for name in ("vx", "vy", "ax", "ay"):
        assert column(corrected, name) == pytest.approx(column(motion, name) / 1.25)
    measured = SENSORS["speed_scale"].correct(motion, 0.25)
    np.testing.assert_array_equal(column(measured, "ax"), column(motion, "ax"))


def test_power_is_scaled_back(motion):
    log = replace(motion, power=10.0 + np.sin(0.1 * motion.time))
    scaled = SENSORS["power_scale"].correct(replace(log, power=1.2 * log.power), 0.2)
    assert scaled.power == pytest.approx(log.power)


@pytest.mark.parametrize("kind", SENSORS)
def test_no_error_changes_nothing(motion, kind):
    same = SENSORS[kind].correct(motion, 0.0)
    np.testing.assert_array_equal(same.rows, motion.rows)
    assert same.power == pytest.approx(motion.power)


SMALL = {
    "speed_scale": (0.02, faster),
    "heading_misalignment": (0.02, turned),
    "power_scale": (0.02, lambda log, share: replace(log, power=log.power * (1.0 + share))),
}


@pytest.mark.parametrize("kind", SMALL)
def test_column_is_what_the_error_leaves_in_the_residual(motion, base, kind):
    size, spoil = SMALL[kind]
    spoiled = spoil(replace(motion, power=predict(base, motion)), size)
    watts = predict(base, spoiled)
    residual = spoiled.power - watts
    found = SENSORS[kind].column(spoiled, base, watts, size)
    slope = float(found @ residual / (found @ found))
    assert slope == pytest.approx(size, rel=0.02)
    assert np.linalg.norm(residual - size * found) < 0.05 * np.linalg.norm(residual)


def test_a_run_of_one_row_has_finite_columns(motion, base):
    one = motion.take(np.array([5]))
    watts = predict(base, one)
    for sensor in SENSORS.values():
        assert np.all(np.isfinite(sensor.column(one, base, watts)))
        assert np.all(np.isfinite(sensor.correct(one, sensor.step).power))


def test_an_error_is_said_in_degrees_and_per_cent():
    said = {kind: sensor.said(-0.0349, 0.00175) for kind, sensor in SENSORS.items()}
    assert said["slope_offset"] == "pitch reads 2° (± 0.1°) too low"
    assert said["speed_scale"] == "speeds read 3.49 % (± 0.2 %) too low"
    assert said["heading_misalignment"].endswith("to the right")
    # Too little power is the same as too much mass.
    assert "too low" in said["power_scale"]
    assert "mass in the data sheet is too high" in said["power_scale"]
    assert "mass in the data sheet is too low" in SENSORS["power_scale"].said(0.02, 0.01)


@pytest.mark.parametrize(("kind", "axis", "sign"), SIGNS)
def test_what_a_log_does_not_read_cannot_be_wrong(motion, base, kind, axis, sign):
    """Neither named nor among the usual errors; an acceleration alone is called by its name."""
    blind = replace(motion, present=motion.present - {"pitch", "roll", "ax", "ay"})
    assert not SENSORS[kind].is_read_in(blind.present)
    assert SENSORS[kind].is_read_in({axis})
    said = SENSORS[kind].said(0.02, 0.001, {axis})
    assert said == f"{axis} reads 0.2 m/s² too {'high' if sign > 0.0 else 'low'}"
    watts = predict(base, blind)
    columns = given_columns(blind, base, watts)
    assert not columns[:, GIVEN.own[kind]].any()


def test_a_force_to_one_side_is_no_slope_that_nobody_measured(motion, base):
    part = motion.take(slice(0, 770))
    force = 0.03 * SENSORS["slope_offset"].column(part, base, predict(base, part))
    log = measured(part, base, 0.02, seed=4, extra=force)
    blind = replace(log, present=log.present - {"pitch", "roll", "ax", "ay"})
    assert [fault.kind for fault in diagnose(log, base).sensors] == ["slope_offset"]
    assert diagnose(blind, base).sensors == ()


@pytest.mark.parametrize(("kind", "axis", "sign"), SIGNS)
def test_a_biased_accelerometer_looks_like_a_tilt_and_is_named_beside_it(
    motion, base, kind, axis, sign
):
    """The force that moving wheels give is m·(a - g): both errors change it alike."""
    angle = 0.005
    speed = np.hypot(column(motion, "vx"), column(motion, "vy"))
    motion = motion.take(speed > 0.05)
    watts = predict(base, motion)
    tilted_back = predict(base, SENSORS[kind].correct(motion, angle)) - watts
    bias = column(motion, axis) - sign * STANDARD_GRAVITY * angle
    unbiased = predict(base, with_columns(motion, **{axis: bias})) - watts
    cosine = tilted_back @ unbiased / np.linalg.norm(tilted_back) / np.linalg.norm(unbiased)
    assert cosine > 0.98
    said = SENSORS[kind].said(angle, 0.001, present={axis, "pitch", "roll"})
    assert said.endswith(f", or {axis} 0.049 m/s² too {'high' if sign > 0 else 'low'}")
    assert axis not in SENSORS[kind].said(angle, 0.001, present={"vx"})
