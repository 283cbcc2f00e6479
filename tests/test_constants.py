"""Numeric constants of modules say what they are; one name stands for one value.

A constant has a docstring below it, or a comment on its line or above. Private names (``_X``) may
be used again: they are read in one file only.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def constants(text: str) -> Iterator[tuple[str, str, bool]]:
    """Name, value and whether it is explained, of each numeric constant of a module."""
    lines = ["", *text.splitlines()]  # numbered from 1, as ast does
    body = ast.parse(text).body
    for statement, after in zip_longest(body, body[1:]):
        match statement:
            case ast.Assign(targets=[target], value=value):
                pass
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                pass
            case _:
                continue
        if not _numeric(value):
            continue
        said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        near = (lines[statement.lineno], lines[statement.end_lineno or -1])
        said |= any("#" in line for line in near)
        said |= lines[statement.lineno - 1].lstrip().startswith("#")
        paired = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        pairs = zip(target.elts, value.elts, strict=True) if paired else [(target, value)]
        for name, number in pairs:
            if isinstance(name, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]*", name.id):
                yield name.id, ast.unparse(number), said


def _numeric(value: ast.expr) -> bool:
    try:
        found = ast.literal_eval(value)
    except ValueError:
        return False
    rest = [found]
    while rest:
        one = rest.pop()
        if isinstance(one, tuple | list) and one:
            rest += one
        elif isinstance(one, bool) or not isinstance(one, int | float):
            return False
    return True


def _all() -> Iterator[tuple[str, str, str, bool]]:
    for top in ("planner", "service", "maps"):
        for path in sorted((ROOT / top).rglob("*.py")):
            for found in constants(path.read_text("utf-8")):
                yield (path.relative_to(ROOT).as_posix(), *found)


def test_each_constant_is_explained() -> None:
    assert [f"{path}: {name}" for path, name, _, said in _all() if not said] == []


def test_one_name_stands_for_one_value() -> None:
    values: dict[str, set[str]] = defaultdict(set)
    for _, name, value, _ in _all():
        if not name.startswith("_"):
            values[name].add(value)
    assert {name: found for name, found in values.items() if len(found) > 1} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("\nA = 1\n", [("A", "1", False)]),
        ('\nA = 1\n"""m."""\n', [("A", "1", True)]),
        ("\nA = 1  # m\n", [("A", "1", True)]),
        ("\n# m\nA: Final = (1, 2.5)\n", [("A", "(1, 2.5)", True)]),
        ("\nA, B = 1, -2.0\nC = D\na = 3\nE = True\n", [("A", "1", False), ("B", "-2.0", False)]),
    ],
)
def test_constants_are_found(text: str, found: list[tuple[str, str, bool]]) -> None:
    assert list(constants(text)) == found
