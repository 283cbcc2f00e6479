"""Compiled code: kept by content, found at another path, left alone where it is not planner's."""

import gc
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numba import types
from numba.core import event
from numba.core.compiler import Flags
from numba.core.errors import TypingError
from numba.extending import lower_builtin, type_callable

from planner.code_cache import code_folder
from planner.compiled_code import OBJECTS_BEFORE_COLLECTION, ContentLocator, njit

ROOT = Path(__file__).parents[1]
PROGRAM = """
from planner.terrain.interpolation import interpolate
print(sum(interpolate.stats.cache_misses.values()), interpolate.stats.cache_path)
"""
"""Prints how often a kernel of terrain was compiled, and where its code is kept."""


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    code_folder.cache_clear()
    yield
    code_folder.cache_clear()


def compiled(checkout: Path, cache: Path) -> tuple[int, str]:
    """Kernels compiled by a fresh process in a checkout, and their folder."""
    kept = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    own = {"PYTHONPATH": str(checkout), "JOULEPATH_CACHE_DIR": str(cache)}
    program = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(
        program, cwd=checkout, env={**kept, **own}, capture_output=True, text=True, check=True
    )
    misses, folder = done.stdout.split(maxsplit=1)
    return int(misses), folder.strip()


def test_a_second_checkout_compiles_nothing(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(ROOT / "planner", copy / "planner")
    cache = tmp_path / "cache"
    first, folder = compiled(ROOT, cache)
    assert first > 0
    assert compiled(copy, cache) == (0, folder)


def test_other_content_is_compiled_anew(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(ROOT / "planner", copy / "planner")
    cache = tmp_path / "cache"
    _, folder = compiled(copy, cache)
    file = copy / "planner" / "terrain" / "interpolation.py"
    file.write_text(f"{file.read_text('utf-8')}\nMORE = 1.0\n", "utf-8")
    again, other = compiled(copy, cache)
    assert again > 0
    assert other != folder


def test_functions_of_others_are_left_to_numba() -> None:
    def function() -> None: ...

    assert ContentLocator.from_function(function, __file__) is None


def test_the_own_variable_of_numba_is_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    function = type("function", (), {"__module__": "planner.terrain.interpolation"})
    assert ContentLocator.from_function(function, "interpolation.py") is None


class Thresholds(event.Listener):
    """Objects before a collection, at the start and at the end of each function's compiling."""

    def __init__(self) -> None:
        self.started: list[int] = []
        self.ended: list[int] = []

    def on_start(self, event: event.Event) -> None:
        self.started.append(gc.get_threshold()[0])

    def on_end(self, event: event.Event) -> None:
        self.ended.append(gc.get_threshold()[0])


def test_garbage_is_collected_seldom_only_while_numba_compiles() -> None:
    usual, seen = gc.get_threshold(), Thresholds()
    assert usual[0] < OBJECTS_BEFORE_COLLECTION
    with event.install_listener("numba:compile", seen):
        njit(lambda values: np.sort(values))(np.ones(3))  # compiles functions within
    assert len(seen.started) > 1
    assert {*seen.started} == {OBJECTS_BEFORE_COLLECTION}
    assert gc.get_threshold() == usual
    assert seen.ended[-1] == usual[0]


@pytest.mark.parametrize("own", [0, 2 * OBJECTS_BEFORE_COLLECTION])
def test_a_collector_at_rest_or_of_a_higher_threshold_stays(own: int) -> None:
    usual, seen = gc.get_threshold(), Thresholds()
    gc.set_threshold(own)
    try:
        with event.install_listener("numba:compile", seen):
            njit(lambda value: value + 1)(1.0)
        assert gc.get_threshold()[0] == seen.started[-1] == own
    finally:
        gc.set_threshold(*usual)


def test_garbage_is_collected_as_usual_after_what_cannot_be_compiled() -> None:
    usual = gc.get_threshold()
    with pytest.raises(TypingError):
        njit(lambda value: value.unknown)(1.0)
    assert gc.get_threshold() == usual


@pytest.mark.parametrize(
    ("one", "other", "agree"),
    [
        ({}, {}, True),
        ({"nrt": True}, {"nrt": True}, True),
        ({"nrt": True}, {"nrt": False}, False),
        ({"nrt": True}, {}, False),
        ({"nrt": False}, {}, True),  # the default
        ({"nrt": False, "debuginfo": False}, {"fastmath": {}}, True),
        ({"error_model": "numpy"}, {"nrt": True}, False),
    ],
)
def test_options_of_numba_agree_where_all_their_values_do(
    one: dict[str, object], other: dict[str, object], agree: bool
) -> None:
    first, second = Flags(), Flags()
    for flags, given in ((first, one), (second, other)):
        for name, value in given.items():
            setattr(flags, name, value)
    assert (first.values() == second.values()) is agree
    assert (first == second) is (second == first) is agree
    assert not agree or hash(first) == hash(second)
    assert first != "Flags"


def test_a_call_of_a_built_in_function_is_resolved_once_for_each_type() -> None:
    asked = []

    def same(value: float) -> float:
        return value

    @type_callable(same)
    def typed(context: object) -> object:
        def of(value: object) -> object:
            asked.append(value)
            return value

        return of

    @lower_builtin(same, types.Any)
    def lowered(
        context: object, builder: object, signature: object, values: list[object]
    ) -> object:
        return values[0]

    @njit
    def once(value: float) -> float:
        return same(value) + 1

    @njit
    def thrice(value: float) -> float:
        return same(value) + same(value) + same(value)

    assert (once(0.5), thrice(0.5), once(2), thrice(2)) == (1.5, 1.5, 3, 6)
    assert isinstance(thrice(2), int)
    assert asked == [types.float64, types.int64]
