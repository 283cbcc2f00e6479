"""Compiled code: kept by content, found at another path, left alone where it is not planner's."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner import compiled_code
from planner.compiled_code import KEPT_SECONDS, KERNEL_PREFIX, ContentLocator, code_folder

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


def test_a_folder_that_cannot_be_made_is_left_to_numba(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(file))
    assert code_folder("planner.terrain.interpolation") is None


def test_old_code_of_other_content_goes_and_new_stays(tmp_path: Path) -> None:
    of_module = tmp_path / "cache" / "compiled" / "planner.terrain.interpolation"
    long_ago = compiled_code.time.time() - 2.0 * KEPT_SECONDS
    for name in ("old", "new"):
        (of_module / name).mkdir(parents=True)
    os.utime(of_module / "old", (long_ago, long_ago))
    assert code_folder("planner.terrain.interpolation") is not None
    assert not (of_module / "old").exists()
    assert (of_module / "new").exists()


def test_a_generated_kernel_is_kept_by_its_name() -> None:
    folder = code_folder(f"{KERNEL_PREFIX}0123456789abcdef0123")
    assert folder is not None
    assert folder.name.startswith("0123456789abcdef0123-")
    assert folder.parent.name == KERNEL_PREFIX.rstrip("_")
