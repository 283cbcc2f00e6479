"""The workbench's commands: what they ask the planner, what they print, what they refuse."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import planner
import planner.report
from planner.errors import Cancelled, LogError
from planner.power.kernels.compiler import compile_kernel
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from service import cli
from service.cli import bench
from tests.service import telemetry_documents as documents

TOW = {
    "name": "tow",
    "formula": "drag * abs(wind_x - vx) * vx",
    "unit": "W",
    "parameters": {"drag": {"unit": "kg/s", "bounds": [0, 50], "null": 0}},
}


class Planner:
    """Stands where compare, diagnose and adopt would, and remembers what it was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.asked: list[tuple[str, tuple[Any, ...]]] = []
        self.options: dict[str, Any] = {}
        self.error: BaseException | None = None
        self.reports: list[tuple[Any, str]] = []
        self.model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"])
        made = {
            "compare": documents.comparison,
            "diagnose": documents.diagnosis,
            "adopt": documents.adoption,
        }
        for verb, document in made.items():
            # Not setattr, which would load the real one to put it back.
            monkeypatch.setitem(vars(planner), verb, self._verb(verb, document))
        monkeypatch.setitem(vars(planner.report), "write_report", self._write_report)

    def _verb(self, verb: str, document: Callable[[], Any]) -> Callable[..., Any]:
        def answer(*arguments: Any, **options: Any) -> Any:
            self.asked.append((verb, arguments))
            self.options = options
            if self.error is not None:
                raise self.error
            return SimpleNamespace(to_json=document, model=self.model)

        return answer

    def _write_report(self, found: Any, path: Path, title: str) -> None:
        self.reports.append((found, title))
        path.write_text("<html>")


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> Planner:
    """A workbench that answers at once."""
    return Planner(monkeypatch)


@pytest.fixture
def model_file(tmp_path: Path) -> Path:
    """A saved model without history."""
    path = tmp_path / "m.json"
    PowerModel.from_vehicle(load_vehicle("minibalance")).save(path)
    return path


def test_compare_says_how_far_and_where(
    stand_in: Planner, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["compare", "drive.csv", "--vehicle", "minibalance"]) == 0
    assert stand_in.asked == [("compare", (Path("drive.csv"), "minibalance"))]
    said = capsys.readouterr().out
    first = said.split(". ")[0].replace("\n", " ")
    assert "minibalance, version 1, fitted to this log, misses" in first
    assert "2.00 W rms" in said
    # 39 kJ against 40 kJ; run a is 5 % too low, measured minus predicted is below zero overall.
    assert "2.5 % too low" in said
    assert "−5.0 %" in said
    assert "−0.25 W" in said
    assert "faster than 0.6 m/s" in said
    assert "41 %" in said
    assert "3 gaps of more than 1 s" in said
    assert "read as csv" not in said


