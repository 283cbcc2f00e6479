"""Where OMPL finds nothing, the grid's figures do not stand under its name."""

from __future__ import annotations

import math

import pytest

from planner import plan_route
from planner.search import ompl
from planner.search.ompl.planner import OmplResult
from tests.search.maps import hills, terrain

ENDS = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 20.0, "y": 18.0}}
OWN = {"library", "ompl_cost", "ompl_energy_j"}


@pytest.fixture(scope="module")
def relief():
    """Hills of 24 m."""
    return terrain(hills(96, rms_degrees=5.0))


def finds(monkeypatch, *found: bool):
    """Let OMPL find a way, or none, on one leg after the other."""
    solve, legs = ompl.solve, iter(found)

    def sometimes(plane, **settings):
        return solve(plane, **settings) if next(legs) else OmplResult(None, math.inf, 7, 9, 0.1)

    monkeypatch.setattr(ompl, "solve", sometimes)


@pytest.mark.parametrize("planner", ["auto", "tube", "plane"])
def test_nothing_found_is_said_and_no_figure_is_shown(relief, monkeypatch, planner):
    finds(monkeypatch, False)
    answer = plan_route(terrain=relief, planner=planner, iterations=50, **ENDS)
    assert answer.status == "ok"
    assert not OWN & set(answer.planner)
    assert "ompl" not in answer.planner["chosen"]
    assert any("OMPL found no way" in note for note in answer.notes)


def test_a_way_on_some_of_the_legs(relief, monkeypatch):
    finds(monkeypatch, True, False)
    via = [{"x": 12.0, "y": 6.0}]
    answer = plan_route(terrain=relief, planner="tube", iterations=300, via=via, **ENDS)
    assert answer.planner["legs_without_ompl"] == 1
    assert not OWN & set(answer.planner)
    assert any("1 of 2 legs" in note for note in answer.notes)


def test_figures_of_its_own_where_it_found_a_way(relief):
    answer = plan_route(terrain=relief, planner="tube", iterations=300, **ENDS)
    assert set(answer.planner) >= OWN
    assert not any("OMPL" in note for note in answer.notes)
