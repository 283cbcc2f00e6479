"""A wrong import of each kind fails ``make check``: a line is added to a copy of the packages."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BESIDE = Path(sys.executable).parent

WRONG = {
    "upward, from power to search": (
        "planner/power/kinematics.py",
        "import planner.search.plan",
        "Data flows one way",
    ),
    "upward, between rooms of search": (
        "planner/search/field/surface.py",
        "import planner.search.grid",
        "Rooms of search",
    ),
    "upward, between rooms of telemetry": (
        "planner/telemetry/logs/log.py",
        "import planner.telemetry.diagnosis",
        "Rooms of telemetry",
    ),
    "upward, between rooms of the service": (
        "service/store/files.py",
        "import service.http",
        "Rooms of the service",
    ),
    "past a face": (
        "planner/search/plan.py",
        "import planner.search.field.cost_field",
        "Rooms are entered by their faces",
    ),
    "in a circle": (
        "planner/terrain/interpolation.py",
        "import planner.terrain.heightmap",
        "No circles",
    ),
    "from a result to its picture": (
        "planner/search/results/route.py",
        "import planner.report",
        "Data flows one way",
    ),
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packages with what the linters read."""
    folder = tmp_path_factory.mktemp("packages")
    hidden = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc", ".*")
    for name in ("planner", "service", "maps", "tests/contracts"):
        shutil.copytree(ROOT / name, folder / name, ignore=hidden)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def told(copy: Path, *command: str) -> tuple[int, str]:
    """How a linter ends in the copy, and what it says."""
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(
        [str(BESIDE / command[0]), *command[1:]],
        cwd=copy,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def test_the_contracts_hold_as_things_are(copy: Path) -> None:
    """What follows fails for the added line alone."""
    code, said = told(copy, "lint-imports", "--no-cache")
    assert code == 0, said
    code, said = told(copy, "ruff", "check", "--no-cache", "planner", "service")
    assert code == 0, said


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_import_is_refused(copy: Path, kind: str) -> None:
    """The linter names the contract that the line breaks."""
    name, line, contract = WRONG[kind]
    path = copy / name
    text = path.read_text()
    path.write_text(f"{text}\n{line}\n")
    try:
        code, said = told(copy, "lint-imports", "--no-cache")
    finally:
        path.write_text(text)
    assert code != 0, said
    assert f"{contract} BROKEN" in said, said


@pytest.mark.parametrize(
    "line",
    [
        'import importlib\n\nimportlib.import_module("planner.report")',
        'from importlib import import_module\n\nimport_module("planner.report")',
        'import builtins\n\nbuiltins.__import__("planner.report")',
    ],
)
def test_an_import_by_text_is_refused(copy: Path, line: str) -> None:
    """A name in quotes would hide an arrow from the contracts."""
    path = copy / "planner/search/by_text.py"
    path.write_text(f'"""Reaches up by a text."""\n\n{line}\n')
    try:
        code, said = told(copy, "ruff", "check", "--no-cache", str(path))
    finally:
        path.unlink()
    assert code != 0
    assert "TID251" in said, said


def reached_by_text(tree: ast.Module) -> list[str]:
    """What ruff does not see: the builtin itself, and a loaded module by its name."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id == "__import__":
            found.append(ast.unparse(node))
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            ours = str(node.slice.value).split(".")[0] in ("planner", "service", "maps")
            if ours and ast.unparse(node.value).endswith("modules"):
                found.append(ast.unparse(node))
    return found


@pytest.mark.parametrize(
    "line",
    [
        '__import__("planner.report")',
        'sys.modules["planner.report"]',
        'from sys import modules\nmodules["planner.report"]',
    ],
)
def test_other_texts_are_found(line: str) -> None:
    assert len(reached_by_text(ast.parse(line))) == 1


def test_no_module_is_reached_by_another_text() -> None:
    sources = [
        path for name in ("planner", "service", "maps") for path in (ROOT / name).rglob("*.py")
    ]
    assert len(sources) > 100
    found = {str(path): reached_by_text(ast.parse(path.read_text("utf-8"))) for path in sources}
    assert {name: texts for name, texts in found.items() if texts} == {}
