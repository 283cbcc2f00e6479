"""The stages for a block of rows at once: the same lines, each under a loop over the rows.

    in_blocks(body)                 # statements of a function body about one ``row``

A log asks for the power of many rows. Row by row, each effect at its null values costs a test for
every wheel of every row, and the processor's vector units stay idle. So the lines are rewritten.
Lines that depend on the parameters alone stay: switches and loops over wheels. Each run of lines in
between depends on the row and gets a loop over the rows of the block. Values that outlive their
loop wait in ``scratch``, one stretch of BLOCK numbers each. Each row has the same operations in
the same order, so results are equal bit by bit (tests/power/kernels/test_row_blocks.py).

    columns     (ROW_LENGTH · BLOCK,) the rows, transposed: quantity by quantity
    count       rows of the block that are to be worked out
    found       (≥ BLOCK · results,) written: count values of each result, BLOCK apart

The lines may hold assignments to names and to ``per_wheel[wheel, number]``; loops and conditions
that depend on no row; conditions on the row that set a whole number for all rows, each of which
then does the additional work; and finally the ``return`` of results that depend on the row.
Anything else raises a ValueError.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import groupby

from planner.code_cache import parsed

BLOCK = 64
"""Number of rows in a block: enough for the vector units, few enough for the caches."""
BLOCK_ARGUMENTS = ("columns", "count", "parameters", "body", "wheels", "found")
_KEPT = 3  # values that a wheel keeps in per_wheel for the lines further down


def in_blocks(body: Sequence[ast.stmt]) -> list[str]:
    """Lines of the body of a function of BLOCK_ARGUMENTS.

    Args:
        body: body of a function of ``row``, ``parameters``, ``body``, ``wheels`` and
            ``per_wheel``, see the head of this module.

    Raises:
        ValueError: a line that cannot be rewritten.
    """
    *lines, last = body
    if not isinstance(last, ast.Return) or last.value is None:
        raise ValueError(f"{ast.unparse(last)}: the last line must return the watts")
    results = last.value.elts if isinstance(last.value, ast.Tuple) else [last.value]
    for number, result in enumerate(results):
        lines += parsed(f"found[{number * BLOCK} + k] = {ast.unparse(result)}").body
    blocks = _Blocks(lines)
    for result in results:
        if not blocks.of_row.intersection(_read(result)):
            raise ValueError(f"{ast.unparse(result)}: depends on no row")
    return blocks.lines


def _simple(tree: ast.AST) -> Iterator[ast.Assign | ast.AugAssign]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AugAssign):
            yield node


def _names(node: ast.AST, context: type[ast.expr_context]) -> list[str]:
    return [
        part.id
        for part in ast.walk(node)
        if isinstance(part, ast.Name) and isinstance(part.ctx, context)
    ]


def _read(node: ast.AST) -> list[str]:
    """Names that an expression or assignment reads."""
    changed = _names(node.target, ast.Store) if isinstance(node, ast.AugAssign) else []
    return _names(node, ast.Load) + changed


def _written(node: ast.AST) -> list[str]:
    return _names(node, ast.Store)


class _Blocks:
    """The rewriting: which names depend on the row, which of them outlive their loop, the text."""

    def __init__(self, body: Sequence[ast.stmt]) -> None:
        self._read = cache(_read)  # every line is asked for several times
        self.of_row = self._of_row(body)
        self._refuse(body)
        self.inputs = {
            name: node.value
            for node in body
            if isinstance(node, ast.Assign) and self._is_input(node)
            for name in _written(node)
        }
        self.pieces: list[tuple[int, str | list[ast.stmt]]] = []  # depth, and a line or a group
        self._walk([node for node in body if not self._is_input(node)], 0)
        groups = [piece for _, piece in self.pieces if isinstance(piece, list)]
        needed = {name for group in groups for name in self._needed(group)}
        self.places = {
            name: number for number, name in enumerate(sorted(needed - set(self.inputs)))
        }
        self.lines = [f"scratch = np.empty({max(1, len(self.places)) * BLOCK})"]
        self.lines.append(f"per_wheel = np.empty((wheels.shape[0], {_KEPT}, {BLOCK}))")
        for depth, piece in self.pieces:
            found = [piece] if isinstance(piece, str) else self._loop(piece)
            self.lines += ["    " * depth + line for line in found]

    def _of_row(self, body: Sequence[ast.stmt]) -> set[str]:
        """Names whose values differ from row to row."""
        found = {"row", "per_wheel"}
        lines = [(self._read(node), _written(node)) for line in body for node in _simple(line)]
        while True:
            more = {
                name for read, written in lines if not found.isdisjoint(read) for name in written
            }
            if more <= found:
                return found
            found |= more

    def _refuse(self, body: Sequence[ast.stmt]) -> None:
        """Conditions on the row whose outcome would have to be kept row by row."""
        for node in (part for line in body for part in ast.walk(line)):
            if not isinstance(node, ast.If | ast.For):
                continue
            if node.orelse:
                raise ValueError(
                    f"{ast.unparse(node)}: no branch beside the first can be rewritten"
                )
            asked = node.test if isinstance(node, ast.If) else node.iter
            if not self.of_row.intersection(_read(asked)):
                continue
            if isinstance(node, ast.For) or not all(map(self._sets_whole_number, node.body)):
                raise ValueError(f"{ast.unparse(node)}: depends on the row")

    def _sets_whole_number(self, node: ast.stmt) -> bool:
        return (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, int)
            and self.of_row.isdisjoint(_written(node))
        )

    @staticmethod
    def _is_input(node: ast.stmt) -> bool:
        """Whether a line does nothing but name a quantity of the row."""
        return (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Subscript)
            and isinstance(node.value.value, ast.Name)
            and node.value.value.id == "row"
        )

    def _walk(self, body: Sequence[ast.stmt], depth: int) -> None:
        for differs, lines in groupby(body, self._differs):
            if differs:
                self.pieces.append((depth, list(lines)))
                continue
            for node in lines:
                self.pieces.append((depth, ast.unparse(node).splitlines()[0]))
                if isinstance(node, ast.For | ast.If):
                    self._walk(node.body, depth + 1)

    def _differs(self, node: ast.stmt) -> bool:
        """Whether a line is one for every row."""
        if isinstance(node, ast.If):
            return bool(self.of_row.intersection(_read(node.test)))
        if not isinstance(node, ast.Assign | ast.AugAssign):
            return False
        return bool(self.of_row.intersection([*_written(node), *self._read(node)]))

    def _needed(self, group: Sequence[ast.stmt]) -> list[str]:
        """Names of the row that a loop takes from before it."""
        known: set[str] = {"row", "per_wheel"}
        needed: dict[str, None] = {}
        for node in group:
            for name in self._read(node):
                if name in self.of_row and name not in known:
                    needed[name] = None
            for part in _simple(node):
                known.update(_written(part))
        return list(needed)

    def _loop(self, group: Sequence[ast.stmt]) -> list[str]:
        lines = []
        for name in self._needed(group):
            value = self.inputs.get(name)
            lines.append(f"{name} = {ast.unparse(value) if value else self._scratch(name)}")
        lines += [line for node in group for line in ast.unparse(node).splitlines()]
        changed = dict.fromkeys(
            name for node in group for part in _simple(node) for name in _written(part)
        )
        lines += [f"{self._scratch(name)} = {name}" for name in changed if name in self.places]
        placed = _Placed(self.of_row)
        body = [ast.unparse(placed.visit(tree)) for tree in parsed("\n".join(lines)).body]
        # Looked up before the loop: a processor cannot know that a row's values do not change them.
        return [
            *(f"{name} = {text}" for text, name in placed.before.items()),
            "for k in range(count):",
            *("    " + line for text in body for line in text.splitlines()),
        ]

    def _scratch(self, name: str) -> str:
        return f"scratch[{self.places[name] * BLOCK} + k]"


class _Placed(ast.NodeTransformer):
    """Places in the arrays of a block instead of those in the arrays of a row.

    Attributes:
        before: what is the same for all rows of the loop → the name that it gets.
    """

    def __init__(self, of_row: set[str]) -> None:
        self.of_row = of_row
        self.before: dict[str, str] = {}

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """``row[3]``, ``per_wheel[i, 0]``, ``parameters[7]``, ``wheels[i, 2]``."""
        array, same = ast.unparse(node.value), not self.of_row.intersection(_read(node))
        self.generic_visit(node)
        if array == "row":
            return _expression(f"columns[{ast.unparse(node.slice)} * {BLOCK} + k]", node.ctx)
        if array == "per_wheel":
            return _expression(f"{self._name(node)}[k]", node.ctx)
        if same and array in ("parameters", "body", "wheels"):
            return ast.Name(self._name(node), node.ctx)
        return node

    def _name(self, node: ast.Subscript) -> str:
        return self.before.setdefault(ast.unparse(node), f"same_{len(self.before)}")


def _expression(text: str, context: ast.expr_context) -> ast.AST:
    found = parsed(text, mode="eval").body
    assert isinstance(found, ast.Subscript)
    found.ctx = context
    return found
