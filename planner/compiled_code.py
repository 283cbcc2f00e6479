"""``njit`` for all of planner: compiled code is found again by the content it follows from.

    from planner.compiled_code import njit

numba looks for compiled code by the path and the time of one source file. So the same package at
another path compiles anew, and a change in a module that the file imports leaves stale code. Here
the key is the content of the module and of all that it imports (``source_keys``). A second
checkout, a container or a wheel finds what the first compiled. A change compiles only what follows
from it.

``JOULEPATH_CACHE_DIR`` moves the folder. ``NUMBA_CACHE_DIR``, where set, leaves all to numba.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import time
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba import njit as njit
from numba.core.caching import CacheImpl

from planner.source_keys import COMPILER, Sources

KERNEL_PREFIX = "joulepath_kernel_"
"""Modules of generated kernels; the rest of such a name is the key of their content."""
KEPT_SECONDS = 7 * 24 * 3600
"""Code of another content is removed once it was not used for a week."""

VERSIONS = f"{sys.implementation.cache_tag}-{numba.__version__}"
"""Of what compiles: code of two compilers does not mix."""


def cache_base() -> Path:
    """Folder for everything that joulepath compiles."""
    chosen = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(chosen) if chosen else Path.home() / ".cache" / "joulepath"


class ContentLocator:
    """Where the compiled code of a function of planner is kept.

    Args:
        folder: of the function's module at its present content.
        file: where the function stands, for numba's warnings.
    """

    def __init__(self, folder: Path, file: str) -> None:
        self._folder = folder
        self._py_file = file

    @classmethod
    def from_function(cls, function: Any, file: str) -> ContentLocator | None:
        """The locator of a function; None leaves it to numba's own locators."""
        if "NUMBA_CACHE_DIR" in os.environ:
            return None
        folder = code_folder(function.__module__)
        return None if folder is None else cls(folder, file)

    def ensure_cache_path(self) -> None:
        """Make the folder, in case it was removed since."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """The folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Stamp of the content: a folder has one content alone."""
        return self._folder.name

    def get_disambiguator(self) -> str:
        """Nothing: a module has no two functions of one name."""
        return ""


@cache
def code_folder(module: str) -> Path | None:
    """Folder of a module's compiled code; None if it is not of planner or cannot be written."""
    base = cache_base() / "compiled"
    if module.startswith(KERNEL_PREFIX):
        key = module.removeprefix(KERNEL_PREFIX)
    elif module.partition(".")[0] == __package__:
        key = _sources().key(module)
    else:
        return None
    of_module = base / module.partition(f"_{key}")[0]
    folder = of_module / f"{key}-{VERSIONS}"
    try:
        new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if new:
            _forget_old(of_module)
    except OSError:
        return None
    return folder


def compiled_modules() -> dict[str, set[str]]:
    """Modules of planner with compiled code → those of them that each one imports."""
    found = _sources().users(COMPILER, "njit")
    return {module: _sources().closure(module) & {*found} - {module} for module in found}


def is_compiled(module: str) -> bool:
    """Whether code of a module of planner at its present content is on disk."""
    folder = cache_base() / "compiled" / module / f"{_sources().key(module)}-{VERSIONS}"
    return any(folder.glob("*.nbc"))


def state() -> str:
    """20 hex digits that follow from the content of all modules with compiled code."""
    keys = (f"{module} {_sources().key(module)}" for module in sorted(compiled_modules()))
    return hashlib.sha256("\n".join([VERSIONS, *keys]).encode()).hexdigest()[:20]


@cache
def _sources() -> Sources:
    return Sources(Path(__file__).parent, cache_base() / "compiled" / "sources.json")


def _forget_old(folders: Path) -> None:
    for folder in folders.iterdir():
        if time.time() - folder.stat().st_mtime > KEPT_SECONDS:
            shutil.rmtree(folder, ignore_errors=True)


CacheImpl._locator_classes.insert(0, ContentLocator)
