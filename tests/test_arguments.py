"""No call passes more arguments than a reader can hold in mind.

What compiled loops take together comes in named bundles (planner.search.kernel_arguments).
Elements of a tuple that is unpacked in the call count one by one.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST_ARGUMENTS = 12
OPTIONS = "service/cli/"
"""Verbs of the command line: each option is a parameter, and only the parser calls them."""


def passed(call: ast.Call) -> int:
    """How many arguments a call passes."""
    count = len(call.keywords)
    for one in call.args:
        inner = one.value if isinstance(one, ast.Starred) else None
        count += len(inner.elts) if isinstance(inner, ast.Tuple | ast.List) else 1
    return count


def taken(function: ast.FunctionDef) -> int:
    """How many parameters a function has."""
    every = function.args
    return len(every.posonlyargs) + len(every.args) + len(every.kwonlyargs)


def crowded(text: str) -> Iterator[str]:
    """Calls and functions of a module that are beyond the limit."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and passed(node) > MOST_ARGUMENTS:
            yield f"{node.lineno}: {ast.unparse(node.func)} is passed {passed(node)}"
        if isinstance(node, ast.FunctionDef) and taken(node) > MOST_ARGUMENTS:
            yield f"{node.lineno}: {node.name} takes {taken(node)}"


def test_no_call_is_crowded() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{one}"
        for top in ("planner", "service")
        for path in sorted((ROOT / top).rglob("*.py"))
        if not path.relative_to(ROOT).as_posix().startswith(OPTIONS)
        for one in crowded(path.read_text("utf-8"))
    ]
    assert found == []


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("f(*(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13))", 1),
        ("f(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12)", 0),
        ("f(*many, **more)", 0),
        ("def f(a, b, c, d, e, g, h, i, j, k, l, m, *, n): ...", 1),
    ],
)
def test_arguments_are_counted(text: str, count: int) -> None:
    assert len(list(crowded(text))) == count
