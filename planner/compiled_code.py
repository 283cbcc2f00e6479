"""``njit`` for all of planner: compiled code is found again by the content it follows from.

    from planner.compiled_code import njit

numba looks for compiled code by the path and the time of one source file. So the same package at
another path compiles anew, and a change in a module that the file imports leaves stale code. Here
the key is the content of the module and of all that it imports (``code_cache``). A second
checkout, a container or a wheel finds what the first compiled. A change compiles only what follows
from it.

``JOULEPATH_CACHE_DIR`` moves the folder. ``NUMBA_CACHE_DIR``, where set, leaves all to numba.

Three things let numba itself compile in less time. Garbage is collected seldom meanwhile, numba's
options are compared by what is set in them, and a call of a built-in function is resolved once for
all kernels of a process. What is compiled is the same.
"""

from __future__ import annotations

import gc
import os
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit as njit
from numba.core import event
from numba.core.caching import CacheImpl
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import Function

from planner.code_cache import code_folder

OBJECTS_BEFORE_COLLECTION = 100_000
"""New objects after which garbage is collected while numba compiles. At Python's 700, much of the
time goes into looking at objects that stay; at this, a process takes little more memory."""


@cache  # one for each formula of an effect
def njit_once(function: Any) -> Any:
    """``njit`` of a function, the same for all modules of this process that call it.

    Each kernel of a model calls the formulas of its effects; a third of its time went into
    compiling them again. On disk they serve models that are seen first. A user's effect may
    stand in no file, or change with another one, so its code is not kept.
    """
    return njit(function, cache=code_folder(function.__module__) is not None)


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


class SeldomCollected(event.Listener):
    """Lets garbage be collected seldom from the start of compiling to its end.

    numba holds its lock meanwhile, so no two threads change the threshold.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._usual = gc.get_threshold()

    def on_start(self, event: Any) -> None:
        """A function begins; others may be compiled within."""
        if self._depth == 0:
            self._usual = gc.get_threshold()
            if 0 < self._usual[0] < OBJECTS_BEFORE_COLLECTION:
                gc.set_threshold(OBJECTS_BEFORE_COLLECTION, *self._usual[1:])
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """It is compiled, or cannot be."""
        self._depth -= 1
        if self._depth == 0:
            gc.set_threshold(*self._usual)


def same_options(one: Any, other: Any) -> Any:
    """Whether two of numba's sets of options agree.

    For each call that it types, numba compares these with each set it has seen. It asks both for
    all of their options by name, which is slow. What is not set is a default.
    """
    if type(one) is not type(other):
        return NotImplemented
    set_here, set_there = one._values, other._values
    return set_here == set_there or all(
        getattr(one, name) == getattr(other, name) for name in {*set_here, *set_there}
    )


_resolved: dict[tuple[int, int, Any], tuple[Any, Any]] = {}
_resolve = Function.get_call_type


def resolved_once(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """The signature that a call of a built-in function has with arguments of these types.

    numba asks the function's templates in turn, for each ``+`` and each index anew, and words an
    error for each that does not fit. The first that fits is always the same.
    """
    if kws:
        return _resolve(function, context, args, kws)
    key = id(function), id(context), args
    if key not in _resolved:
        # With the function itself, so that no other one is given its number.
        _resolved[key] = function, _resolve(function, context, args, kws)
    return _resolved[key][1]


CacheImpl._locator_classes.insert(0, ContentLocator)
event.register("numba:compile", SeldomCollected())  # type: ignore[no-untyped-call]
if "_values" in TargetConfig.__slots__:  # numba may change
    TargetConfig.__eq__ = same_options  # type: ignore[method-assign]
    # numba hashes the options' names, which all sets of a class share.
    TargetConfig.__hash__ = lambda options: hash(type(options))  # type: ignore[method-assign]
Function.get_call_type = resolved_once  # type: ignore[assignment, method-assign]
