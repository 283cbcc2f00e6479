"""Tables on disk that all processes of a machine share, by the content they follow from.

    key = "planner.search.steady.steady_cost_tables", model_key, "energy"
    costs = kept_table(key, SteadyCosts, lambda: steady_costs(model, rows, "energy"))

A table is a dataclass or a named tuple of arrays and numbers. The first part of its key is the
module that makes it: its content and that of all that it imports count, as for compiled code. The
least recently used files go first. A file that cannot be read or written is no error.

``JOULEPATH_CACHE_DIR`` moves the folder; ``JOULEPATH_KEEP_TABLES=0`` keeps nothing.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from planner.code_cache import VERSIONS, cache_base, content_key

MOST_BYTES = 1 << 30
"""Bytes of all files: tables of about twenty models under their conditions, on maps of one cell."""
UNREADABLE = (OSError, EOFError, KeyError, ValueError, TypeError, zipfile.BadZipFile)

Result = TypeVar("Result")


def kept_table(
    key: tuple[object, ...], kind: Callable[..., Result], build: Callable[[], Result]
) -> Result:
    """The table under a key: read, or built and written for the next process.

    Args:
        key: the module that makes it, then whatever else it follows from; numbers, texts, bytes.
        kind: a dataclass or a named tuple, whose fields are arrays, int or float.
        build: makes the table.
    """
    module, *more = key
    if os.environ.get("JOULEPATH_KEEP_TABLES") == "0":
        return build()
    parts = [VERSIONS, np.__version__, content_key(str(module)), *more]
    name = hashlib.sha256(repr(parts).encode()).hexdigest()[:32]
    path = cache_base() / "tables" / f"{name}.npz"
    try:
        return _read(path, kind)
    except UNREADABLE:
        result = build()
    with suppress(OSError):
        _write(path, result)
        _forget_oldest(path.parent)
    return result


def _names(kind: Any) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind)) if is_dataclass(kind) else tuple(kind._fields)


def _read(path: Path, kind: Callable[..., Result]) -> Result:
    # Of a damaged file, NumPy leaves open what it opened itself.
    with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
        values = {name: file[name] for name in _names(kind)}
    os.utime(path)
    return kind(**{name: v if v.ndim else v.item() for name, v in values.items()})


def _write(path: Path, result: object) -> None:
    """Written beside and renamed, so that a second process never reads half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
        try:
            np.savez(part, **{name: getattr(result, name) for name in _names(type(result))})
            os.replace(part.name, path)
        except BaseException:
            os.unlink(part.name)
            raise


def _forget_oldest(folder: Path) -> None:
    """Remove what was not used for longest, until the rest is at most MOST_BYTES."""
    states = ((path, path.stat()) for path in folder.iterdir())
    newest = sorted(states, key=lambda one: one[1].st_mtime_ns, reverse=True)
    together = 0
    for path, state in newest:
        together += state.st_size
        if together > MOST_BYTES:
            path.unlink(missing_ok=True)
