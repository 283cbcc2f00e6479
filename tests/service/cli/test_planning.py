"""The commands that plan: one document, options over the file, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import planner
from service import cli
from tests.report import synthetic
from tests.search.route_graphs import graph as route_graph
from tests.service.cli.command import START_AND_GOAL, expect_refusal, joulepath
from tests.service.cli.conftest import Fake
from tests.service.route_documents import answer


def test_a_real_plan_is_one_document_and_the_same_in_fresh_processes() -> None:
    way = ("--map", "test-bench", "--start", "1,1.5", "--goal", "13,1.5,0")
    asked = ("plan", *way, "--seed", "5", "--iterations", "300", "--json")
    one, other = joulepath(*asked), joulepath(*asked)
    # OMPL's bindings would complain here at exit.
    assert (one.returncode, one.stderr) == (0, "")
    document = json.loads(one.stdout, parse_constant=lambda name: pytest.fail(name))
    route = document["routes"][0]
    assert sum(route["breakdown_j"].values()) == pytest.approx(route["energy_j"], rel=1e-9)
    assert document["routes"] == json.loads(other.stdout)["routes"]


def test_options_lie_over_the_file(fake: Fake, tmp_path: Path) -> None:
    file = tmp_path / "request.json"
    file.write_text(
        json.dumps(
            {
                "map": "a",
                "vehicle": "b",
                "start": {"x": 1, "y": 1},
                "goal": {"x": 2, "y": 2},
                "seed": 3,
            }
        )
    )
    assert cli.run(["plan", str(file), "--goal", "-3,4.5,1", "--model", "m.json", "--json"]) == 0
    request = fake.request
    assert (request.map, request.seed, request.start.x) == ("a", 3, 1.0)
    assert (request.goal.x, request.goal.y, request.goal.yaw) == (-3.0, 4.5, 1.0)
    assert (request.vehicle, request.model) == (None, "m.json")
    assert request.certify_s == 0.5
    assert cli.run(["plan", str(file), "--iterations", "9", "--json"]) == 0
    assert fake.request.certify_s is None


def test_json_is_one_document_and_the_file_holds_the_same(
    fake: Fake, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "answers" / "route.json"
    arguments = ["plan", "--map", "m", *START_AND_GOAL, "--json", "--out", str(out)]
    assert cli.run(arguments) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out) == json.loads(out.read_text()) == fake.document
    assert captured.err == ""
    assert list(out.parent.iterdir()) == [out]


def test_no_route_is_done_and_says_why(fake: Fake, capsys: pytest.CaptureFixture[str]) -> None:
    fake.document = answer(status="no_route", reason="a wall at x 3", routes=[], baselines={})
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL]) == 0
    assert "a wall at x 3" in capsys.readouterr().out


def test_a_number_that_json_cannot_say_is_never_written(fake: Fake, tmp_path: Path) -> None:
    fake.document["routes"][0]["energy_j"] = float("nan")
    out = tmp_path / "route.json"
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, "--json", "--out", str(out)]) == 1
    assert not out.exists()


def test_a_matrix_and_a_reachable_area(tmp_path: Path) -> None:
    places = [{"x": 4.0, "y": 12.0}, {"x": 9.0, "y": 12.0}]
    request = json.dumps({"map": "tilted-plane", "starts": places})
    done = joulepath("matrix", "-", "--json", text=request)
    assert done.returncode == 0
    energies = json.loads(done.stdout)["energy_j"]
    assert energies[0][0] == 0.0
    assert energies[0][1] > energies[1][0] > 0.0  # uphill one way
    out = tmp_path / "area.json"
    request = json.dumps({"map": "tilted-plane", "start": places[1], "energy_j": 60.0})
    done = joulepath("reach", "-", "--out", str(out), text=request)
    assert done.returncode == 0
    assert "m²" in done.stdout
    assert json.loads(out.read_text())["area_m2"] > 1.0


def test_a_front_of_duration_against_energy(tmp_path: Path) -> None:
    way = {"start": {"x": 4.0, "y": 4.0}, "goal": {"x": 14.0, "y": 16.0}}
    request = json.dumps({"map": "tilted-plane", **way, "points": 2})
    done = joulepath("front", "-", "--json", text=request)
    assert done.returncode == 0
    points = json.loads(done.stdout)["points"]
    assert 1 <= len(points) <= 2
    assert points[0]["price_w"][1] is None
    assert points[-1]["price_w"][0] == 0.0
    assert all(sum(p["breakdown_j"].values()) == pytest.approx(p["energy_j"]) for p in points)
    out = tmp_path / "front.json"
    done = joulepath("front", "-", "--out", str(out), text=request)
    assert "price of time" in done.stdout
    assert json.loads(out.read_text())["status"] == "ok"
    request = json.dumps({"map": "tilted-plane", **way, "points": 1})
    expect_refusal(joulepath("front", "-", text=request), "points", "2 to 30")


def test_a_goal_that_is_a_region(tmp_path: Path) -> None:
    request = {"map": "tilted-plane", "start": {"x": 4.0, "y": 4.0}}
    circle = {**request, "goal": {"x": 12.0, "y": 12.0, "radius": 3.0}}
    done = joulepath("plan", "-", "--json", text=json.dumps(circle))
    assert done.returncode == 0
    document = json.loads(done.stdout)
    last = document["routes"][0]["poses"][-1]
    assert {name: last[name] for name in ("x", "y", "yaw")} == document["goal"]
    assert (last["x"] - 12.0) ** 2 + (last["y"] - 12.0) ** 2 <= 9.0
    places = {**request, "goal": {"any": [{"x": 20.0, "y": 20.0}, {"x": 6.0, "y": 6.0}]}}
    done = joulepath("plan", "-", text=json.dumps(places))
    assert "It arrives at x 6.00, y 6.00, number 1 of the places." in done.stdout
    wrong = {**request, "goal": {"polygon": [[1, 1], [5, 5], [5, 1], [1, 5]]}}
    expect_refusal(joulepath("plan", "-", text=json.dumps(wrong)), "goal.polygon", "crosses")


def test_what_matrix_and_reach_cannot_use_is_refused(tmp_path: Path) -> None:
    expect_refusal(joulepath("matrix", "-", text='{"map": "cone", "starts": []}'), "starts")
    expect_refusal(joulepath("reach", "-", text='{"map": "cone"}'), "start", "is missing")
    expect_refusal(joulepath("matrix", str(tmp_path / "none.json")), "none.json", "cannot be read")


def test_a_format_goes_to_stdout_or_into_the_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(vars(planner), "plan_route", lambda *_, **__: synthetic.answer())
    asked = ["plan", "--map", "m", *START_AND_GOAL, "--format", "csv"]
    assert cli.run(asked) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("route,x,y,z,yaw,t,speed,energy_j\n0,2.0,5.0,")
    file = tmp_path / "route.csv"
    assert cli.run([*asked, "--out", str(file), "--json"]) == 0
    assert file.read_text() == printed
    assert json.loads(capsys.readouterr().out)["status"] == "ok"


@pytest.mark.parametrize(
    ("name", "begins"), [("R.CSV", "route,x,y,"), ("r.geojson", '{"type": "F'), ("r.txt", '{"stat')]
)
def test_the_ending_of_a_file_is_its_format(
    name: str, begins: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(vars(planner), "plan_route", lambda *_, **__: synthetic.answer())
    file = tmp_path / name
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, "--out", str(file)]) == 0
    assert file.read_text().startswith(begins)
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, "--out", str(file), "--format=csv"]) == 0
    assert file.read_text().startswith("route,x,y,")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--format", "kml"), "--format: is not a format of routes (got 'kml')"),
        (("--format", "csv", "--json"), "--json: and --format csv both write to stdout"),
    ],
)
def test_formats_that_cannot_be_written(
    options: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, *options]) == 2
    assert sentence in capsys.readouterr().err


def test_a_graph_for_navigation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = [{"x": 4.0, "y": 12.0}, {"x": 9.0, "y": 12.0}]
    file, out = tmp_path / "nodes.geojson", tmp_path / "energies.geojson"
    file.write_text(json.dumps(route_graph(places, [(0, 1), (1, 0)])))
    assert cli.run(["graph", "tilted-plane", str(file), "--corridor", "1", "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert "2 of 2 edges between 2 places can be driven" in told.out
    assert f"wrote {out}" in told.err
    up, down = (one["properties"] for one in json.loads(out.read_text())["features"][2:])
    assert up["metadata"]["energy_j"] > down["metadata"]["energy_j"] > 0.0
    assert up["cost"] > 0.0 < down["cost"]
    assert cli.run(["graph", "tilted-plane", str(tmp_path / "none.geojson")]) == 2
    assert "none.geojson: cannot be read" in capsys.readouterr().err
    assert cli.run(["graph", "tilted-plane", str(file), "--objective", "fun"]) == 2
    assert "objective: is none of the choices (got 'fun')" in capsys.readouterr().err
