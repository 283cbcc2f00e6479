"""A request without a fault, and what is said of one with a fault."""

from __future__ import annotations

from typing import Any

import pytest

from planner.errors import RequestError
from planner.search.requests.questions import PlanRequest

GOOD: dict[str, Any] = {
    "map": "warehouse",
    "vehicle": "minibalance",
    "start": {"x": 1.5, "y": 2},
    "goal": {"x": 8, "y": 9, "yaw": 0.5},
}


def refused(changes: dict[str, Any], field: str, words: str) -> None:
    """A good request with these changes is refused for the field, in one sentence."""
    with pytest.raises(RequestError) as caught:
        PlanRequest.from_json({**GOOD, **changes})
    assert caught.value.field == field
    assert words in str(caught.value)
    assert caught.value.accepted
    assert "\n" not in str(caught.value)
