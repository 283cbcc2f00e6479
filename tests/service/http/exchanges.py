"""Requests that are good, and what every error looks like."""

from __future__ import annotations

import json
from typing import Any

import pytest

GOOD: dict[str, Any] = {
    "map": "warehouse",
    "vehicle": "minibalance",
    "start": {"x": 1.5, "y": 2},
    "goal": {"x": 8, "y": 9},
}
TEXT = json.dumps(GOOD)
JSON = {"content-type": "application/json"}


def expect_problem(response: Any, status: int) -> dict[str, Any]:
    """The problem document of a response, after checking that it is one."""
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    document = response.json()
    assert document["status"] == status
    assert document["type"].startswith("urn:joulepath:problem:")
    assert document["title"]
    assert document["detail"]
    # What comes back must be JSON for strict readers too.
    json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    return dict(document)