def test_diagnose_says_the_sentence_first(
    stand_in: Planner, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["diagnose", "drive.csv", "--vehicle", "minibalance"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("The model lacks air_drag.")
    assert "97 %" in said
    assert "drag_area 0.22 ± 0.01 m²" in said
    assert "Not testable: motor_heating: the log has no motor_temp. Log motor_temp." in said
    assert "Next: joulepath adopt diagnosed drive.csv --vehicle minibalance" in said
    assert "To tell viscous_drag and converter_efficiency apart: drive 60 s" in said


@pytest.mark.parametrize(
    ("verb", "document"),
    [("compare", documents.comparison()), ("diagnose", documents.diagnosis())],
)
def test_json_is_one_document_and_nothing_else(
    stand_in: Planner, capsys: pytest.CaptureFixture[str], verb: str, document: Any
) -> None:
    assert cli.run([verb, "drive.csv", "--vehicle", "minibalance", "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out) == document
    assert captured.err == ""


def test_a_saved_model_is_loaded_and_the_mapping_handed_on(
    stand_in: Planner, model_file: Path
) -> None:
    arguments = ["diagnose", "drive.csv", "--model", str(model_file), "--mapping", "names.toml"]
    assert cli.run(arguments) == 0
    _, (_, start) = stand_in.asked[0]
    assert isinstance(start, PowerModel)
    assert start.name == "minibalance"
    assert stand_in.options["mapping"] == Path("names.toml")
    assert stand_in.options["cancelled"]() is False


def test_adopt_writes_the_new_version(
    stand_in: Planner, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "models" / "m2.json"
    verb = ["adopt", "air_drag, viscous_drag", "drive.csv", "--vehicle", "minibalance"]
    assert cli.run([*verb, "--out", str(out)]) == 0
    assert stand_in.asked[0][1][0] == ["air_drag", "viscous_drag"]
    assert [effect.slug for effect in PowerModel.load(out).effects][-1] == "air_drag"
    assert list(out.parent.iterdir()) == [out]
    captured = capsys.readouterr()
    assert captured.out.startswith("Adopted air_drag: held-out error 2.10 W → 0.52 W")
    assert f"wrote {out}" in captured.err


def test_no_route_waits_for_the_code_of_an_adopted_model(stand_in: Planner, tmp_path: Path) -> None:
    out = tmp_path / "m2.json"
    verb = ["air_drag", "drive.csv", "--vehicle", "minibalance", "--out", str(out)]
    compile_kernel.cache_clear()
    assert cli.run(["adopt", *verb]) == 0
    compiled = compile_kernel.cache_info().misses
    model = PowerModel.load(out)
    assert model.kernel.name != model.limits_kernel.name
    assert compile_kernel.cache_info().misses == compiled


def test_adopt_takes_everything_diagnosed(stand_in: Planner, tmp_path: Path) -> None:
    out = ["--out", str(tmp_path / "m2.json")]
    assert cli.run(["adopt", "diagnosed", "drive.csv", "--vehicle", "minibalance", *out]) == 0
    assert stand_in.asked[0][1][0] == "diagnosed"


@pytest.mark.parametrize("suffix", [".json", ".toml"])
def test_a_formula_is_adopted_under_its_name(
    stand_in: Planner, tmp_path: Path, suffix: str
) -> None:
    file = tmp_path / f"tow{suffix}"
    if suffix == ".json":
        file.write_text(json.dumps(TOW))
    else:
        file.write_text(
            'name = "tow"\nformula = "drag * abs(wind_x - vx) * vx"\nunit = "W"\n'
            '[parameters]\ndrag = { unit = "kg/s", bounds = [0, 50], null = 0 }\n'
        )
    verb = ["adopt", "tow,air_drag", "drive.csv", "--vehicle", "minibalance"]
    out = ["--out", str(tmp_path / "m2.json")]
    assert cli.run([*verb, "--formula", str(file), *out]) == 0
    tow, other = stand_in.asked[0][1][0]
    assert tow.slug == "tow"
    assert tow.definition["formula"] == TOW["formula"]
    assert other == "air_drag"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "x.csv"], ["--vehicle", "--model"]),
        (
            ["compare", "x.csv", "--vehicle", "v", "--model", "m"],
            ["--vehicle", "together with --model"],
        ),
        (["compare", "x.csv", "--model", "no.json"], ["no.json", "cannot be read"]),
        (["diagnose"], ["LOG"]),
        (["adopt", "air_drag", "x.csv", "--vehicle", "v"], ["--out"]),
        (["adopt", "", "x.csv", "--vehicle", "v", "--out", "o.json"], ["effects", "diagnosed"]),
        (
            ["adopt", "diagnosed,a", "x.csv", "--vehicle", "v", "--out", "o"],
            ["together with others"],
        ),
        (["adopt", "a", "x.csv", "--vehicle", "v", "--out", "/dev/null/o"], ["cannot be written"]),
        (
            ["adopt", "a", "x", "--vehicle", "v", "--out", "o", "--formula", "no.json"],
            ["no.json", "cannot be read", "formula"],
        ),
        (["history", "no.json"], ["no.json"]),
        (["revert", "no.json", "--to", "1", "--out", "o.json"], ["no.json"]),
        (["bench", "--rows", "3"], ["--rows"]),
    ],
)
def test_input_that_cannot_be_used_is_one_sentence(
    stand_in: Planner,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    words: list[str],
) -> None:
    assert cli.run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.strip().splitlines()) == 1
    for word in words:
        assert word in captured.err


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("{", "JSON"),
        ("[]", "not an object"),
        ('{"name": "tow"}', "incomplete"),
        (json.dumps({**TOW, "formula": "__import__('os')"}), "formula"),
        (json.dumps({**TOW, "name": "other"}), "does not name the effect"),
    ],
)
def test_a_formula_that_cannot_be_used_is_refused_before_any_work(
    stand_in: Planner, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, word: str
) -> None:
    file = tmp_path / "tow.json"
    file.write_text(text)
    verb = ["adopt", "tow", "drive.csv", "--vehicle", "minibalance", "--formula", str(file)]
    assert cli.run([*verb, "--out", str(tmp_path / "m.json")]) == 2
    assert word in capsys.readouterr().err
    assert stand_in.asked == []


