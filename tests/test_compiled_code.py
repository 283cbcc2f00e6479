"""Compiled code: kept by content, found at another path, left alone where it is not planner's."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner.code_cache import code_folder
from planner.compiled_code import ContentLocator

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
