"""Rows for a motion on a plane, against vectors in the map's frame."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.kernels import BLOCK
from planner.power.motion_row import (
    empty_block,
    put,
    put_row,
    set_acceleration,
    set_motion,
    set_wind,
    stretch_of,
)
from planner.power.rows import rows_from
from planner.quantities import INDEX, ROW_LENGTH, STANDARD_GRAVITY
from tests.power.states import Array

PLANES = [(0.0, 0.0), (0.2, 0.0), (0.0, -0.3), (0.4, 0.25), (-0.6, 0.5)]


def body_axes(slope_x: float, slope_y: float, yaw: float) -> Array:
    """Rows: forward in the plane above the yaw direction, left square to it, the normal."""
    c, s = math.cos(yaw), math.sin(yaw)
    forward = np.array([c, s, slope_x * c + slope_y * s])
    normal = np.array([-slope_x, -slope_y, 1.0])
    forward, normal = (v / np.linalg.norm(v) for v in (forward, normal))
    return np.stack([forward, np.cross(normal, forward), normal])


def velocity(slope_x: float, slope_y: float, direction: float, speed: float) -> Array:
    """In the map's frame: along the plane, above a horizontal direction."""
    ux, uy = math.cos(direction), math.sin(direction)
    along = np.array([ux, uy, slope_x * ux + slope_y * uy])
    return speed * along / np.linalg.norm(along)


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5, -1.9])
@pytest.mark.parametrize("direction", [0.0, 1.1, -2.8])
def test_velocity_and_gravity_are_those_of_the_plane(
    plane: tuple[float, float], yaw: float, direction: float
) -> None:
    row = rows_from()[0]
    stretch = set_motion(row, *plane, yaw, direction, 0.8)
    body = body_axes(*plane, yaw)
    v = body @ velocity(*plane, direction, 0.8)
    assert [row[INDEX["vx"]], row[INDEX["vy"]], 0.0] == pytest.approx(v, abs=1e-12)
    pull = body @ [0.0, 0.0, -STANDARD_GRAVITY]
    found = [row[INDEX["gravity_x"]], row[INDEX["gravity_y"]], -row[INDEX["gravity_normal"]]]
    assert found == pytest.approx(pull, abs=1e-12)
    # A metre on the map is longer on the plane.
    horizontal = np.linalg.norm(velocity(*plane, direction, 1.0)[:2])
    assert stretch == pytest.approx(1.0 / horizontal)
    assert stretch_of(*plane, direction) == pytest.approx(stretch)


def test_nothing_else_in_the_row_is_touched() -> None:
    row = np.full(ROW_LENGTH, 77.0)
    set_motion(row, 0.1, 0.2, 0.3, 0.4, 0.5)
    written = {name for name, column in INDEX.items() if row[column] != 77.0}
    assert written == {"vx", "vy", "gravity_x", "gravity_y", "gravity_normal"}


def test_acceleration_along_and_to_the_left_of_the_motion() -> None:
    row = rows_from()[0]
    vx, vy = 0.3, -0.4
    set_acceleration(row, 0.7, 0.2, vx, vy, 0.5)
    found = np.array([row[INDEX["ax"]], row[INDEX["ay"]]])
    along, left = np.array([vx, vy]) / 0.5, np.array([-vy, vx]) / 0.5
    assert found @ along == pytest.approx(0.7)
    assert found @ left == pytest.approx(0.2)


def test_wind_turns_against_the_body() -> None:
    row = rows_from()[0]
    # Wind towards north, body facing north: from behind.
    set_wind(row, np.array([0.0, 3.0]), math.pi / 2)
    assert row[INDEX["wind_x"]] == pytest.approx(3.0)
    assert row[INDEX["wind_y"]] == pytest.approx(0.0, abs=1e-12)
    # Body facing east: towards the left.
    set_wind(row, np.array([0.0, 3.0]), 0.0)
    assert row[INDEX["wind_y"]] == pytest.approx(3.0)


def test_rows_of_a_block_stand_quantity_by_quantity() -> None:
    columns, _ = empty_block()
    rows = np.arange(2.0 * ROW_LENGTH).reshape(2, ROW_LENGTH)
    put_row(columns, 0, rows[0])
    put_row(columns, BLOCK - 1, rows[1])
    put(columns, 0, INDEX["vx"], -5.0)
    table = columns.reshape(ROW_LENGTH, BLOCK)
    rows[0, INDEX["vx"]] = -5.0
    np.testing.assert_array_equal(table[:, 0], rows[0])
    np.testing.assert_array_equal(table[:, -1], rows[1])
    assert not table[:, 1:-1].any()
