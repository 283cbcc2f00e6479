"""Results as DataFrames hold the numbers of the results; without pandas one sentence says so."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.errors import MissingPackage
from planner.search.graph import Drive, EnergyGraph
from planner.search.ompl.benchmark import PlannerComparison, PlannerRun
from planner.search.route_graph import GraphRequest, RouteGraph
from tests.report.synthetic import MODEL, answer, front, matrix, reach, route, terrain
from tests.telemetry.diagnosis import synthetic_results

ROOT = Path(planner.__file__).parent
TWO_PLACES = (GraphRequest.model_fields["graph"].examples or [{}])[0]


def test_a_route_is_its_poses() -> None:
    one = route()
    table = one.to_frame()
    assert list(table) == ["x", "y", "z", "yaw", "t", "speed", "energy_j", "watts"]
    assert len(table) == len(one.poses)
    assert table["energy_j"].iloc[-1] == one.energy_j
    table.loc[0, "x"] = 99.0  # A copy: the route stays as it is.
    assert one.poses[0].x == 2.0


def test_an_answer_is_a_row_for_each_route() -> None:
    table = answer().to_frame().set_index("route")
    assert list(table.index) == ["best", "shortest"]
    assert table.loc["shortest", "energy_j"] == 1.25 * table.loc["best", "energy_j"]
    parts = table[["electronics", "gravity"]].sum(axis=1)
    assert np.allclose(parts, table["energy_j"])
    assert (table["low_j"] < table["energy_j"]).all()
    assert (table["energy_j"] < table["high_j"]).all()
    assert answer(routes=(), baselines={}, status="no_route").to_frame().empty


def test_a_front_falls_in_energy() -> None:
    table = front().to_frame()
    assert table["duration_s"].is_monotonic_increasing
    assert table["energy_j"].is_monotonic_decreasing
    assert table["high_w"].iloc[0] == np.inf


def test_a_matrix_keeps_its_places() -> None:
    whole = matrix()
    table = whole.to_frame()
    assert (table.index.name, table.columns.name) == ("start", "goal")
    assert np.array_equal(table.to_numpy(), whole.energy_j)


def test_an_area_is_its_corners() -> None:
    area = reach()
    table = area.to_frame()
    assert list(table["outline"].unique()) == [0, 1]
    for number, line in enumerate(area.outlines):
        corners = table[table["outline"] == number][["x", "y"]]
        assert np.array_equal(corners.to_numpy(), line)


def test_a_graph_lists_every_direction() -> None:
    asked = GraphRequest(map="test-bench", graph=TWO_PLACES)
    graph = RouteGraph.parse(asked.graph)
    one = EnergyGraph(graph, {(0, 1): Drive(3.0, -1.0, 2.0, 6.0)}, {(1, 0): "too steep"}, asked)
    table = one.to_frame().set_index(["start", "end"])
    assert table.loc[(0, 1), "energy_j"] == -1.0
    assert table.loc[(1, 0), "closed"] == "too steep"
    assert np.isnan(table.loc[(1, 0), "cost"])


def test_planners_are_compared_row_by_row() -> None:
    runs = (PlannerRun("least-energy", 0.1, 1.0, route()), PlannerRun("rrt*", 2.0, None, None))
    table = PlannerComparison(terrain(), dict(MODEL), "plane", 2.0, runs).to_frame()
    assert list(table["solved"]) == [1, 0]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> synthetic_results.Material:
    return synthetic_results.material(tmp_path_factory.mktemp("drive"))


def test_the_workbench_ranks(results: synthetic_results.Material) -> None:
    diagnosis = synthetic_results.diagnosis(results)
    table = diagnosis.to_frame()
    assert list(table["effect"]) == [c.effect for c in diagnosis.candidates]
    assert list(table["selected"]) == [e in diagnosis.selected for e in table["effect"]]
    regimes = (synthetic_results.regime(where="fast"), synthetic_results.regime(where="slow"))
    comparison = replace(synthetic_results.comparison(results), regimes=regimes)
    assert list(comparison.to_frame()["where"]) == [r.where for r in comparison.regimes]
    empty = replace(comparison, regimes=()).to_frame()
    assert list(empty) == list(comparison.to_frame())
    assert empty.empty
    adoption = synthetic_results.adoption(results)
    assert list(adoption.to_frame()["value"]) == [p.value for p in adoption.parameters]


def test_without_pandas_one_sentence_says_how(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingPackage) as caught:
        route().to_frame()
    assert str(caught.value) == 'pandas is not installed; pip install "joulepath[pandas]"'


def test_nothing_imports_pandas_by_itself() -> None:
    texts = {path: path.read_text("utf-8") for path in ROOT.rglob("*.py")}
    eager = re.compile(r"^(import|from) pandas", re.M)
    assert [path for path, text in texts.items() if eager.search(text)] == []
