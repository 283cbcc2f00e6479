"""A terrain as a vehicle feels it: where its body fits, and cells divided for gaps between them."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.vehicles import load_vehicle
from planner.search.resolution import ALL_YAWS
from planner.search.situation.traversability import DrivingGround, driving_ground
from planner.terrain.heightmap import Terrain


def ground(*, cell: float = 0.25, slope: float = 0.0, wall: bool = False) -> DrivingGround:
    """10 m by 10 m as the standard vehicle feels them, with a wall across the middle or without."""
    count = int(10.0 / cell)
    heights = np.tile(slope * cell * np.arange(count), (count, 1))
    obstacles = np.zeros((count, count), bool)
    obstacles[:, count // 2] = wall
    terrain = Terrain.from_arrays(heights, cell=(cell, cell), obstacles=obstacles)
    return driving_ground(terrain, load_vehicle("minibalance"))


def test_every_yaw_fits_in_the_open_and_none_on_a_wall():
    open_ground, walled = ground(), ground(wall=True)
    # The map's border is a wall as well.
    assert (open_ground.mask[6:-6, 6:-6] == ALL_YAWS).all()
    assert (walled.mask[walled.blocked] == 0).all()
    beside = walled.mask[walled.mask.shape[0] // 2]
    assert ((beside != 0) & (beside != ALL_YAWS)).any()


def test_room_is_preferred_by_no_more_than_the_weight():
    walled = ground(wall=True)
    factor = walled.clearance_penalty(0.7)
    assert factor.min() == 1.0
    assert factor.max() == pytest.approx(1.7)
    assert (factor[walled.mask == ALL_YAWS] == 1.0).all()
    assert factor[walled.blocked] == pytest.approx(1.7)
    assert (walled.clearance_penalty(0.0) == 1.0).all()


def test_coarse_cells_with_walls_are_divided_over_the_same_ground():
    coarse, walled = ground(cell=1.0, slope=0.1), ground(cell=1.0, slope=0.1, wall=True)
    assert coarse.cell == (1.0, 1.0)
    parts = walled.heights.shape[0] // 10
    assert parts > 1
    assert walled.cell == pytest.approx((1.0 / parts, 1.0 / parts))
    for axis in (0, 1):
        west = coarse.origin[axis] - 0.5 * coarse.cell[axis]
        assert walled.origin[axis] - 0.5 * walled.cell[axis] == pytest.approx(west)
    assert walled.blocked.mean() == pytest.approx(0.1)
    # The plane is the same plane.
    inner = walled.heights[:, parts:-parts]
    assert np.diff(inner, axis=1) == pytest.approx(0.1 / parts, rel=1e-6)


def test_the_steepest_slope_near_a_node_is_that_of_a_plane():
    inclined = ground(slope=0.1)
    assert inclined.steepest[8:-8, 8:-8] == pytest.approx(0.1, rel=1e-5)
    assert (inclined.steepest >= 0.1 * (1.0 - 1e-5)).all()
