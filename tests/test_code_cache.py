"""Folders of compiled code: one for each content; old ones go; none where nothing is written."""

import ast
import gc
import inspect
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from planner.code_cache import KEPT_SECONDS, KERNEL_PREFIX, code_folder, parsed
from planner.power.kernels import stages


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    code_folder.cache_clear()
    yield
    code_folder.cache_clear()


def test_a_folder_that_cannot_be_made_is_left_to_numba(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(file))
    assert code_folder("planner.terrain.interpolation") is None


def test_old_code_of_other_content_goes_and_new_stays(tmp_path: Path) -> None:
    of_module = tmp_path / "cache" / "compiled" / "planner.terrain.interpolation"
    long_ago = time.time() - 2.0 * KEPT_SECONDS
    for name in ("old", "new"):
        (of_module / name).mkdir(parents=True)
    os.utime(of_module / "old", (long_ago, long_ago))
    assert code_folder("planner.terrain.interpolation") is not None
    assert not (of_module / "old").exists()
    assert (of_module / "new").exists()


def test_what_was_read_of_another_checkout_is_not_read_again(tmp_path: Path) -> None:
    """A machine's checkouts come and go; a start takes no longer for them."""
    sources = tmp_path / "cache" / "compiled" / "sources"
    program = "from planner.code_cache import content_key; content_key('planner.errors')"
    here, package = Path(__file__).parent.parent, tmp_path / "there" / "planner"
    package.mkdir(parents=True)
    for name in ("__init__.py", "code_cache.py", "errors.py", "shown.py"):
        shutil.copy(here / "planner" / name, package)

    def kept_of(checkout: Path) -> Path:
        subprocess.run([sys.executable, "-c", program], cwd=checkout, check=True)
        texts = {file: file.read_text("utf-8") for file in sources.glob("*/*.json")}
        (own,) = (file for file, text in texts.items() if str(checkout / "planner") in text)
        assert not any(str(here) in text and str(package) in text for text in texts.values())
        return own

    old = kept_of(package.parent).parent
    long_ago = time.time() - 2.0 * KEPT_SECONDS
    os.utime(old, (long_ago, long_ago))
    assert kept_of(here).parent != old
    assert not old.exists()


def test_a_generated_kernel_is_kept_by_its_name() -> None:
    folder = code_folder(f"{KERNEL_PREFIX}0123456789abcdef0123")
    assert folder is not None
    assert folder.name.startswith("0123456789abcdef0123-")
    assert folder.parent.name == KERNEL_PREFIX.rstrip("_")


def test_looking_for_compiled_code_loads_no_compiler() -> None:
    program = "import sys, service.compiling; print({'numba', 'numpy'} & {*sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "set()"


def test_threads_that_parse_at_once_get_the_same_tree() -> None:
    """The collector of garbage lets another thread run in the midst of a tree."""
    text, before = inspect.getsource(stages), gc.get_threshold()

    def another(phase: str, info: dict[str, int]) -> None:
        os.sched_yield()

    gc.callbacks.append(another)
    gc.set_threshold(50)
    try:
        with ThreadPoolExecutor(4) as threads:
            trees = list(threads.map(lambda _: parsed(text), range(200)))
    finally:
        gc.callbacks.remove(another)
        gc.set_threshold(*before)
    assert len({ast.dump(tree) for tree in trees}) == 1
    assert isinstance(parsed("a + b", mode="eval").body, ast.BinOp)
    with pytest.raises(SyntaxError):
        parsed("a +")
