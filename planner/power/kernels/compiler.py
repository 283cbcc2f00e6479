"""Compile a model's kernel once and find it again on disk.

The module that ``kernel_source`` writes goes to ``cache_folder()`` under the hash of its
own text, of the effects' sources and of the helpers they call, so that a change in any of them
gives a new file and nothing stale is ever loaded. ``JOULEPATH_CACHE_DIR`` moves the folder; where
it cannot be written, a temporary one is used and the next process compiles again.
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
from types import ModuleType
from typing import Any

import numba

from planner.compiled_code import cache_base
from planner.power import effect as effect_module
from planner.power import kernel_math
from planner.power.kernels import printed as printed_module
from planner.power.kernels.kernel import Kernel
from planner.power.kernels.pipeline import kernel_source
from planner.power.kernels.specialise import KernelSpec


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

    A process writes and hashes the text once for the same one.
    """
    source = kernel_source(spec)
    digest = hashlib.sha256(numba.__version__.encode())
    for text in (source, *(inspect.getsource(sys.modules[e.__module__]) for e in spec.effects)):
        digest.update(text.encode())
    for module in (kernel_math, effect_module, printed_module):
        digest.update(inspect.getsource(module).encode())
    name = f"joulepath_kernel_{digest.hexdigest()[:20]}"
    return Kernel(_load(name, source))


def _load(name: str, source: str) -> Callable[..., Any]:
    module = sys.modules.get(name)
    if module is None:
        path = cache_folder() / f"{name}.py"
        if not path.exists():
            # Written beside and renamed, so that a second process never reads half a file.
            with tempfile.NamedTemporaryFile(
                "w", dir=path.parent, suffix=".part", delete=False, encoding="utf-8"
            ) as part:
                part.write(source)
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
