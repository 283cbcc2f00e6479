"""On ground as steep as a robot can drive, an answer keeps to all limits between its poses too."""

from __future__ import annotations

import pytest

from planner import plan_route
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
