"""Formulas that users write: read, checked for names and dimensions, translated, never executed.

A formula is one expression of numbers, names, + - * / ** and the functions of ``FUNCTIONS``.
Python's parser only makes a tree of it; every node has to be on the short list here, every name
known, and every sum and argument of the right dimension in kg, m, s, A and K. A constant is a pure
number (0 fits any dimension); quantities and parameters carry units; rad counts as 1 and a
temperature in °C as K, so that only differences of temperatures make sense.

From the tree come a value for numpy arrays (``Formula.evaluate``, no code is generated) and one
line of text for the power model's kernel (``Formula.kernel_expression``), written from nodes made
here and from nothing that the user typed but numbers.

Left out
    comparisons, conditions, attributes, subscripts, strings, keywords, powers that vary.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from planner.code_cache import parsed
from planner.errors import ModelError
from planner.power.formulas.dimensions import NUMBER, Dimension, format_dimension, times
from planner.power.kernel_math import SLIDING_SPEED

MAX_CHARACTERS = 500
"""Length of a formula: ten times a law of the catalogue, and quickly checked."""
MAX_NODES = 200
"""Parts of a formula: more take long to compile."""
MAX_DEPTH = 20
"""Brackets and operations inside each other; keeps recursion far from Python's limit."""
MAX_EXPONENT = 4.0
"""Largest power either way: friction and losses need at most a cube."""
_TOKEN = re.compile(
    r" +|[A-Za-z_][A-Za-z0-9_]*|[-+*/(),]|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
    r"(?![A-Za-z0-9_.])"
)


class Function(NamedTuple):
    """A function that formulas may call.

    Attributes:
        least, most: number of its arguments.
        kernel: its name in planner.power.kernel_math.
        value: of arrays.
    """

    least: int
    most: int
    kernel: str
    value: Callable[..., Any]


def _bump(x: Any, centre: Any, width: Any) -> Any:
    apart = x - centre
    return np.exp(-apart * apart / (width * width + 1e-300))


def _of_all(reduced: np.ufunc) -> Callable[..., Any]:
    return lambda *parts: reduced.reduce(np.broadcast_arrays(*parts))


FUNCTIONS = {
    "abs": Function(1, 1, "absolute", np.abs),
    "sqrt": Function(1, 1, "root", lambda x: np.sqrt(np.maximum(x, 0.0))),
    "exp": Function(1, 1, "exponential", np.exp),
    "sin": Function(1, 1, "sine", np.sin),
    "cos": Function(1, 1, "cosine", np.cos),
    "tanh": Function(1, 1, "saturating", np.tanh),
    "min": Function(2, 4, "smaller", _of_all(np.minimum)),
    "max": Function(2, 4, "larger", _of_all(np.maximum)),
    "sign": Function(1, 1, "sign", lambda x: x / np.sqrt(x * x + SLIDING_SPEED * SLIDING_SPEED)),
    "hinge": Function(1, 1, "positive", lambda x: np.maximum(x, 0.0)),
    "bump": Function(3, 3, "bell", _bump),
}

_ACCEPTED = "numbers, quantities, declared parameters, + - * / **, brackets, and " + ", ".join(
    FUNCTIONS
)


@dataclass(frozen=True)
class Formula:
    """A checked formula.

    Attributes:
        text: as the user wrote it.
        tree: its expression; only nodes of the short list.
        names: names that occur, in the order of their first occurrence.
        dimension: of the result.
    """

    text: str
    tree: ast.expr
    names: tuple[str, ...]
    dimension: Dimension

    @property
    def sha256(self) -> str:
        """Hash of the expression, whatever its blanks and brackets."""
        return hashlib.sha256(ast.dump(self.tree).encode()).hexdigest()

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """Value for numbers or arrays by name, computed from the tree in float64."""
        with np.errstate(all="ignore"):
            return _value(self.tree, values)

    def kernel_expression(self, names: Mapping[str, str]) -> str:
        """One expression for the kernel, each name written as ``names`` says."""
        return ast.unparse(ast.fix_missing_locations(_translated(self.tree, names)))


