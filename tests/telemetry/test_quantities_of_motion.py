"""Axes of motion against geometry that can be checked by hand."""

import math

import numpy as np
import pytest

from planner.power.rows import gravity_columns, rows_from
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.quantities_of_motion import (
    AXES,
    FURTHER,
    STANDSTILL,
    all_axes,
    further_axes,
    motion_axes,
    temperature_of,
)

SLOPE = math.radians(6.0)


def on_slope(roll=0.0, pitch=0.0, **motion):
    return rows_from(**gravity_columns([roll], [pitch], gravity=STANDARD_GRAVITY), **motion)


def test_names_are_those_of_the_diagnosis():
    rows = rows_from(vx=[1.0])
    assert set(motion_axes(rows)) == set(AXES)
    # Rows know no power of a model.
    assert set(further_axes(rows)) == set(FURTHER) - {"predicted_power"}
    assert set(all_axes(rows)) == {*AXES, *FURTHER, "surface"}


@pytest.mark.parametrize(
    ("vx", "vy", "heading"),
    [(0.5, 0.0, 0.0), (0.0, 0.5, 90.0), (-0.3, 0.3, 135.0), (0.0, -1.0, -90.0)],
)
def test_heading_is_counted_from_forward_to_the_left(vx, vy, heading):
    axes = motion_axes(rows_from(vx=[vx], vy=[vy]))
    assert math.degrees(axes["heading"][0]) == pytest.approx(heading)
    assert axes["speed"][0] == pytest.approx(math.hypot(vx, vy))


def test_a_standing_robot_has_no_heading_and_no_slope_of_travel():
    rows = on_slope(pitch=SLOPE, vx=[0.1 * STANDSTILL], vy=[0.0])
    axes = motion_axes(rows)
    assert np.isnan(axes["heading"][0])
    assert abs(axes["slope_along"][0]) < 0.11 * SLOPE


# REP-103: pitch > 0 is nose down, roll > 0 is the left side up.
@pytest.mark.parametrize(
    ("roll", "pitch", "vx", "vy", "along", "across"),
    [
        (0.0, -SLOPE, 1.0, 0.0, SLOPE, 0.0),  # nose up, forward: climbs
        (0.0, -SLOPE, -1.0, 0.0, -SLOPE, 0.0),  # nose up, backward: descends
        (SLOPE, 0.0, 0.0, 1.0, SLOPE, 0.0),  # left side up, driving left: climbs
        (SLOPE, 0.0, 1.0, 0.0, 0.0, SLOPE),  # left side up, driving forward
        (0.0, -SLOPE, 0.0, 1.0, 0.0, -SLOPE),  # nose up, driving left: the nose is on its right
    ],
)
def test_slopes_are_those_of_the_travel(roll, pitch, vx, vy, along, across):
    axes = motion_axes(on_slope(roll, pitch, vx=[vx], vy=[vy]))
    assert axes["slope_along"][0] == pytest.approx(along, abs=1e-3)
    assert axes["slope_across"][0] == pytest.approx(across, abs=1e-3)


def test_acceleration_is_along_the_travel():
    backward = motion_axes(rows_from(vx=[-1.0], ax=[0.4], ay=[9.0]))
    assert backward["acceleration"][0] == pytest.approx(-0.4, rel=1e-3)  # it brakes


def test_headwind_is_positive_from_the_front():
    rows = rows_from(vx=[0.0], vy=[1.0], wind_x=[5.0], wind_y=[-3.0])
    assert further_axes(rows)["headwind"][0] == pytest.approx(3.0, rel=1e-3)


def test_temperature_is_that_of_the_motors_where_it_is_known():
    with_motors = rows_from(motor_temp=[50.0, math.nan], ambient_temp=[20.0, 20.0])
    assert temperature_of(with_motors) == "motor_temp"
    np.testing.assert_equal(motion_axes(with_motors)["temperature"], [50.0, math.nan])
    air = motion_axes(rows_from(ambient_temp=[20.0]))
    assert air["temperature"][0] == 20.0
    # A piece of a log without a motor's temperature keeps to what the log has.
    piece = motion_axes(rows_from(ambient_temp=[20.0]), temperature="motor_temp")
    assert np.isnan(piece["temperature"][0])
