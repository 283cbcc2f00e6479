"""Refuses formulas whose derivative a complex step would miss.

    check_differentiable(AirDrag.hooks["body_force"], REAL, "AirDrag.body_force")

A formula is differentiated by an imaginary step on a parameter (planner.power.kernel_math). The
step has to pass through every operation. The built-in ``abs`` drops it and the derivative becomes
a silent zero; ``max`` and an order of two values do not compile. The text of the formula is read,
and each such construct is refused with its replacement.

A comparison may look at real inputs such as a quantity of the row, and at ``.real`` of any value:
it then chooses a branch, and the branch carries the step.
"""

from __future__ import annotations

import ast
import linecache
from collections.abc import Callable, Collection, Sequence
from functools import lru_cache
from typing import Any

from planner.code_cache import parsed
from planner.power import kernel_math

_LARGER = "larger(x, y), or positive(x) for max(x, 0)"
_SMALLER = "smaller(x, y), or negative(x) for min(x, 0)"
REPLACEMENTS = {
    **dict.fromkeys(("max", "maximum", "fmax"), _LARGER),
    **dict.fromkeys(("min", "minimum", "fmin"), _SMALLER),
    **dict.fromkeys(("abs", "absolute", "fabs"), "absolute(x)"),
    **dict.fromkeys(("sign", "copysign"), "sign(x, width)"),
    **dict.fromkeys(("pow", "power", "float_power"), "power_of(x, exponent)"),
    "clip": "smaller(larger(x, low), high)",
    "sqrt": "root(x)",
    "hypot": "root(x * x + y * y)",
    "exp": "exponential(x)",
    "sin": "sine(x)",
    "cos": "cosine(x)",
    "tanh": "saturating(x)",
    "isnan": "known(x)",
    "where": "positive(x), negative(x), or `a if x.real > 0.0 else b`",
}
"""Function of Python, math or numpy → what kernel_math has in its place."""


def check_differentiable(formula: Callable[..., Any], real: Collection[str], where: str) -> None:
    """Check that a complex step on a parameter passes through a formula.

    Args:
        formula: the function, written in a file.
        real: arguments that are real in every kernel.
        where: what to call the formula in an error.

    Raises:
        TypeError: a construct drops the step or does not compile; says which, and what to use.
    """
    code = formula.__code__
    for nodes in _definitions(source_tree(formula)).get(code.co_firstlineno, ()):
        arguments = {node.arg for node in nodes if isinstance(node, ast.arg)}
        stepped = _stepped(nodes, arguments - {*real})
        comparisons = [node for node in nodes if isinstance(node, ast.Compare)]
        compared = {id(part) for comparison in comparisons for part in ast.walk(comparison)}
        for node in nodes:
            fault = _call_fault(node, formula.__globals__) or _value_fault(node, stepped)
            if isinstance(node, ast.Attribute) and id(node) not in compared:
                fault = fault or _part_fault(node, stepped)
            if fault:
                line = getattr(node, "lineno", code.co_firstlineno)
                raise TypeError(f"{where}, line {line}: {fault}")


def source_tree(formula: Callable[..., Any]) -> ast.Module:
    """The file in which a function is written; empty where it is not known."""
    return _tree("".join(linecache.getlines(formula.__code__.co_filename)))


@lru_cache(maxsize=4)  # the hooks of one file follow each other
def _tree(text: str) -> ast.Module:
    found: ast.Module = parsed(text)
    return found


@lru_cache(maxsize=4)  # as above
def _definitions(tree: ast.Module) -> dict[int, list[list[ast.AST]]]:
    """First line of every function or lambda of a file → the nodes of each that begins there."""
    found: dict[int, list[list[ast.AST]]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            decorators = getattr(node, "decorator_list", ())
            first = min(part.lineno for part in (node, *decorators))
            found.setdefault(first, []).append(list(ast.walk(node)))
    return found


def _stepped(nodes: Sequence[ast.AST], names: set[str]) -> set[str]:
    """Names that may carry the step: the given ones and all that is computed from them."""
    assignments = [node for node in nodes if isinstance(node, ast.Assign | ast.AugAssign)]
    count = -1
    while len(names) > count:
        count = len(names)
        for node in assignments:
            if _carries(node.value, names):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                found = (part for target in targets for part in ast.walk(target))
                names = names | {part.id for part in found if isinstance(part, ast.Name)}
    return names


def _carries(node: ast.AST, stepped: set[str]) -> bool:
    """Whether the value of an expression may have an imaginary part."""
    if isinstance(node, ast.Name):
        return node.id in stepped
    if isinstance(node, ast.Compare) or (isinstance(node, ast.Attribute) and node.attr == "real"):
        return False
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "known":
        return False
    return any(_carries(child, stepped) for child in ast.iter_child_nodes(node))


def _call_fault(node: ast.AST, known: dict[str, Any]) -> str:
    if not isinstance(node, ast.Call):
        return ""
    name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
    if name in known and any(known[name] is own for own in vars(kernel_math).values()):
        return ""
    instead = REPLACEMENTS.get(name.rpartition(".")[2])
    if instead:
        return f"a complex step does not pass {name}(); use kernel_math.{instead}"
    return f"{name}() is not a function of planner.power.kernel_math, which is all a formula calls"


def _value_fault(node: ast.AST, stepped: set[str]) -> str:
    if isinstance(node, ast.Compare):
        for side in (node.left, *node.comparators):
            if _carries(side, stepped):
                text = ast.unparse(side)
                return (
                    f"{text!r} may be complex and cannot be compared; use larger, smaller, "
                    f"positive or negative of kernel_math, or compare ({text}).real"
                )
    tests: list[ast.expr] = []
    if isinstance(node, ast.If | ast.IfExp | ast.While):
        tests = [node.test]
    elif isinstance(node, ast.BoolOp):
        tests = node.values
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        tests = [node.operand]
    for test in tests:
        if _carries(test, stepped):
            return f"{ast.unparse(test)!r} is a number, not a condition; compare its .real"
    if not isinstance(node, ast.BinOp) or not _carries(node, stepped):
        return ""
    if isinstance(node.op, ast.Mod | ast.FloorDiv):
        return "% and // have steps, where there is no derivative; use kernel_math.bell or sine"
    if isinstance(node.op, ast.Pow):
        exponent = node.right.value if isinstance(node.right, ast.Constant) else None
        if not isinstance(exponent, int):
            return "** takes a whole number of 0 or more; use kernel_math.power_of(x, exponent)"
    return ""


def _part_fault(node: ast.Attribute, stepped: set[str]) -> str:
    if node.attr in ("real", "imag") and _carries(node.value, stepped):
        return f".{node.attr} outside a comparison drops the derivative; use the value itself"
    return ""
