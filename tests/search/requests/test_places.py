"""Places of a request: numbers of any kind, goals told apart by their keys, rings round areas."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from jsonschema import ValidationError, validate

from planner.search.requests.places import Area
from planner.search.requests.questions import PlanRequest
from tests.search.requests.good import GOOD, refused

START = {"x": 3.0, "y": 3.0}
CIRCLE = {"x": 14.0, "y": 14.0, "radius": 3.0}
POLYGON = {"polygon": [[9.0, 10.0], [17.0, 8.0], [18.0, 17.0], [13.0, 12.0], [8.0, 18.0]]}


def test_numpy_numbers_are_numbers() -> None:
    start = {"x": np.float32(0.5), "y": np.int64(2)}
    assert PlanRequest.from_json({**GOOD, "start": start}).start.model_dump() == {
        "x": 0.5,
        "y": 2.0,
        "yaw": None,
    }


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"start": {"x": math.nan, "y": 0}}, "start.x", "finite"),
        ({"goal": {"x": 0, "y": math.inf}}, "goal.y", "finite"),
        ({"goal": {"x": 10**400, "y": 0}}, "goal.x", "finite"),
        ({"goal": {"x": 10**5000, "y": 0}}, "goal.x", "finite"),
        ({"start": {"x": True, "y": 0}}, "start.x", "not a number"),
        ({"start": {"x": "1", "y": 0}}, "start.x", "not a number"),
        ({"start": {"x": 1}}, "start.y", "missing"),
        ({"start": [1]}, "start", "not a place"),
        ({"start": [1, 2, 3, 4]}, "start", "not a place"),
        ({"start": None}, "start", "not a place"),
        ({"via": [{"x": 1, "y": 1}, {"x": 1, "y": None}]}, "via[1].y", "not a number"),
        ({"via": [{"x": 1, "y": 1}] * 51}, "via", "too many"),
    ],
)
def test_a_refusal_names_the_field_and_what_would_do(
    changes: dict[str, Any], field: str, words: str
) -> None:
    refused(changes, field, words)


def test_a_place_is_a_place_whatever_is_left_out():
    """A request that went through JSON with all its fields is the same request."""
    for goal in ({"x": 1.0, "y": 2.0}, CIRCLE, POLYGON, {"any": [{"x": 1.0, "y": 2.0}]}):
        request = PlanRequest.from_json({"map": "m", "start": START, "goal": goal})
        assert PlanRequest.from_json(request.model_dump(exclude_unset=True)) == request
        assert PlanRequest.from_call(request, {"seed": 3}).goal == request.goal


def test_the_schema_tells_places_from_regions():
    schema = PlanRequest.model_json_schema()
    request = {"map": "m", "start": START}
    for goal in (START, {**START, "yaw": 1.0}, CIRCLE, POLYGON, {"any": [START]}):
        validate({**request, "goal": goal}, schema)
    for goal in ({"x": 1.0}, {"x": 1.0, "radius": 2.0}, {}):
        with pytest.raises(ValidationError):
            validate({**request, "goal": goal}, schema)


def test_a_ring_goes_round_the_whole_of_a_circle() -> None:
    """No edge cuts the circle, and none leaves it far."""
    ring = np.array(Area.model_validate(CIRCLE).ring()) - [CIRCLE["x"], CIRCLE["y"]]
    assert (ring[0] == ring[-1]).all()
    along = np.diff(ring, axis=0)
    apart = np.abs(ring[:-1, 0] * along[:, 1] - ring[:-1, 1] * along[:, 0]) / np.hypot(*along.T)
    assert apart == pytest.approx(CIRCLE["radius"], rel=1e-9)
    assert np.hypot(*ring.T).max() < 1.01 * CIRCLE["radius"]
    turned = np.unwrap(np.arctan2(ring[:, 1], ring[:, 0]))
    assert turned[-1] - turned[0] == pytest.approx(2.0 * math.pi)


def test_the_ring_of_a_polygon_closes_it() -> None:
    ring = np.array(Area.model_validate(POLYGON).ring())
    assert (ring[:-1] == np.array(POLYGON["polygon"])).all()
    assert (ring[-1] == ring[0]).all()
