"""One constant of a module replaced before anything reads it, compiled code included.

    replace_when_imported("planner.search.resolution", "SLOWEST", 0.1)     # first of all
    in_compiled_code("planner.search.resolution", "SLOWEST")               # if so, then
    environment("planner.search.resolution", cache, folder)                # for the process

The module's text is compiled with the other value, so that all that is made of the constant at
import follows. numba would still load machine code with the old value from disk, since it looks at
the date of the file. Where compiled code may hold the constant, the process therefore gets a copy
of the cache without that code.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import shutil
import sys
from collections.abc import Iterator, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import grimp

GENERATED = "planner.power"
"""Package whose formulas and constants go into kernels that are written out as text."""


def replace_when_imported(module: str, name: str, value: Any) -> None:
    """Give a constant another value in this process.

    Args:
        module: not imported yet.
        name: of a constant that the module assigns at its top.
        value: number, text, or a tuple of these.

    Raises:
        ValueError: the module was imported before.
    """
    if module in sys.modules:
        raise ValueError(f"{module} is imported already")
    sys.meta_path.insert(0, _Finder(module, name, value))


class _Finder(MetaPathFinder):
    def __init__(self, module: str, name: str, value: Any) -> None:
        self.module, self.name, self.value = module, name, value

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module's own place, with a loader that replaces the constant."""
        spec = PathFinder.find_spec(fullname, path) if fullname == self.module else None
        if spec is None or spec.origin is None:
            return None
        loader = _Loader(fullname, spec.origin)
        loader.name_of_constant, loader.value = self.name, self.value
        return importlib.util.spec_from_file_location(fullname, spec.origin, loader=loader)


class _Loader(SourceFileLoader):
    name_of_constant: str
    value: Any

    def get_code(self, fullname: str) -> CodeType:
        """Code of the changed text, never that on disk."""
        text = Path(self.path).read_text(encoding="utf-8")
        return compile(replaced(text, self.name_of_constant, self.value), self.path, "exec")


def replaced(text: str, name: str, value: Any) -> ast.Module:
    """The module with another value of a constant.

    Raises:
        ValueError: it assigns no such constant.
    """
    tree = ast.parse(text)
    new = ast.parse(repr(value), mode="eval").body
    found = False
    for node in tree.body:
        for target in _targets(node):
            if isinstance(target, ast.Name) and target.id == name:
                node.value, found = new, True  # type: ignore[attr-defined]
            elif isinstance(target, ast.Tuple):
                for place, element in enumerate(target.elts):
                    if isinstance(element, ast.Name) and element.id == name:
                        node.value.elts[place], found = new, True  # type: ignore[attr-defined]
    if not found:
        raise ValueError(f"{name}: not assigned at the module's top")
    return ast.fix_missing_locations(tree)


def _targets(node: ast.stmt) -> Sequence[ast.expr]:
    if isinstance(node, ast.Assign):
        return node.targets
    return [node.target] if isinstance(node, ast.AnnAssign) and node.value else []


def environment(module: str, cache: Path, folder: Path) -> dict[str, str]:
    """Variables of the environment with which a process compiles a module's code anew.

    Args:
        module: where the constant stands that compiled code holds.
        cache: numba's cache of the code as it is; it is copied.
        folder: an empty one for the copy.
    """
    copy = folder / "numba"
    shutil.copytree(cache, copy)
    for stale in stale_files(module, copy):
        stale.unlink()
    own = {"NUMBA_CACHE_DIR": str(copy)}
    if module.startswith(GENERATED):
        own["JOULEPATH_CACHE_DIR"] = str(folder / "kernels")
    return own


def stale_files(module: str, cache: Path) -> Iterator[Path]:
    """Files of numba's cache in which code of the module may be: its own and its users'."""
    package = module.partition(".")[0]
    graph = grimp.build_graph(package, cache_dir=None)
    for user in sorted({module, *graph.find_downstream_modules(module)}):
        place = importlib.util.find_spec(user)
        if place is not None and place.origin is not None:
            file = Path(place.origin).resolve()
            # The folder's name is numba's own.
            digest = hashlib.sha1(str(file.parent).encode(), usedforsecurity=False).hexdigest()
            yield from (cache / f"{file.parent.name}_{digest}").glob(f"{file.stem}.*")


def in_compiled_code(module: str, name: str) -> bool:
    """Whether a compiled function reads the constant, or one that is made of it."""
    if module.startswith(GENERATED):
        return True
    package = module.partition(".")[0]
    graph = grimp.build_graph(package, cache_dir=None)
    waiting, seen = [(module, name)], set()
    while waiting:
        here = waiting.pop()
        if here in seen:
            continue
        seen.add(here)
        tree = _tree(here[0])
        names = _made_of(tree, here[1])
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        for node in functions:
            compiled = any("njit" in ast.unparse(decorator) for decorator in node.decorator_list)
            read = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
            if compiled and names & read:
                return True
        for user in graph.find_modules_that_directly_import(here[0]):
            for node in ast.walk(_tree(user)):
                if isinstance(node, ast.ImportFrom) and node.module == here[0]:
                    taken = [alias for alias in node.names if alias.name in names]
                    waiting += [(user, alias.asname or alias.name) for alias in taken]
    return False


def _tree(module: str) -> ast.Module:
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return ast.parse(Path(spec.origin).read_text(encoding="utf-8"))


def _made_of(tree: ast.Module, name: str) -> set[str]:
    """The constant and those that the module makes of it at its top."""
    names = {name}
    for node in tree.body:
        targets = _targets(node)
        if not targets or node.value is None:  # type: ignore[attr-defined]
            continue
        read = {n.id for n in ast.walk(node.value) if isinstance(n, ast.Name)}  # type: ignore[attr-defined]
        if read & names:
            parts = (part for target in targets for part in ast.walk(target))
            names |= {part.id for part in parts if isinstance(part, ast.Name)}
    return names
