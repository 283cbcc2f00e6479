"""Compile a model's kernel once and find it again on disk.

The module that ``kernel_source`` writes goes to ``cache_folder()`` under the hash of all that it
follows from: the specification, and the sources of the effects, of the stages and of the pass over
them. A change in any of them gives a new file, and nothing stale is ever loaded. A module that is
there is not written again. ``JOULEPATH_CACHE_DIR`` moves the folder. Where it cannot be written, a
temporary one is used and the next process compiles again.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numba
from numba.extending import register_jitable

from planner import quantities
from planner.code_cache import KERNEL_PREFIX, cache_base
from planner.power import account, effect, kernel_math, kinematics
from planner.power.kernels import idle_lines, pipeline, printed, row_blocks, specialise, stages
from planner.power.kernels.kernel import Kernel
from planner.power.kernels.pipeline import kernel_source
from planner.power.kernels.specialise import KernelSpec

_MADE_BY = {
    *(account, effect, kernel_math, kinematics, pipeline, printed, quantities, row_blocks),
    *(idle_lines, specialise, stages),
}
"""Modules besides the effects' own that a kernel's text, or what it calls, follows from."""

# Plain functions for those who compile nothing; kernels call them compiled.
for formula_function in vars(kernel_math).values():
    if isinstance(formula_function, FunctionType):
        register_jitable(cache=True)(formula_function)


def cache_folder() -> Path:
    """Folder of generated kernels; created when missing."""
    folder = cache_base() / "kernels"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    return Path(_temporary_folder())


@lru_cache(maxsize=1)  # one folder a process
def _temporary_folder() -> str:
    return tempfile.mkdtemp(prefix="joulepath-kernels-")


@lru_cache(maxsize=256)  # machine code, which the process never gives back
def compile_kernel(spec: KernelSpec) -> Kernel:
    """Compiled ``evaluate`` of pipeline for a specification.

    A process hashes the same one once.
    """
    parts = [numba.__version__, repr(spec), *(repr(effect.definition) for effect in spec.effects)]
    modules = {sys.modules[effect.__module__] for effect in spec.effects} | _MADE_BY
    parts += sorted(inspect.getsource(module) for module in modules)
    digest = hashlib.sha256("\0".join(parts).encode())
    return Kernel(_load(f"{KERNEL_PREFIX}{digest.hexdigest()[:20]}", spec))


def _load(name: str, spec: KernelSpec) -> Callable[..., Any]:
    module = sys.modules.get(name)
    if module is None:
        path = cache_folder() / f"{name}.py"
        if not path.exists():
            # Written beside and renamed, so that a second process never reads half a file.
            with tempfile.NamedTemporaryFile(
                "w", dir=path.parent, suffix=".part", delete=False, encoding="utf-8"
            ) as part:
                part.write(kernel_source(spec))
            os.replace(part.name, path)
        module = _import(name, path)
    evaluate: Callable[..., Any] = module.evaluate
    return evaluate


def _import(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load the generated power model {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
