"""Where compiled code is kept, by the content it follows from; needs no compiler itself.

    code_folder("planner.search.field.cost_field")      # Path, or None
    parsed("a + b", mode="eval")                        # ast.Expression

A folder belongs to one module at its present content: to its own and to that of all modules of the
package that it imports. Comments, docstrings and layout do not count. A name that a package's
``__init__`` only passes on leads to the module that has it, so a room's face does not tie all of
its modules together. What a module imports for the type checker alone is left out.

A file is read again only when its size or time changed; what was found in it is kept in a file.
``JOULEPATH_CACHE_DIR`` moves all folders.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

COMPILER = "planner.compiled_code"
"""Says where code is kept, not what it does: nothing follows from it."""
Import = tuple[str, str, str]
"""Module, name taken from it ("" for the module itself), and what it is called here."""
KERNEL_PREFIX = "joulepath_kernel_"
"""Modules of generated kernels; the rest of such a name is the key of their content."""
KEPT_SECONDS = 7 * 24 * 3600
"""Code of another content is removed once it was not used for a week."""

_ONE_AT_A_TIME = threading.Lock()
VERSIONS = f"{sys.implementation.cache_tag}-{version('numba')}"
"""Of what compiles: code of two compilers does not mix."""


def parsed(text: str, *, mode: str = "exec") -> Any:
    """Syntax tree of a text: ``ast.Module``, or ``ast.Expression`` in mode "eval".

    Python 3.11 counts how deep it is in a tree for all threads together. Two that parse at once may
    both fail with "AST constructor recursion depth mismatch", so here one waits for the other.

    Raises:
        SyntaxError: the text is no Python.
        ValueError: it has null bytes.
    """
    with _ONE_AT_A_TIME:
        return ast.parse(text, mode=mode)


def cache_base() -> Path:
    """Folder for everything that joulepath compiles."""
    chosen = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(chosen) if chosen else Path.home() / ".cache" / "joulepath"


@cache
def code_folder(module: str) -> Path | None:
    """Folder of a module's compiled code; None if it is not of planner or cannot be written."""
    base = cache_base() / "compiled"
    if module.startswith(KERNEL_PREFIX):
        key = module.removeprefix(KERNEL_PREFIX)
    elif _sources().holds(module):
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


def content_key(module: str) -> str:
    """20 hex digits that follow from a module of planner and from all that it imports of it."""
    return _sources().key(module)


def state() -> str:
    """20 hex digits that follow from the content of all modules with compiled code."""
    keys = (f"{module} {_sources().key(module)}" for module in sorted(compiled_modules()))
    return hashlib.sha256("\n".join([VERSIONS, *keys]).encode()).hexdigest()[:20]


@cache
def _sources() -> Sources:
    package = Path(__file__).parent
    # One file for each checkout: all of it is read at every start.
    checkout = hashlib.sha256(str(package).encode()).hexdigest()[:20]
    folder = cache_base() / "compiled" / "sources" / checkout
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        _forget_old(folder.parent)
    return Sources(package, folder / "read.json")


def _forget_old(folders: Path) -> None:
    for folder in folders.iterdir():
        if time.time() - folder.stat().st_mtime > KEPT_SECONDS:
            shutil.rmtree(folder, ignore_errors=True)


