"""Regions: which points lie inside, which is the nearest one inside, how their edges run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.errors import RequestError
from tests.search.goals.test_goal_selection import CIRCLE, POLYGON, region_of


def test_points_are_inside_or_outside():
    polygon, circle = region_of(POLYGON), region_of(CIRCLE)
    points = np.array([[10.0, 12.0], [13.0, 16.0], [17.0, 10.0], [0.0, 0.0]])
    assert polygon.inside(points).tolist() == [True, False, True, False]
    assert circle.inside(points).tolist() == [False, True, False, False]
    for region in (polygon, circle):
        moved = region.nearest(points)
        within = region.inside(points)
        assert (moved[within] == points[within]).all()
        assert region.inside(moved).all()
        edge = region.outline(0.1, (-100.0, -100.0, 100.0, 100.0))
        assert region.inside(edge).all()
        # Nothing of the edge is nearer than what is said to be the nearest.
        for point, there in zip(points[~within], moved[~within], strict=True):
            least = np.hypot(*(edge - point).T).min()
            assert math.hypot(*(there - point)) <= least + 1e-4


@pytest.mark.parametrize("radius", [3.0, 40.0, 1e4, 9e8])
def test_an_edge_is_followed_as_far_as_it_runs_through_the_map(radius):
    box = (-5.0, 0.0, 20.0, 15.0)
    spacing = 0.25
    # Both pass through (10, 7), the circle with its easternmost point.
    circle = region_of({"x": 10.0 - radius, "y": 7.0, "radius": radius})
    polygon = region_of(
        {"polygon": [[10.0 - radius, 7.0 - radius], [10.0, 7.0], [10.0 - radius, 7.0 + radius]]}
    )
    for region in (circle, polygon):
        edge = region.outline(spacing, box)
        # A convex edge within a box is no longer than the box's own.
        assert len(edge) <= 2 * (25 + 15) / spacing + 8
        assert region.inside(edge).all()
        assert (edge >= np.array(box[:2]) - spacing).all()
        assert (edge <= np.array(box[2:]) + spacing).all()
        assert np.hypot(*(edge - [10.0, 7.0]).T).min() <= spacing
        # Every row of the box that the region's end lies in meets the edge.
        for y in np.arange(max(0.5, 7.5 - radius), min(14.5, 6.5 + radius)):
            assert np.abs(edge[:, 1] - y).min() <= spacing


def test_a_circle_round_the_map_has_no_edge_on_it():
    circle = region_of({"x": 10.0, "y": 7.0, "radius": 1e9})
    assert circle.outline(0.25, (0.0, 0.0, 20.0, 15.0)).shape == (0, 2)


def test_a_polygon_is_a_region_whichever_way_round_it_is_given():
    rng = np.random.default_rng(2)
    points = rng.uniform(0.0, 20.0, (200, 2))
    there = region_of(POLYGON)
    back = region_of({"polygon": POLYGON["polygon"][::-1]})
    assert 0 < there.inside(points).sum() < len(points)
    assert (there.inside(points) == back.inside(points)).all()


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ([[1, 1], [5, 5], [5, 1], [1, 5]], "crosses itself"),
        ([[1, 1], [5, 5], [9, 9]], "has no extent"),
        ([[1, 1], [1, 1], [1, 1]], "has no extent"),
    ],
)
def test_what_encloses_nothing_is_refused(corners, words):
    with pytest.raises(RequestError, match=words):
        region_of({"polygon": corners})
