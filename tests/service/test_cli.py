"""The command's contract from outside: exit status, one sentence, one document."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import planner
from planner.errors import Cancelled
from service import cli, terminal
from tests.service.route_documents import answer

JOULEPATH = Path(sys.executable).parent / "joulepath"
START_AND_GOAL = ("--start", "1,1", "--goal", "2,2")


def joulepath(*arguments: str, text: str | None = None) -> subprocess.CompletedProcess[str]:
    """Run the installed command."""
    return subprocess.run(
        [JOULEPATH, *arguments], capture_output=True, text=True, input=text, timeout=120
    )


def expect_refusal(done: subprocess.CompletedProcess[str], *words: str) -> None:
    """Exit 2, nothing on stdout, one line on stderr that holds the words."""
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize("command", ["maps", "vehicles", "effects"])
def test_catalogues_are_lists_of_named_objects(command: str) -> None:
    done = joulepath(command, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    entries = json.loads(done.stdout, parse_constant=lambda name: pytest.fail(name))
    assert entries
    assert all(entry["name"] for entry in entries)
    names = [entry["name"] for entry in entries]
    assert len(set(names)) == len(names)
    table = joulepath(command)
    assert table.returncode == 0
    assert all(name in table.stdout for name in names)


def test_listing_maps_loads_no_planner() -> None:
    script = (
        "import sys; from service.cli import run; run(['maps', '--json']); "
        "sys.exit(bool({'ompl', 'matplotlib', 'fastapi', 'rasterio'} & {*sys.modules}))"
    )
    assert subprocess.run([sys.executable, "-c", script], stdout=subprocess.DEVNULL).returncode == 0


def test_the_version_is_that_of_the_distribution() -> None:
    assert joulepath("--version").stdout.startswith("joulepath 0.")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan"], ["request", "missing", "--map"]),
        (["plan", "nothing.json"], ["nothing.json", "cannot be read"]),
        (["plan", "."], ["cannot be read"]),
        (["plan", "--start", "1"], ["--start", "X,Y"]),
        (["plan", "--start", "1,nan", "--map", "m", "--goal", "1,1"], ["start.y", "finite"]),
        (["plan", "--seed", "one"], ["--seed"]),
        (["plan", "--speed", "3"], ["--speed"]),
        (["plan", "--map", "atlantis", *START_AND_GOAL, "--json"], ["map", "atlantis"]),
        (["plan", "--vehicle", "hovercraft", *START_AND_GOAL, "--map", "m"], ["hovercraft"]),
        (["fly"], ["fly"]),
        (["maps", "atlantis"], ["atlantis"]),
    ],
)
def test_input_that_cannot_be_used_is_said_in_one_sentence(
    arguments: list[str], words: list[str]
) -> None:
    expect_refusal(joulepath(*arguments), *words)


@pytest.mark.parametrize(
    ("text", "word"),
    [("{", "JSON"), ('{"map": NaN}', "map"), ('{"mpa": "x"}', "did you mean 'map'")],
)
def test_stdin_is_read_and_checked(text: str, word: str) -> None:
    expect_refusal(joulepath("plan", "-", "--json", text=text), word)


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


class Fake:
    """Stands where the planner would and remembers the request."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.document: dict[str, Any] = answer()
        self.error: BaseException | None = None
        self.request: Any = None
        # Not setattr, which would load the real one to put it back.
        monkeypatch.setitem(vars(planner), "plan_route", self.plan_route)

    def plan_route(self, request: Any, **_: Any) -> Any:
        """Answers with ``document`` or raises ``error``."""
        self.request = request
        if self.error is not None:
            raise self.error
        return SimpleNamespace(to_json=lambda: self.document)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Fake:
    """A planner that answers at once."""
    return Fake(monkeypatch)


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


def test_people_see_what_other_routes_cost(fake: Fake, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL]) == 0
    shown = capsys.readouterr().out
    # 250 J against 200 J, and 140 J of the 200 J are rolling.
    assert "costs 25 % more" in shown
    assert "costs the same" in shown
    assert "140.0 J" in shown
    assert "70.0 %" in shown
    assert "(exchange)" in shown
    assert "fits the battery" in shown


@pytest.mark.parametrize("error", [Cancelled("by the caller"), KeyboardInterrupt()])
def test_cancelling_writes_nothing(
    fake: Fake, tmp_path: Path, capsys: pytest.CaptureFixture[str], error: BaseException
) -> None:
    fake.error = error
    out = tmp_path / "route.json"
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, "--out", str(out)]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "cancelled" in captured.err
    assert not out.exists()


def test_the_first_interrupt_asks_and_the_second_insists() -> None:
    with terminal.interruptible() as cancelled:
        assert not cancelled()
        signal.raise_signal(signal.SIGINT)
        assert cancelled()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_a_failure_shows_its_origin_only_when_asked(
    fake: Fake, capsys: pytest.CaptureFixture[str]
) -> None:
    fake.error = ZeroDivisionError("inside")
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL]) == 1
    assert capsys.readouterr().err.startswith("joulepath: unexpected failure: ZeroDivisionError")
    with pytest.raises(ZeroDivisionError):
        cli.run(["plan", "--map", "m", *START_AND_GOAL, "--verbose"])


def test_a_number_that_json_cannot_say_is_never_written(fake: Fake, tmp_path: Path) -> None:
    fake.document["routes"][0]["energy_j"] = float("nan")
    out = tmp_path / "route.json"
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL, "--json", "--out", str(out)]) == 1
    assert not out.exists()


def test_a_reader_that_has_enough_is_no_failure_of_ours() -> None:
    first = f"{JOULEPATH} effects | head -n 1"
    done = subprocess.run(["bash", "-c", first], capture_output=True, text=True, timeout=60)
    assert done.stderr == ""


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
