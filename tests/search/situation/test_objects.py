"""Maps, vehicles, models and places as a person has them mean what their names mean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.requests import PlanRequest
from planner.search.situation import Situation
from planner.terrain.catalogue import open_map

MAP = "test-bench"
FILE = Path(load_vehicle.__code__.co_filename).with_name("minibalance.toml")
ENDS: dict[str, Any] = {"start": {"x": 1.0, "y": 1.5}, "goal": {"x": 13.0, "y": 1.5}}
NAMED = {"map": MAP, "vehicle": "minibalance", **ENDS}


def asked(*given: Any, **fields: Any) -> tuple[PlanRequest, Situation]:
    request, terrain, model = (*given, None, None, None)[:3]
    return Situation.asked(PlanRequest, request, fields, terrain, model)


@pytest.mark.parametrize(
    "changed",
    [
        {"map": open_map(MAP)},
        {"vehicle": load_vehicle("minibalance")},
        {"vehicle": FILE},
        {"vehicle": None, "model": PowerModel.from_vehicle(load_vehicle("minibalance"))},
        {"start": (1.0, 1.5), "goal": [13.0, 1.5]},
        {"start": np.array([1.0, 1.5]), "goal": (np.float32(13.0), 1.5)},
    ],
    ids=str,
)
def test_an_object_means_what_its_name_means(changed: dict[str, Any]) -> None:
    expected, there = asked(NAMED)
    for request, here in (asked({**NAMED, **changed}), asked(**{**NAMED, **changed})):
        assert here.key == there.key
        assert (request.start, request.goal) == (expected.start, expected.goal)


def test_a_third_number_is_the_yaw() -> None:
    request, _ = asked({**NAMED, "start": (1.0, 1.5, 0.5), "goal": {"any": [(13, 1.5, 1)]}})
    assert request.start.yaw == 0.5
    assert request.goal.any[0].yaw == 1.0


def test_an_array_of_places_is_read_row_by_row() -> None:
    request, _ = asked({**NAMED, "via": np.array([[3.0, 1.5], [5.0, 2.0]])})
    assert [(place.x, place.y) for place in request.via] == [(3.0, 1.5), (5.0, 2.0)]


def test_what_stands_beside_the_request_goes_first() -> None:
    cone = open_map("cone")
    ends = {"start": (6, 20), "goal": (34, 20)}
    request, there = asked({**NAMED, **ends}, cone)
    assert there.ground.terrain.name == "cone"
    assert request.map == "cone"
    heavy = PowerModel.from_vehicle(load_vehicle("robotino"))
    planned = asked(NAMED, None, heavy)[1].conditions.model
    # Planned speeds are exact, and friction changes its sign more sharply there.
    assert planned.sliding_speed < heavy.sliding_speed
    assert planned.parameters is heavy.parameters
    assert planned.vehicle is heavy.vehicle


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"start": (1.0,)}, "start: is not a place (got (1.0,)); accepted: where"),
        ({"start": ("a", 1)}, "start.x: is not a number (got 'a'); accepted: metres"),
        ({"via": [(1, 2), 3]}, "via[1]: is not a place (got 3); accepted: up to 50"),
        ({"map": load_vehicle("minibalance")}, "map: is not text (got Vehicle("),
        ({"vehicle": open_map(MAP)}, "vehicle: is not text (got Terrain("),
        (
            {"model": "m.json", "vehicle": load_vehicle("minibalance")},
            "model: is given together with vehicle (got 'm.json')",
        ),
    ],
    ids=str,
)
def test_a_wrong_thing_gets_one_sentence(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(RequestError) as caught:
        asked({**NAMED, **changed})
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)


def test_a_vehicle_and_a_model_are_not_given_together() -> None:
    vehicle = load_vehicle("minibalance")
    with pytest.raises(RequestError, match="together with vehicle"):
        asked({**NAMED, "vehicle": vehicle}, None, PowerModel.from_vehicle(vehicle))
    with pytest.raises(RequestError, match="model: is not text"):
        asked({**NAMED, "vehicle": None}, None, vehicle)
