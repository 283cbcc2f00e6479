"""What is odd about the heights of a map."""

from __future__ import annotations

import numpy as np

from planner.terrain.heightmap import Terrain
from planner.terrain.map_files import describe_map


def test_noise_in_the_heights_is_odd_and_a_steep_slope_is_not() -> None:
    """2 cm of noise in cells of 5 cm makes ledges; ground that is rough at all scales does not."""
    rng = np.random.default_rng(1)
    y, x = 0.05 * np.mgrid[0:80, 0:80]
    walk = 0.02 * rng.choice([-1.0, 1.0], (2, 80)).cumsum(axis=1)
    rough = walk[0][:, None] + walk[1][None, :]
    for heights, noisy in (
        (0.02 * x + rng.normal(0.0, 0.02, x.shape), True),
        (0.02 * x + rng.normal(0.0, 0.001, x.shape), False),
        (0.4 * x + 0.3 * y, False),
        (rough, False),
    ):
        odd = describe_map(Terrain.from_arrays(heights, cell=(0.05, 0.05)))["odd"]
        assert any("noise of a sensor" in sentence for sentence in odd) == noisy


def test_noise_shows_in_some_lines_of_a_large_map() -> None:
    heights = np.random.default_rng(2).normal(0.0, 0.02, (1100, 1000))
    (odd,) = describe_map(Terrain.from_arrays(heights, cell=(0.05, 0.05)))["odd"]
    assert "noise of a sensor" in odd
    assert describe_map(Terrain.from_arrays(0.0 * heights, cell=(0.05, 0.05)))["odd"] == []


def test_a_floor_plan_with_cells_of_many_metres_is_odd() -> None:
    """A resolution in mm makes a room of 15 m one of 15 km, and nothing else shows it."""
    walls = np.zeros((60, 80), bool)
    walls[0] = walls[20, :60] = True
    for cell, says in ((0.05, False), (50.0, True)):
        plan = Terrain.from_arrays(np.zeros(walls.shape), cell=(cell, cell), obstacles=walls)
        assert any("m a pixel" in odd for odd in describe_map(plan)["odd"]) == says
