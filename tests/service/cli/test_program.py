"""The command's contract from outside: exit status, one sentence, one document."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from planner.errors import Cancelled
from service import cli, compiling
from service.cli import program
from tests.service.cli.command import JOULEPATH, START_AND_GOAL, expect_refusal, joulepath
from tests.service.cli.conftest import Fake


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


def test_a_failure_shows_its_origin_only_when_asked(
    fake: Fake, capsys: pytest.CaptureFixture[str]
) -> None:
    fake.error = ZeroDivisionError("inside")
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL]) == 1
    assert capsys.readouterr().err.startswith("joulepath: unexpected failure: ZeroDivisionError")
    with pytest.raises(ZeroDivisionError):
        cli.run(["plan", "--map", "m", *START_AND_GOAL, "--verbose"])


def test_a_reader_that_has_enough_is_no_failure_of_ours() -> None:
    first = f"{JOULEPATH} effects | head -n 1"
    done = subprocess.run(["bash", "-c", first], capture_output=True, text=True, timeout=60)
    assert done.stderr == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan", "--map", "m", *START_AND_GOAL, "--out"],
        ["plan", "--map", "m", *START_AND_GOAL, "--report"],
        ["matrix", "request.json", "--out"],
        ["reach", "request.json", "--out"],
        ["front", "request.json", "--out"],
        ["graph", "warehouse", "nodes.geojson", "--out"],
        ["compare-planners", "request.json", "--out"],
        ["compare", "log.csv", "--vehicle", "minibalance", "--report"],
        ["diagnose", "log.csv", "--vehicle", "minibalance", "--report"],
        ["adopt", "air_drag", "log.csv", "--vehicle", "minibalance", "--out"],
        ["logs", "join", "log.csv", "--out"],
        ["maps", "check", "warehouse", "--report"],
    ],
)
def test_a_file_that_cannot_be_written_is_said_before_any_work(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    place = tmp_path / "file" / "answer"
    # Before any work: not even that the log or the request is missing is found.
    assert cli.run([*arguments, str(place)]) == 2
    said = capsys.readouterr().err.strip()
    assert said == f"joulepath: {place}: cannot be written; accepted: " + (
        "a file in a folder that can be written"
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--host", "not a host"), ("host", "is not known", "'not a host'", "127.0.0.1")),
        (("--host", "192.0.2.7"), ("host", "no address of this machine", "'192.0.2.7'")),
    ],
)
def test_a_host_that_nothing_can_listen_on(
    options: tuple[str, ...],
    words: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(compiling, "compile_once", lambda *_: False)
    assert cli.run(["serve", "--port", "0", *options]) == 2
    said = capsys.readouterr().err
    assert len(said.strip().splitlines()) == 1
    assert [word for word in words if word not in said] == []


@pytest.mark.parametrize("name", [one.__name__.replace("_", "-") for one in program.VERBS])
def test_every_help_has_an_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([name, "--help"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert f"joulepath {name}" in shown.partition("Example")[2]


def test_the_shell_completes_commands() -> None:
    environment = {
        **os.environ,
        "_JOULEPATH_COMPLETE": "complete_bash",
        "COMP_WORDS": "joulepath doc",
        "COMP_CWORD": "1",
    }
    done = subprocess.run([JOULEPATH], capture_output=True, text=True, env=environment, timeout=60)
    assert done.stdout.split() == ["doctor"]
