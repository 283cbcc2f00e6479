"""All long calls report progress alike: the share first, then a sentence."""

from __future__ import annotations

from typing import Any

import pytest

import planner
from tests.search.maps import hills, terrain
from tests.search.route_graphs import graph

ENDS = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 9.0, "y": 8.0}}


@pytest.mark.parametrize(
    ("verb", "asked"),
    [
        ("plan_route", {**ENDS}),
        ("energy_time_front", {**ENDS, "points": 2}),
        ("energy_graph", {"graph": graph(ENDS.values(), [(0, 1)])}),
        ("energy_matrix", {"starts": list(ENDS.values())}),
        ("reachable_area", {"start": ENDS["start"], "energy_j": 30.0}),
    ],
)
def test_questions_report_the_share_first(verb: str, asked: dict[str, Any]) -> None:
    told: list[tuple[float, str]] = []
    getattr(planner, verb)(
        terrain=terrain(hills(48)), **asked, progress=lambda *now: told.append(now)
    )
    shares = [share for share, _ in told]
    assert 0.0 <= min(shares) < max(shares) <= 1.0
    assert shares[-1] == 1.0
    assert all(isinstance(sentence, str) for _, sentence in told)
