"""Planners side by side by OMPL's Benchmark: the same problem, and energies of driven routes."""

from __future__ import annotations

import json

import pytest

from planner import plan_route
from planner.errors import RequestError
from planner.search.ompl import compare_planners
from planner.search.ompl.sampling import SAMPLERS
from tests.search.ompl.problems import ENDS, RELIEF


def test_planners_side_by_side(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = compare_planners(terrain=RELIEF, **ENDS, seconds=0.5, runs=2)
    assert [row["planner"] for row in found.rows] == ["least-energy", *SAMPLERS]
    least = found.runs[0]
    assert least.energy_j == plan_route(terrain=RELIEF, **ENDS).routes[0].energy_j
    assert [row["runs"] for row in found.rows] == [1, 2, 2, 2]
    bound = least.route.lower_bound_j
    for run in found.runs:
        assert run.energy_j is None or run.energy_j >= bound
        assert (run.cost is None) == (run.energy_j is None) or run.cost > 0.0
    document = json.loads(json.dumps(found.to_json()))
    assert document["planners"][0]["extra_share"] == 0.0
    assert not list(tmp_path.iterdir()), "OMPL's own files would litter the user's folder"


def test_a_comparison_with_via_places_is_refused():
    with pytest.raises(RequestError, match="via"):
        compare_planners(terrain=RELIEF, **ENDS, via=[{"x": 9.0, "y": 9.0}])
