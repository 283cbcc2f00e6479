"""Lines of a function body that no result depends on are left out.

A log asks for the power alone: the lines that look at limits and book balances then do nothing.
"""

from __future__ import annotations

import ast
import copy
from functools import cache

_KEPT_IN = ("per_wheel", "account")


def needed_lines(body: list[ast.stmt], *, keep_arrays: bool) -> list[ast.stmt]:
    """The lines that some result depends on; a name stands for all values that it ever takes.

    Args:
        body: statements.
        keep_arrays: whether what is written to arrays is a result, besides what is returned.
    """
    places = cache(_places)
    needed: set[str] = set()

    def kept(lines: list[ast.stmt]) -> list[ast.stmt]:
        found: list[ast.stmt] = []
        for line in reversed(lines):  # most of what a line reads stands above it
            if isinstance(line, ast.If | ast.For) and not line.orelse:
                inner = copy.copy(line)
                inner.body = kept(line.body)
                if inner.body:
                    needed.update(places(line.test if isinstance(line, ast.If) else line.iter)[0])
                    found.append(inner)
                continue
            reads, writes = places(line)
            is_result = isinstance(line, ast.Return) or (keep_arrays and "[" in "".join(writes))
            if is_result or not needed.isdisjoint(writes):
                needed.update(reads)
                found.append(line)
        return found[::-1]

    size = -1
    while len(needed) > size:
        size = len(needed)
        found = kept(body)
    return found


def _places(node: ast.AST) -> tuple[set[str], set[str]]:
    """Names and places in ``per_wheel`` and ``account`` that are read, and written."""
    found: tuple[set[str], set[str]] = set(), set()
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            found[isinstance(part.ctx, ast.Store)].add(part.id)
        elif isinstance(part, ast.Subscript) and ast.unparse(part.value) in _KEPT_IN:
            found[isinstance(part.ctx, ast.Store)].add(ast.unparse(part))
    return found
