"""On ground as steep as a robot can drive, an answer keeps to all limits between its poses too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.search.track import slopes_of_steps
from tests.benchmarks.peers.case import case_of
from tests.benchmarks.peers.limits import broken_limits
from tests.search.maps import hills, terrain

ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 19.0}}


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_an_answer_on_steep_relief_keeps_to_all_limits(seed: int) -> None:
    """Looked at from its poses, ten times a cell, with rates by differences."""
    case = case_of("test", ASKED, terrain(hills(rms_degrees=11.0, seed=seed)))
    answer = plan_route(terrain=case.situation.ground.terrain, **ASKED)
    assert answer.status == "ok"
    assert broken_limits(case, answer.routes[0]) == {}


def test_on_a_plane_the_steepest_slope_is_that_of_the_middle() -> None:
    rise = math.tan(math.radians(12.0))
    plane = 0.25 * rise * np.tile(np.arange(40.0), (40, 1))
    field = case_of("test", {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 5}}, terrain(plane))
    slopes = slopes_of_steps(field.field, np.array([[2.0, 5.0], [2.4, 5.1], [3.0, 5.0]]))
    assert slopes[:, [0, 2]] == pytest.approx(rise, rel=1e-6)
    assert slopes[:, [1, 3]] == pytest.approx(0.0, abs=1e-9)


def test_the_steepest_slope_of_a_step_is_none_of_its_middle_on_a_bump() -> None:
    """Two steep flanks with a flat crest between them."""
    x = 0.25 * np.arange(60)
    bump = np.clip(0.3 * (1.5 - np.abs(x - 7.0)), 0.0, 0.36)
    bumpy = terrain(np.tile(bump, (60, 1)))
    asked = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 2.0, "y": 8.0}}
    case = case_of("test", asked, bumpy)
    slopes = slopes_of_steps(case.field, np.array([[5.5, 7.0], [8.5, 7.0]]))
    assert abs(slopes[0, 0]) < 0.02
    assert abs(slopes[0, 2]) > 0.25
