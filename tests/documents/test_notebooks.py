"""The notebooks are executed, small, name no place of a machine, and run again by night."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any

import pytest

from docs.run_notebooks import FOLDER, MOST_BYTES

NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path: Path) -> list[dict[str, Any]]:
    """The cells with code."""
    return [c for c in json.loads(path.read_text("utf-8"))["cells"] if c["cell_type"] == "code"]


def test_there_are_three() -> None:
    assert len(NOTEBOOKS) == 3


@each_notebook
def test_a_notebook_holds_its_outputs(path: Path) -> None:
    text = path.read_text("utf-8")
    assert len(text.encode()) <= MOST_BYTES
    assert not re.search(r"/(home|root|tmp|Users)/", text)
    assert [cell["execution_count"] for cell in cells(path)] == list(range(1, len(cells(path)) + 1))
    kinds = [output["output_type"] for cell in cells(path) for output in cell["outputs"]]
    assert set(kinds) <= {"execute_result", "stream"}
    assert kinds


@pytest.mark.nightly
@each_notebook
def test_a_notebook_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its printed lines are those that it shows, numbers to within 5 %."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for cell in cells(path):
        tree = ast.parse("".join(cell["source"]))
        # IPython shows the picture itself.
        tree.body = [one for one in tree.body if "IPython" not in ast.unparse(one)]
        tree.body = [one for one in tree.body if not ast.unparse(one).startswith("SVG(")]
        exec(compile(tree, path.name, "exec"), names)
        shown = "".join("".join(o["text"]) for o in cell["outputs"] if "text" in o)
        printed = capsys.readouterr().out
        assert _words(printed) == _words(shown)
        assert _numbers(printed) == pytest.approx(_numbers(shown), rel=0.05)


NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def _words(text: str) -> str:
    return NUMBER.sub("#", text)


def _numbers(text: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(text)]