def check_formula(
    text: Any, names: Mapping[str, Dimension], expected: Dimension, *, field: str = "formula"
) -> Formula:
    """Read and check a formula.

    Args:
        text: the expression.
        names: dimension of every name that may occur.
        expected: dimension that the result must have.
        field: what to call it in an error.

    Raises:
        ModelError: anything but the grammar above; says at which character.
    """
    if not isinstance(text, str):
        raise ModelError(field, "is not text", value=text, accepted=_ACCEPTED)
    if len(text) > MAX_CHARACTERS:
        raise ModelError(
            field, "is too long", value=len(text), accepted=f"at most {MAX_CHARACTERS} characters"
        )
    place = 0
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            raise _refusal(field, "contains an unexpected character", place, text[place])
        place = token.end()
    depth = 0
    for place, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth > MAX_DEPTH:
            raise _refusal(field, f"has more than {MAX_DEPTH} nested brackets", place, None)
    # Blanks at the beginning would count as indentation.
    offset = len(text) - len(text.lstrip(" "))
    try:
        tree = parsed(text[offset:], mode="eval").body
    except SyntaxError as error:
        place = offset + (error.offset or 1) - 1
        raise _refusal(field, "is not an expression", place, text[place : place + 10]) from error
    except (ValueError, RecursionError, MemoryError) as error:
        raise _refusal(field, "cannot be read", 0, text[:40]) from error
    checker = _Checker(field, text, offset, names)
    found = checker.dimension(tree, 0)
    if found is not None and found != expected:
        raise ModelError(
            field,
            f"gives {format_dimension(found)} where {format_dimension(expected)} is needed",
            value=text,
            accepted=f"an expression whose unit is {format_dimension(expected)}",
        )
    return Formula(text, tree, tuple(checker.seen), expected)


def _refusal(field: str, problem: str, place: int, value: Any) -> ModelError:
    return ModelError(
        field, f"{problem}, at character {place + 1}", value=value, accepted=_ACCEPTED
    )


class _Checker:
    """Walks the tree once; every node is either understood or refused."""

    def __init__(self, field: str, text: str, offset: int, names: Mapping[str, Dimension]) -> None:
        self.field, self.text, self.offset, self.names = field, text, offset, names
        self.seen: dict[str, None] = {}
        self.nodes = 0

    def refuse(self, node: ast.AST, problem: str) -> ModelError:
        start = self.offset + getattr(node, "col_offset", 0)
        end = self.offset + (getattr(node, "end_col_offset", None) or start + 1)
        return _refusal(self.field, problem, start, self.text[start:end][:40])

    def dimension(self, node: ast.expr, depth: int) -> Dimension | None:
        """Dimension of a node; None for the number 0, which fits all."""
        self.nodes += 1
        if self.nodes > MAX_NODES or depth > MAX_DEPTH:
            raise self.refuse(node, "is nested too deeply or has too many parts")
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.Name):
            if node.id not in self.names:
                problem = f"{node.id!r} is neither a quantity nor a declared parameter"
                if node.id in FUNCTIONS:
                    problem = f"{node.id!r} is a function and needs its argument"
                raise self.refuse(node, problem)
            self.seen[node.id] = None
            return self.names[node.id]
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            return self.dimension(node.operand, depth + 1)
        if isinstance(node, ast.BinOp):
            return self._operation(node, depth)
        if isinstance(node, ast.Call):
            return self._call(node, depth)
        raise self.refuse(node, f"{type(node).__name__} is not part of a formula")

    def _constant(self, node: ast.Constant) -> Dimension | None:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            raise self.refuse(node, "is not a real number")
        if not abs(node.value) <= 1e15:
            raise self.refuse(node, "is too large a number")
        return None if node.value == 0 else NUMBER

    def _operation(self, node: ast.BinOp, depth: int) -> Dimension | None:
        left = self.dimension(node.left, depth + 1)
        if isinstance(node.op, ast.Pow):
            exponent = _exponent(node.right)
            self.nodes += 1
            if exponent is None or not abs(exponent) <= MAX_EXPONENT:
                raise self.refuse(
                    node.right, f"an exponent is a number from -{MAX_EXPONENT:g} to 4"
                )
            if left is None:
                raise self.refuse(node, "a power of 0 has no unit")
            share = Fraction(exponent).limit_denominator(1000)
            return tuple(e * share for e in left)
        right = self.dimension(node.right, depth + 1)
        if isinstance(node.op, ast.Add | ast.Sub):
            return self._same(node, [left, right])
        if isinstance(node.op, ast.Mult):
            return None if left is None or right is None else times(left, right)
        if isinstance(node.op, ast.Div):
            if right is None:
                raise self.refuse(node, "divides by 0")
            return None if left is None else times(left, right, -1)
        raise self.refuse(node, f"{type(node.op).__name__} is not part of a formula")

    def _call(self, node: ast.Call, depth: int) -> Dimension | None:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            raise self.refuse(node.func, "there is no such function")
        least, most, *_ = FUNCTIONS[node.func.id]
        if node.keywords or not least <= len(node.args) <= most:
            raise self.refuse(
                node,
                f"{node.func.id} takes {least if least == most else f'{least} to {most}'} "
                "arguments",
            )
        parts = [self.dimension(argument, depth + 1) for argument in node.args]
        name = node.func.id
        if name in ("exp", "sin", "cos", "tanh"):
            if parts[0] not in (None, NUMBER):
                raise self.refuse(
                    node, f"{name} takes a pure number, not {format_dimension(parts[0] or NUMBER)}"
                )
            return NUMBER
        same = self._same(node, parts)
        if name in ("bump", "sign"):
            return NUMBER
        if name == "sqrt":
            return None if same is None else tuple(e / 2 for e in same)
        return same

    def _same(self, node: ast.expr, parts: list[Dimension | None]) -> Dimension | None:
        known = [part for part in parts if part is not None]
        for part in known[1:]:
            if part != known[0]:
                raise self.refuse(
                    node, f"mixes {format_dimension(known[0])} and {format_dimension(part)}"
                )
        return known[0] if known else None


