"""The widest strip through a passage, against its construction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.vehicles import load_vehicle
from planner.search.situation.narrow_passage import narrow_passage, passage_width
from planner.search.situation.traversability import DrivingGround, driving_ground
from planner.terrain.heightmap import Terrain

HALF = 2.0


def walled(width: float, angle: float, cell: float = 0.02) -> DrivingGround:
    """A wall 0.3 m thick through the origin with a gap; ``angle`` is the way through, rad."""
    axis = np.arange(-HALF, HALF, cell)
    x, y = np.meshgrid(axis, axis)
    through = x * math.cos(angle) + y * math.sin(angle)
    across = y * math.cos(angle) - x * math.sin(angle)
    reach = 0.5 * cell * (abs(math.cos(angle)) + abs(math.sin(angle)))
    solid = (np.abs(through) < 0.15) & (np.abs(across) >= 0.5 * width + reach - 1e-9)
    ground = Terrain.from_arrays(
        np.zeros_like(x), cell=(cell, cell), origin=(-HALF, -HALF), obstacles=solid
    )
    return driving_ground(ground, load_vehicle("minibalance"))


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2, 2.5])
def test_the_strip_is_as_wide_as_the_gap(angle):
    """No narrower than what was left free, and no wider than cells leave it."""
    width = passage_width(walled(0.64, angle), (0.0, 0.0))
    assert 0.64 - 1e-6 <= width <= 0.64 + 2.0 * math.sqrt(2.0) * 0.02


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_way_through_leads_from_the_starts_side_to_the_goals(angle, backwards):
    along = np.array([math.cos(angle), math.sin(angle)])
    sides = -1.3 * along, 1.3 * along
    start, goal = sides[::-1] if backwards else sides
    found = narrow_passage(walled(0.64, angle), tuple(start), tuple(goal))
    assert found is not None
    entrance, leaving = np.array(found.entrance), np.array(found.exit)
    assert np.dot(entrance, start) > 0.0
    assert np.dot(leaving, goal) > 0.0
    towards = math.atan2(*(leaving - entrance)[::-1])
    assert math.remainder(found.direction - towards, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    # The gap's own direction, up to what its play allows.
    assert math.remainder(found.direction - angle, math.pi) == pytest.approx(0.0, abs=0.1)


def test_a_gap_below_the_body_is_no_passage():
    ground = walled(0.58, 0.0)
    assert passage_width(ground, (0.0, 0.0)) < 0.62
    assert narrow_passage(ground, (-1.3, 0.0), (1.3, 0.0)) is None
