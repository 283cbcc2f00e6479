"""Answers of workers are as the OpenAPI document describes them."""

from __future__ import annotations

import pytest

from planner.errors import InputError
from planner.search.requests import FrontRequest
from service.http.schemas import FrontAnswer
from service.jobs import worker


def test_a_workers_front_is_as_the_schema_says() -> None:
    way = {"start": {"x": 4.0, "y": 4.0}, "goal": {"x": 12.0, "y": 12.0, "radius": 2.0}}
    request = FrontRequest.from_json({"map": "tilted-plane", **way, "points": 2})
    text = worker.energy_time_front(request)
    answer = FrontAnswer.model_validate_json(text, strict=True)
    assert answer.points[0].price_w[1] is None
    assert answer.points[0].poses[-1].speed == 0.0
    with pytest.raises(InputError):
        worker.energy_time_front(request.model_copy(update={"map": "nowhere"}))
