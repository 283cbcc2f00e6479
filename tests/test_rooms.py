"""Rooms stay small and behind their faces, and tests stand where their modules stand.

A *room* is a package of ``planner`` or ``service``; its *face* is the ``__all__`` of its
``__init__``. ``tests/covered.toml`` lists the modules that a test file of another name covers.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST_FILES = 14
MOST_NAMES = 8
LONG = 80  # lines, from which on a module needs a test file
CATALOGUE = (
    "planner/power/effects"  # one file for each effect, all under tests/power/test_effect.py
)
PUBLIC = "planner/__init__.py"  # the contract with users, not a face between rooms
NAMED_TUPLE = ("_asdict", "_fields", "_make", "_replace")  # public, whatever they look like
COVERED: dict[str, str] = tomllib.loads((ROOT / "tests" / "covered.toml").read_text())["covered"]


def files_below(*folders: str) -> list[Path]:
    """Python files below folders of the repository, relative to its root."""
    found = (path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return sorted(path.relative_to(ROOT) for path in found)


SOURCES = files_below("planner", "service")
TESTS = files_below("tests")


def own_test(source: Path) -> Path:
    """Where a module's own test file stands; a package's stands beside the package's folder."""
    module = source.parent if source.name == "__init__.py" else source.with_suffix("")
    return Path("tests", *_below(module).parts[:-1], f"test_{module.name}.py")


def _below(module: Path) -> Path:
    return module.relative_to("planner") if module.parts[0] == "planner" else module


def needs_test(source: Path) -> bool:
    """Whether a module is long and is not one of the catalogue of effects."""
    long = len((ROOT / source).read_text("utf-8").splitlines()) > LONG
    return long and source.parent != Path(CATALOGUE)


def face(source: Path) -> list[str]:
    """Names in ``__all__``; empty without one."""
    for node in ast.parse((ROOT / source).read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    return []


def imported(source: Path) -> list[str]:
    """Names that an ``__init__`` takes from its own modules, lazy ones as the type checker sees."""
    own = ".".join(source.parent.parts)
    return [
        alias.asname or alias.name
        for top in ast.parse((ROOT / source).read_text("utf-8")).body
        for node in (top.body if isinstance(top, ast.If) else [top])
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{own}.")
        for alias in node.names
    ]


def private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def ours(module: str | None) -> bool:
    return (module or "").split(".")[0] in ("planner", "service")


def private_names(tree: ast.Module) -> Iterator[str]:
    """Underscore names of planner and service that a test imports or reaches into."""
    modules = set()  # local names of imported modules and packages
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in filter(lambda alias: ours(alias.name), node.names):
                modules.add(alias.asname or alias.name.split(".")[0])
                yield from filter(private, alias.name.split("."))
        elif isinstance(node, ast.ImportFrom) and ours(node.module):
            modules.update(alias.asname or alias.name for alias in node.names)
            yield from filter(
                private, [*(node.module or "").split("."), *(a.name for a in node.names)]
            )
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and private(node.attr):
            if node.attr not in NAMED_TUPLE and _root(node.value) in modules:
                yield ast.unparse(node)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("setattr"):
            # monkeypatch.setattr(module, "_name", ...)
            for target, name in pairwise(node.args):
                named = isinstance(name, ast.Constant) and private(str(name.value))
                if named and _root(target) in modules:
                    yield ast.unparse(node)


def _root(node: ast.expr) -> str:
    """``a`` of ``a.b.c``."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.parametrize("source", list(filter(needs_test, SOURCES)), ids=str)
def test_a_long_module_has_its_test_or_is_listed(source: Path) -> None:
    own = own_test(source)
    assert (ROOT / own).is_file() or source.as_posix() in COVERED, f"no {own}, and not listed"


@pytest.mark.parametrize(("source", "test"), list(COVERED.items()))
def test_a_listed_module_needs_its_entry(source: str, test: str) -> None:
    path = Path(source)
    assert path in SOURCES, "no such module"
    assert needs_test(path), "short enough without an entry"
    assert not (ROOT / own_test(path)).is_file(), "has a test file of its own name"
    assert Path(test) in TESTS, f"no such test file: {test}"
    assert Path(test).name.startswith("test_")


def test_no_folder_is_crowded() -> None:
    folders = {source.parent for source in SOURCES} - {Path(CATALOGUE)}
    counts = {str(f): sum(source.parent == f for source in SOURCES) for f in folders}
    assert {name: count for name, count in counts.items() if count > MOST_FILES} == {}


def test_faces_are_narrow() -> None:
    faces = {
        str(source): len(face(source))
        for source in SOURCES
        if source.name == "__init__.py" and source != Path(PUBLIC)
    }
    assert {name: count for name, count in faces.items() if count > MOST_NAMES} == {}


@pytest.mark.parametrize("source", [s for s in SOURCES if s.name == "__init__.py"], ids=str)
def test_a_face_is_what_its_room_exports(source: Path) -> None:
    names = face(source)
    assert sorted(names) == sorted(imported(source))
    # ``from room import name`` would give the one or the other, by what was imported before.
    modules = {path.stem for path in SOURCES if path.parent == source.parent}
    folders = {path.parent.name for path in SOURCES if path.parent.parent == source.parent}
    assert set(names) & (modules | folders) == set()


@pytest.mark.parametrize("test", TESTS, ids=str)
def test_no_test_uses_private_names(test: Path) -> None:
    assert list(private_names(ast.parse((ROOT / test).read_text("utf-8")))) == []


@pytest.mark.parametrize(
    "text",
    [
        "from planner.search.trajectory.speed_profile import _relax",
        "from planner.search import speed as s\ns._relax(1)",
        "import planner.search.trajectory.speed_profile\nplanner.search.speed._relax(1)",
        "from planner._compiled import settle",
        "from planner.search import speed\nmonkeypatch.setattr(speed, '_relax', None)",
        "from service.jobs import runner\nrunner.jobs._spawn",
    ],
)
def test_private_names_are_found(text: str) -> None:
    assert len(list(private_names(ast.parse(text)))) == 1


@pytest.mark.parametrize(
    "text",
    [
        "from planner.search.results.route import Route\nroute = Route()\nroute._replace(a=1)",
        "from planner.search.results.route import Route\nRoute._make(range(3))",
        "import planner\nplanner.__version__",
        "import os\nos._exit(0)",
        "from tests.search.maps import _cone",
    ],
)
def test_other_names_are_let_be(text: str) -> None:
    assert list(private_names(ast.parse(text))) == []
