"""What tells situations apart, and what they keep."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.search.requests import SituationRequest
from planner.search.situation.situation import Situation, situation_of
from planner.terrain.heightmap import Terrain


def on(slope: float = 0.0, **asked: Any) -> Situation:
    """A situation on a plane of 10 m by 10 m."""
    heights = np.tile(slope * 0.5 * np.arange(20), (20, 1))
    terrain = Terrain.from_arrays(heights, cell=(0.5, 0.5))
    return situation_of(SituationRequest.from_json({"map": "here", **asked}), terrain=terrain)


def test_the_same_question_is_the_same_situation():
    assert on().key == on().key


@pytest.mark.parametrize(
    "asked",
    [
        {"slope": 0.01},
        {"payload": {"mass": 3.0}},
        {"payload": {"mass": 3.0, "x": 0.1}},
        {"conditions": {"wind": {"x": 2.0}}},
        {"conditions": {"motor_temp": 70.0}},
        {"model": "printed/A"},
        {"avoid": [{"x": 5.0, "y": 5.0, "radius": 1.0}]},
    ],
    ids=str,
)
def test_another_map_payload_model_or_weather_is_another_situation(asked):
    assert on(**asked).key != on().key


def test_costs_are_those_of_the_conditions_and_are_kept():
    plain, loaded = on(), on(payload={"mass": 6.0})
    assert plain.costs("energy") is on().costs("energy")
    # The map does not matter to what a metre costs.
    assert plain.costs("energy") is on(0.05).costs("energy")
    assert plain.costs("time") is not plain.costs("energy")
    assert loaded.costs("energy").best[0, 0, 0] > plain.costs("energy").best[0, 0, 0]


def test_the_whole_map_is_searched_once_a_second_start_asks():
    situation = on(0.03)
    field = situation.field("energy")
    goal, one, other = (8.0, 8.0), (2.0, 2.0), (2.0, 8.0)
    assert situation.least_cost_to("energy", field, goal, one).start == one
    again = situation.least_cost_to("energy", field, goal, other)
    assert again.start is None
    assert situation.least_cost_to("energy", field, goal, one) is again
    assert np.isfinite(again.values[4:16, 4:16]).all()


def test_compiled_search_stops_for_the_flag():
    situation = on(0.02)
    token = CancellationToken(lambda: True)
    assert token.cancelled()
    with pytest.raises(Cancelled):
        situation.least_cost_from(situation.field("energy"), (1.0, 1.0), token)