def test_a_refusal_of_the_planner_is_exit_2(
    stand_in: Planner, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in.error = LogError("drive.csv", "has no column 'power'", accepted="columns")
    assert cli.run(["compare", "drive.csv", "--vehicle", "minibalance", "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "has no column 'power'" in captured.err


def test_cancelling_while_the_new_model_compiles_writes_nothing(
    stand_in: Planner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(model: PowerModel) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(PowerModel, "limits_kernel", property(interrupted))
    out = tmp_path / "m2.json"
    verb = ["adopt", "air_drag", "drive.csv", "--vehicle", "minibalance", "--out", str(out)]
    assert cli.run(verb) == 1
    assert not out.exists()


@pytest.mark.parametrize("error", [Cancelled("by the caller"), KeyboardInterrupt()])
def test_cancelling_writes_nothing(
    stand_in: Planner, tmp_path: Path, capsys: pytest.CaptureFixture[str], error: BaseException
) -> None:
    stand_in.error = error
    out, page = tmp_path / "m2.json", tmp_path / "page.html"
    verb = ["adopt", "air_drag", "drive.csv", "--vehicle", "minibalance", "--out", str(out)]
    assert cli.run([*verb, "--report", str(page)]) == 1
    assert capsys.readouterr().out == ""
    assert not out.exists()
    assert not page.exists()


def test_a_report_is_written_beside_the_document(
    stand_in: Planner, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    verb = ["compare", "logs/drive.csv", "--vehicle", "minibalance"]
    assert cli.run([*verb, "--report", str(page)]) == 0
    assert page.exists()
    assert stand_in.reports[0][1] == "Comparison with drive.csv"
    assert f"wrote {page}" in capsys.readouterr().err


def test_a_person_sees_progress_and_a_pipe_does_not(
    stand_in: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    cli.run(["compare", "drive.csv", "--vehicle", "minibalance"])
    assert stand_in.options["progress"] is None
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    cli.run(["compare", "drive.csv", "--vehicle", "minibalance"])
    # Share first, sentence second.
    stand_in.options["progress"](0.5, "half way")


def test_history_of_a_model_shows_the_error_falling(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "m3.json"
    second = documents.entry(
        3,
        adopted=["viscous_drag"],
        before={"rmse_w": 0.9, "heldout_rmse_w": 0.9},
        after={"rmse_w": 0.5, "heldout_rmse_w": 0.51},
    )
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    vars(model)["history"] = (documents.entry(2), second)
    model.save(path)
    assert cli.run(["history", str(path)]) == 0
    said = capsys.readouterr().out
    assert "2 versions known: held-out error 2.10 W → 0.51 W" in said
    assert "adopt viscous_drag" in said
    assert "drive.csv" in said
    assert cli.run(["history", str(path), "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)["history"]
    assert [entry["version"] for entry in entries] == [2, 3]
    assert "snapshot" not in entries[0]


def test_a_model_without_history_says_so(
    model_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["history", str(model_file)]) == 0
    assert "nothing was adopted yet" in capsys.readouterr().out


def test_revert_writes_a_new_version(
    monkeypatch: pytest.MonkeyPatch,
    model_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked: list[int] = []

    def revert(model: PowerModel, version: int) -> PowerModel:
        asked.append(version)
        return model

    monkeypatch.setitem(vars(planner), "revert", revert)
    out = tmp_path / "m4.json"
    assert cli.run(["revert", str(model_file), "--to", "1", "--out", str(out), "--json"]) == 0
    assert asked == [1]
    assert json.loads(capsys.readouterr().out)["model"]["name"] == "minibalance"
    assert PowerModel.load(out).name == "minibalance"


def test_bench_prints_times(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    document = {"timings": [{"name": "diagnose", "seconds": 0.0123, "what": "5,000 rows"}]}
    monkeypatch.setattr(bench, "measure", lambda rows, **_: {**document, "rows": rows})
    assert cli.run(["bench", "--rows", "5000"]) == 0
    assert "12.3 ms" in capsys.readouterr().out
    assert cli.run(["bench", "--rows", "5000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 5000
