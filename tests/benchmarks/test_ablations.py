"""The table of tuned constants says what the code says, and ablations change what is measured."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.benchmarks.ablated_constant import (
    environment,
    in_compiled_code,
    replace_when_imported,
    replaced,
    stale_files,
)
from tests.benchmarks.ablation_measures import MEASURES, QUESTIONS
from tests.benchmarks.ablations import (
    KEPT,
    Constant,
    in_fresh_process,
    in_words,
    key_of,
    keys,
    page,
    save,
    table,
    worth,
)

TABLE = table()


@pytest.mark.parametrize("one", TABLE, ids=[one.label for one in TABLE])
def test_an_entry_says_what_the_code_says(one: Constant) -> None:
    assert getattr(importlib.import_module(one.module), one.name) == one.value
    source = Path(str(importlib.import_module(one.module).__file__)).read_text("utf-8")
    replaced(source, one.name, one.ablated[0])
    assert one.measured in MEASURES
    assert one.unit
    assert one.decides
    assert one.value not in one.ablated
    assert len({repr(value) for value in one.ablated}) == len(one.ablated) > 0


def test_each_constant_stands_once() -> None:
    assert len({one.label for one in TABLE}) == len(TABLE)


@pytest.mark.nightly
def test_an_absurd_value_changes_what_is_measured() -> None:
    margin = next(one for one in TABLE if one.name == "SURPLUS")
    assert not in_compiled_code(margin.module, margin.name), "it would compile for minutes"
    same = in_fresh_process("hard", 1, margin, margin.value)
    # Waypoints that are never moved leave a path that costs more.
    never = in_fresh_process("hard", 1, margin, 1e9)
    assert worth(same, never)["percent"] > 0.1


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package whose compiled function takes a constant from another module."""
    files = {
        "__init__.py": "",
        "numbers.py": "BASE, OTHER = 2.0, 5.0\nTWICE = 2.0 * BASE\nUNUSED = 1.0\n",
        "code.py": """
            from numba import njit
            from toy.numbers import TWICE, UNUSED

            @njit(cache=True)
            def scaled(x):
                return TWICE * x

            def plain(x):
                return UNUSED * x
            """,
        "apart.py": """
            from numba import njit

            @njit(cache=True)
            def same(x):
                return x
            """,
    }
    (tmp_path / "toy").mkdir()
    for name, text in files.items():
        (tmp_path / "toy" / name).write_text(textwrap.dedent(text), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


SCRIPT = """
import ast, sys
from tests.benchmarks.ablated_constant import replace_when_imported
if len(sys.argv) > 1:
    replace_when_imported("toy.numbers", sys.argv[1], ast.literal_eval(sys.argv[2]))
from toy.apart import same
from toy.code import scaled
print(scaled(10.0), same(1.0))
"""


def told(package: Path, variables: dict[str, str], *arguments: str) -> float:
    """What a fresh process computes with the package's compiled function."""
    root = str(Path(__file__).parents[2])
    own = {**os.environ, **variables, "PYTHONPATH": os.pathsep.join((str(package), root))}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *arguments],
        env=own, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(done.stdout.split()[0])


def test_compiled_code_follows_the_constant(package: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    assert told(package, {"NUMBA_CACHE_DIR": str(cache)}) == 40.0
    # The trap: machine code with the old value is on disk.
    old = told(package, {"NUMBA_CACHE_DIR": str(cache)}, "BASE", "3.0")
    assert old == 40.0, "numba looks at constants itself: the copy of the cache can go"
    variables = environment("toy.numbers", cache, tmp_path / "own")
    assert variables["NUMBA_CACHE_DIR"] != str(cache)
    assert told(package, variables, "BASE", "3.0") == 60.0
    assert told(package, {"NUMBA_CACHE_DIR": str(cache)}) == 40.0
    stale = {file.name.partition(".")[0] for file in stale_files("toy.numbers", cache)}
    assert stale == {"code"}


def test_constants_of_compiled_code_are_told_from_others(package: Path) -> None:
    assert in_compiled_code("toy.numbers", "BASE")
    assert in_compiled_code("toy.numbers", "TWICE")
    assert not in_compiled_code("toy.numbers", "UNUSED")
    assert not in_compiled_code("toy.numbers", "OTHER")


def test_a_constant_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="not assigned"):
        replaced("A = 1\n", "B", 2)
    with pytest.raises(ValueError, match="imported already"):
        replace_when_imported("tests.benchmarks.ablations", "TABLE", 1)


