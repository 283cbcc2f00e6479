"""Tables on disk: exact, shared by processes, bounded, and never in the way."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from planner.arrays import Array
from planner.search.steady import kept_tables
from planner.search.steady.kept_tables import kept_table

MAKER = "planner.search.steady.steady_cost_tables"


@dataclass(frozen=True)
class Table:
    costs: Array
    reach: float
    count: int


class Pair(NamedTuple):
    costs: Array
    stop: float


MADE = Table(np.random.default_rng(1).normal(size=(3, 4)), 0.1 + 0.2, 7)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("JOULEPATH_KEEP_TABLES", raising=False)
    return tmp_path / "tables"


def never() -> Table:
    raise AssertionError("it was there")


def test_what_is_read_is_what_was_built_to_the_last_bit(folder: Path) -> None:
    built = kept_table((MAKER, "a", b"\0\1"), Table, lambda: MADE)
    read = kept_table((MAKER, "a", b"\0\1"), Table, never)
    for one in (built, read):
        assert np.array_equal(one.costs, MADE.costs)
        assert (one.reach, one.count) == (MADE.reach, MADE.count)
    assert isinstance(read.count, int)
    pair = Pair(np.arange(3), 0.5)
    kept_table((MAKER, "pair"), Pair, lambda: pair)
    again = kept_table((MAKER, "pair"), Pair, lambda: Pair(np.zeros(1), 0.0))
    assert again.stop == 0.5
    assert again.costs.tolist() == [0, 1, 2]
    assert not list(folder.glob("*.part"))


@pytest.mark.parametrize("other", [(MAKER, "b"), ("planner.search.turns.turning_prices", "a")])
def test_another_key_or_maker_is_another_result(other: tuple[str, str]) -> None:
    kept_table((MAKER, "a"), Table, lambda: MADE)
    with pytest.raises(AssertionError, match="it was there"):
        kept_table(other, Table, never)


@pytest.mark.parametrize("damage", ["empty", "half", "text", "other fields"])
def test_a_damaged_file_is_built_anew(folder: Path, damage: str) -> None:
    kept_table((MAKER, "a"), Table, lambda: MADE)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    if damage == "other fields":
        with file.open("wb") as opened:
            np.savez(opened, costs=np.zeros(2))
    else:
        file.write_bytes({"empty": b"", "half": whole[: len(whole) // 2], "text": b"no"}[damage])
    assert kept_table((MAKER, "a"), Table, lambda: MADE) is MADE
    assert kept_table((MAKER, "a"), Table, never).count == 7


def test_a_folder_that_cannot_be_made_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "tables").write_text("a file")
    assert kept_table((MAKER, "a"), Table, lambda: MADE) is MADE


def test_nothing_is_kept_where_that_is_asked_for(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JOULEPATH_KEEP_TABLES", "0")
    assert kept_table((MAKER, "a"), Table, lambda: MADE) is MADE
    assert not folder.exists()


def test_what_was_not_used_for_longest_goes_first(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept_table((MAKER, 0), Table, lambda: MADE)
    (first,) = folder.iterdir()
    monkeypatch.setattr(kept_tables, "MOST_BYTES", 2 * first.stat().st_size)
    kept_table((MAKER, 1), Table, lambda: MADE)
    for number, file in enumerate(sorted(folder.iterdir(), key=lambda one: one == first)):
        os.utime(file, (1000 + number, 1000 + number))
    kept_table((MAKER, 0), Table, never)
    kept_table((MAKER, 2), Table, lambda: MADE)
    assert len(list(folder.iterdir())) == 2
    kept_table((MAKER, 0), Table, never)
    kept_table((MAKER, 2), Table, never)


QUESTION = """
import json
from planner import plan_route
answer = plan_route(map="tilted-plane", start=(4, 4), goal=(9, 12))
print(json.dumps([answer.routes[0].energy_j, answer.routes[0].to_json()["poses"]]))
"""


def test_a_second_process_answers_the_same_with_what_the_first_one_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The compiled code is that of all tests."""
    own = tmp_path / "own"
    own.mkdir()
    monkeypatch.delenv("JOULEPATH_CACHE_DIR")
    from planner.code_cache import cache_base

    for part in ("compiled", "kernels"):
        (cache_base() / part).mkdir(parents=True, exist_ok=True)
        (own / part).symlink_to(cache_base() / part)
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(own))
    answers = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", QUESTION], capture_output=True, text=True, check=True
        )
        answers.append(json.loads(done.stdout))
        kept = {file: file.stat().st_ino for file in (own / "tables").iterdir()}
    assert len(kept) >= 2
    assert answers[0] == answers[1]
    assert {file: file.stat().st_ino for file in (own / "tables").iterdir()} == kept
