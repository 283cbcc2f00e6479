"""Planners side by side: every run's energy is drawn, and who found nothing stands in the table."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.search.ompl import PlannerComparison
from planner.search.ompl.benchmark import PlannerRun
from tests.report.synthetic import route, terrain


@pytest.fixture
def found() -> PlannerComparison:
    runs = (
        PlannerRun("least-energy", 0.1, 90.0, route()),
        PlannerRun("bit*", 2.0, 99.0, route(watts=25.0)),
        PlannerRun("bit*", 2.0, None, None),
        PlannerRun("rrt*", 2.0, None, None),
    )
    return PlannerComparison(terrain(), {"name": "minibalance"}, "plane", 2.0, runs)


def test_every_run_with_a_route_is_a_dot_and_a_line(found):
    assert found.figures() == ("planners", "energies", "map")
    assert found.figure("energies").svg.count("<circle") == 2
    assert "bit*: " in found.figure("energies").svg


def test_the_table_counts_runs_and_says_what_more_is_spent(found, tmp_path):
    least, sampler, nothing = found.rows
    assert (sampler["runs"], sampler["solved"]) == (2, 1)
    assert sampler["extra_share"] == pytest.approx(25.0 / 20.0 - 1.0)
    assert (least["extra_share"], nothing["energy_j"], nothing["extra_share"]) == (0.0, None, None)
    found.write_report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "+25.00 %" in page
    assert "rrt*" in page


def test_without_any_route_there_is_a_page_and_no_picture(found, tmp_path):
    nothing = replace(found, runs=found.runs[3:])
    nothing.write_report(tmp_path / "page.html")
    assert "No planner found a route." in (tmp_path / "page.html").read_text()
    assert nothing.figures() == ()