def test_what_an_ablation_is_worth() -> None:
    base = {"answers": {"a": 100.0, "b": 200.0, "c": None, "d": 50.0}, "cpu_s": 2.0}
    changed = {"a": 102.0, "b": None, "c": None, "d": 49.5}
    found = worth(base, {"answers": changed, "cpu_s": 1.0})
    assert found["percent"] == pytest.approx(0.5)
    assert found["routes_lost"] == 1
    said = "answer +0.500 % (worst +2.00, best -1.00 %), CPU x0.50, 1 routes lost"
    assert in_words(found) == said
    gaps = worth({"gap_percent": {"a": 5.0}}, {"gap_percent": {"a": 7.5}})
    assert in_words(gaps) == "gap +2.50 points (worst +2.50)"
    before = {"outcomes": {"a": "exact", "b": "complete", "c": "abstained"}}
    said = worth(before, {"outcomes": {"a": "exact", "b": "wrong", "c": "missed"}})
    assert in_words(said) == "1 right, 1 wrong of 3, before 2 and 0"
    with pytest.raises(ValueError, match="different"):
        worth(base, before)


def test_rows_are_kept_beside_those_of_earlier_runs(tmp_path: Path) -> None:
    row = {"constant": "a.B", "value": 1.0, "unit": "m", "decides": "all", "gap_points": 1.0}
    row |= {"worst_points": 2.0, "measured": "certificate", "questions": 3, "commit": "abc"}
    save([{**row, "ablated": 2.0}, {**row, "ablated": 3.0}], tmp_path / "kept.json")
    save([{**row, "ablated": 2.0, "gap_points": 4.0}], tmp_path / "kept.json")
    kept = json.loads((tmp_path / "kept.json").read_text("utf-8"))
    assert [(one["ablated"], one["gap_points"]) for one in kept] == [(2.0, 4.0), (3.0, 1.0)]
    assert (tmp_path / "kept.md").read_text("utf-8") == page(kept)
    assert "| `a.B` | 1.0 | 2.0 | m | all | certificate | 3 | gap +4.00 points" in page(kept)


def test_a_value_that_is_an_array_keeps_one_row(tmp_path: Path) -> None:
    row = {"constant": "a.B", "value": (1.0,), "unit": "m", "decides": "all", "gap_points": 1.0}
    row |= {"worst_points": 2.0, "measured": "certificate", "questions": 3, "commit": "abc"}
    for gap in (1.0, 5.0):
        save([{**row, "ablated": (2.0, 3.0), "gap_points": gap}], tmp_path / "kept.json")
    (kept,) = json.loads((tmp_path / "kept.json").read_text("utf-8"))
    assert kept["gap_points"] == 5.0


def test_a_row_whose_constant_has_gone_is_not_kept(tmp_path: Path) -> None:
    row = {"constant": "a.B", "value": 1.0, "unit": "m", "decides": "all", "gap_points": 1.0}
    row |= {"worst_points": 2.0, "measured": "certificate", "questions": 3, "commit": "abc"}
    values = ({**row, "ablated": 2.0}, {**row, "ablated": 3.0})
    save(values, tmp_path / "kept.json", of={key_of(values[1])})
    (kept,) = json.loads((tmp_path / "kept.json").read_text("utf-8"))
    assert kept["ablated"] == 3.0


def test_kept_rows_are_of_the_table() -> None:
    kept = json.loads(KEPT.read_text("utf-8"))
    assert {key_of(row) for row in kept} - keys(TABLE) == set()
    assert KEPT.with_suffix(".md").read_text("utf-8") == page(kept)


def test_questions_are_enough() -> None:
    assert len(QUESTIONS) == len(set(QUESTIONS)) == 12