def _exponent(node: ast.expr) -> float | None:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = _exponent(node.operand) if isinstance(node.operand, ast.Constant) else None
        return None if inner is None else -inner
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return None if isinstance(node.value, bool) else float(min(max(node.value, -99), 99))
    return None


def _real_power(x: Any, exponent: float) -> Any:
    return np.where(np.asarray(x) > 0.0, np.power(np.maximum(x, 1e-300), exponent), 0.0)


def _value(node: ast.expr, values: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return float(node.value)  # type: ignore[arg-type]  # the checker let only numbers through
    if isinstance(node, ast.Name):
        return values[node.id]
    if isinstance(node, ast.UnaryOp):
        inner = _value(node.operand, values)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        left = _value(node.left, values)
        if isinstance(node.op, ast.Pow):
            exponent = _exponent(node.right) or 0.0
            if exponent.is_integer():
                return np.power(np.asarray(left, float), exponent)
            return _real_power(left, exponent)
        right = _value(node.right, values)
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        return left * right if isinstance(node.op, ast.Mult) else np.divide(left, right)
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id].value(*(_value(argument, values) for argument in node.args))


def _call(name: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _translated(node: ast.expr, names: Mapping[str, str]) -> ast.expr:
    if isinstance(node, ast.Constant):
        return ast.Constant(float(node.value))  # type: ignore[arg-type]  # see _value
    if isinstance(node, ast.Name):
        return ast.Name(names[node.id], ast.Load())
    if isinstance(node, ast.UnaryOp):
        return ast.UnaryOp(type(node.op)(), _translated(node.operand, names))
    if isinstance(node, ast.BinOp):
        left = _translated(node.left, names)
        if isinstance(node.op, ast.Pow):
            exponent = _exponent(node.right) or 0.0
            if exponent.is_integer():
                return _call("whole_power", left, ast.Constant(int(exponent)))
            return _call("real_power", left, ast.Constant(exponent))
        return ast.BinOp(left, type(node.op)(), _translated(node.right, names))
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    parts = [_translated(argument, names) for argument in node.args]
    target = FUNCTIONS[node.func.id].kernel
    if node.func.id == "sign":
        return _call(target, parts[0], ast.Constant(SLIDING_SPEED))
    if node.func.id in ("min", "max"):
        folded = parts[0]
        for part in parts[1:]:
            folded = _call(target, folded, part)
        return folded
    return _call(target, *parts)