class Sources:
    """Digests and imports of a package's modules.

    Args:
        folder: of the package; its name is the package's name.
        kept: file for what was read of the sources; None reads them anew.
    """

    def __init__(self, folder: Path, kept: Path | None = None) -> None:
        self.folder = folder
        self._kept = kept
        self._read: dict[str, list[object]] = {}
        with suppress(OSError, TypeError, ValueError):
            if kept is not None:
                self._read = dict(json.loads(kept.read_text("utf-8")))
        self._changed = False
        self._sources: dict[str, tuple[str, list[Import]]] = {}
        self._resolved: dict[tuple[str, str], str | None] = {}

    def key(self, module: str) -> str:
        """20 hex digits that follow from a module and from all that it imports of its package."""
        digest = hashlib.sha256()
        for name in sorted(self.closure(module)):
            digest.update(f"{name} {self._source(name)[0]}\n".encode())
        self._save()
        return digest.hexdigest()[:20]

    def users(self, module: str, name: str) -> list[str]:
        """Modules of the package that take a name from a module, the least dependent ones first."""
        files = (path.relative_to(self.folder.parent) for path in sorted(self.folder.rglob("*.py")))
        modules = (".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in files)
        found = [one for one in modules if (module, name, name) in self._source(one)[1]]
        self._save()
        return sorted(found, key=lambda one: len(self.closure(one)))

    def closure(self, module: str) -> set[str]:
        """A module and all modules of the package that its content follows from."""
        found: set[str] = set()
        waiting = [module]
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                homes = (self._home(*taken[:2]) for taken in self._source(name)[1])
                waiting += [home for home in homes if home not in (None, COMPILER)]
        return found

    def _home(self, module: str, name: str) -> str | None:
        """The module that a name comes from; None outside of the package."""
        key = (module, name)
        if key not in self._resolved:
            self._resolved[key] = None  # a circle of faces ends here
            self._resolved[key] = self._find_home(module, name)
        return self._resolved[key]

    def _find_home(self, module: str, name: str) -> str | None:
        path = self._path(module)
        if path is None:
            return None
        if name and self._path(f"{module}.{name}") is not None:
            return f"{module}.{name}"
        if name and path.name == "__init__.py":
            for taken, own, called in self._source(module)[1]:
                if called == name and (home := self._home(taken, own)) is not None:
                    return home
        return module

    def holds(self, module: str) -> bool:
        """Whether a module stands in the package's folder; a package may have further ones."""
        return self._path(module) is not None

    @cache  # noqa: B019  one object a process
    def _path(self, module: str) -> Path | None:
        first, *rest = module.split(".")
        if first != self.folder.name:
            return None
        place = self.folder.joinpath(*rest)
        candidates = (place / "__init__.py", place.with_suffix(".py"))
        return next((path for path in candidates if path.is_file()), None)

    def _source(self, module: str) -> tuple[str, list[Import]]:
        """Digest of a module's own code, and what it imports."""
        if module not in self._sources:
            path = self._path(module)
            if path is None:
                raise ValueError(f"{module} is not a module of {self.folder}")
            state = path.stat()
            known = self._read.get(str(path))
            if known is None or known[:2] != [state.st_mtime_ns, state.st_size]:
                tree = parsed(path.read_text("utf-8"))
                known = [state.st_mtime_ns, state.st_size, _digest(tree), list(_imports(tree))]
                self._read[str(path)] = known
                self._changed = True
            imports = [tuple(taken) for taken in known[3]]  # type: ignore[attr-defined]
            self._sources[module] = str(known[2]), imports
        return self._sources[module]

    def _save(self) -> None:
        if not self._changed or self._kept is None:
            return
        self._changed = False
        with suppress(OSError):
            self._kept.parent.mkdir(parents=True, exist_ok=True)
            # Written beside and renamed, so that a second process never reads half a file.
            with tempfile.NamedTemporaryFile(
                "w", dir=self._kept.parent, suffix=".part", delete=False, encoding="utf-8"
            ) as part:
                json.dump(self._read, part)
            os.replace(part.name, self._kept)


def _digest(tree: ast.Module) -> str:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):  # a lambda's is an expression
            node.body = [line for line in body if not _is_text(line)]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:20]


def _is_text(node: ast.AST) -> bool:
    value = node.value if isinstance(node, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _imports(node: ast.AST) -> Iterator[Import]:
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from ((alias.name, "", alias.asname or alias.name) for alias in node.names)
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        yield from ((node.module, a.name, a.asname or a.name) for a in node.names)
    for child in ast.iter_child_nodes(node):
        yield from _imports(child)
