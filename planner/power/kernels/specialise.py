"""The stages for one set of effects: markers expanded, idle lines dropped.

    specialise(function, spec)      # statements of a function body that numba compiles

``function`` is the tree of ``stages.power``. A marker of ``stages.Hooks`` becomes the calls of the
active effects' formulas, named ``<slug>__<hook>``. An effect at its null values is skipped, which
saves time. Names of columns become their numbers. What no result depends on is dropped: the power
alone books no balance and looks at no limits. The order of operations is that of the stages.

Parameters of all effects stand one behind the other in the array ``parameters``.
"""

from __future__ import annotations

import ast
import copy
import inspect
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

from planner.power.account import ACCOUNT, BASE_EFFECTS, LIMITS, Output
from planner.power.effect import HOOKS, Effect, Parameter, parameter_slots
from planner.power.kernels import stages
from planner.quantities import INDEX

_WORST_IS_LEAST = ("least_load", "traction_left")
_MARKERS = ("hooks", "effect", "locals")
_SURFACE = f"row[{INDEX['surface']}]"


@dataclass(frozen=True)
class KernelSpec:
    """What a kernel is made for.

    Attributes:
        effects: active effects in the order of the catalogue.
        wheel_count: number of wheels of the layout.
        surface_count: number of surface labels that the model tells apart, at least 1.
        number: "float64" for planning, "complex128" for derivatives.
        printed: "A" or "B" puts the source paper's motor power (printed.py) in the place
            of the motors' and drivers' watts; loads and limits stay those of the sound model.
        output: "account" of one row; of a block of rows the "power", for loops over logs, or power
            and "limits", for loops over motions.
    """

    effects: tuple[type[Effect], ...]
    wheel_count: int
    surface_count: int
    number: str
    printed: str | None = None
    output: Output = "account"

    def having(self, hook: str) -> list[type[Effect]]:
        """Effects that act at a hook."""
        return [effect for effect in self.effects if hook in effect.hooks]

    @cached_property
    def slots(self) -> list[tuple[type[Effect], str, Parameter, int]]:
        """Effect, name, declaration and element of every number in ``parameters``."""
        return parameter_slots(
            self.effects, wheel_count=self.wheel_count, surface_count=self.surface_count
        )

    @cached_property
    def places(self) -> dict[tuple[str, str], int]:
        """Effect's slug and parameter's name to the place of its first element."""
        slots = enumerate(self.slots)
        return {(e.slug, name): place for place, (e, name, _, element) in slots if element == 0}


def specialise(function: ast.FunctionDef, spec: KernelSpec) -> list[ast.stmt]:
    """Statements of the body of a compiled function that returns W, and the limits if asked for.

    Args:
        function: the stages, ``stages.power`` or a shorter function; rewritten in place.
        spec: what the kernel is made for.

    Raises:
        ValueError: a marker is wrong or in the wrong place; two effects replace the same value.
    """
    *lines, last = function.body
    if not isinstance(last, ast.Return) or not isinstance(last.value, ast.Name):
        raise _refusal(last, "the last line must return the power by its name")
    if _is_docstring(lines[0]):
        del lines[0]
    place = next((k for k, line in enumerate(lines) if _marker(line) == "side"), len(lines))
    before, after = (_expanded(part, spec) for part in (lines[:place], lines[place + 1 :]))
    limits = list(LIMITS.values()) if spec.output == "limits" else []
    if place == len(lines):
        body = [*before, *_return([last.value.id, *limits])]
    else:
        body = before + _for_each_side(after, last.value.id, limits, spec)
    return _needed(body, keep_arrays=spec.output == "account")


def _refusal(node: ast.AST, problem: str) -> ValueError:
    where = f"{stages.__name__}, line {getattr(node, 'lineno', 0)}"
    return ValueError(f"{where}: {ast.unparse(node)}: {problem}")


def _lines(text: str) -> list[ast.stmt]:
    return ast.parse(text).body


def _expression(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _return(names: Iterable[str]) -> list[ast.stmt]:
    return _lines(f"return {', '.join(names)}")


def _is_docstring(line: ast.stmt) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)


def _marker(node: ast.AST) -> str | None:
    """Which marker a statement or expression is: the name behind ``hooks.``, "" for a loop."""
    if isinstance(node, ast.Assign | ast.Expr):
        return _marker(node.value)
    if isinstance(node, ast.Call):
        if isinstance(node.func, ast.Name) and node.func.id == "hooks":
            return ""
        return _marker(node.func)
    if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "hooks":
        return node.attr
    return None


def _expanded(lines: Sequence[ast.stmt], spec: KernelSpec) -> list[ast.stmt]:
    body: Any = ast.Module(list(lines), [])
    steps: list[ast.NodeTransformer] = [_Markers(spec), _Columns()]
    if not spec.having("circulation"):
        steps.append(_NoCirculation())
    for step in steps:
        body = step.visit(body)
    found: list[ast.stmt] = body.body
    return found


class _Markers(ast.NodeTransformer):
    """Calls of the active effects instead of markers."""

    def __init__(self, spec: KernelSpec) -> None:
        self.spec = spec
        self.balanced = spec.output == "account"

    def visit_For(self, node: ast.For) -> Any:
        """``for effect in hooks("slip"):``."""
        if _marker(node.iter) != "":
            return self.generic_visit(node)
        if ast.unparse(node.target) != "effect":
            raise _refusal(node.target, "the loop over a hook's effects names each 'effect'")
        hook, having = self._hook(node.iter)
        if HOOKS[hook].combine == "replace" and len(having) > 1:
            raise ValueError(f"{hook}: {' and '.join(e.slug for e in having)} both replace it")
        found = []
        for effect in having:
            takes = self.balanced and effect.slug in BASE_EFFECTS
            calls = _Calls(self._call(effect, hook), effect.slug if takes else None)
            body = calls.visit(ast.Module(copy.deepcopy(node.body), []))
            found += self._where_it_acts(effect, self.generic_visit(body).body)
        return found

    def visit_Assign(self, node: ast.Assign) -> Any:
        """``x = hooks.combine("bus", locals(), x=start)`` and ``zero = hooks.zero``."""
        marker = _marker(node)
        if marker == "combine":
            return self._combined(node)
        self.generic_visit(node)
        return [node, *self._switches()] if marker == "zero" else node

    def visit_Expr(self, node: ast.Expr) -> Any:
        """``hooks.book(gravity=x)`` and ``hooks.balance(account)``."""
        marker, call = _marker(node), node.value
        if marker == "book" and isinstance(call, ast.Call):
            texts = [f"watts_{word.arg} = {ast.unparse(word.value)}" for word in call.keywords]
        elif marker == "balance":
            columns = enumerate(BASE_EFFECTS, start=len(ACCOUNT))
            texts = [f"account[{column}] = watts_{slug}" for column, slug in columns]
        else:
            return self.generic_visit(node)
        return _lines("\n".join(texts)) if self.balanced else []

    def visit_If(self, node: ast.If) -> Any:
        """``if hooks.printed:``."""
        if _marker(node.test) is None:
            return self.generic_visit(node)
        return self.generic_visit(ast.Module(node.body, [])).body if self.spec.printed else []

    def visit_Call(self, node: ast.Call) -> Any:
        """``hooks.act("circulation")`` and ``hooks.parameter("roller_drag", "roller")``."""
        marker = _marker(node)
        if marker == "act":
            acts = [f"acts_{effect.slug}" for effect in self._hook(node)[1]]
            return _expression(" or ".join(acts) or "False")
        if marker == "parameter":
            slug, name = (ast.literal_eval(argument) for argument in node.args)
            return _expression(f"parameters[{self.spec.places[slug, name]}]")
        return self.generic_visit(node)

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        """``hooks.zero`` and ``hooks.printed``."""
        marker = _marker(node)
        if marker == "zero":
            return ast.Constant(0j if self.spec.number == "complex128" else 0.0)
        return ast.Constant(self.spec.printed) if marker == "printed" else self.generic_visit(node)

    def _hook(self, call: ast.expr) -> tuple[str, list[type[Effect]]]:
        """Name of the hook that a marker gives first, and the effects that act there."""
        arguments = call.args if isinstance(call, ast.Call) else []
        name = arguments[0].value if arguments and isinstance(arguments[0], ast.Constant) else None
        if name not in HOOKS:
            raise _refusal(call, f"no such hook; there are {', '.join(HOOKS)}")
        return str(name), self.spec.having(str(name))

    def _where_it_acts(self, effect: type[Effect], body: list[ast.stmt]) -> list[ast.stmt]:
        if effect.base or not body:
            return body
        return [ast.If(ast.Name(f"acts_{effect.slug}", ast.Load()), body, [])]

    def _combined(self, node: ast.Assign) -> list[ast.stmt]:
        hook, having = self._hook(node.value)
        assert isinstance(node.value, ast.Call)
        names = ast.unparse(node.targets[0]).strip("()").split(", ")
        if names != [word.arg for word in node.value.keywords]:
            raise _refusal(node, "combine starts the names that it is assigned to")
        starts = [ast.unparse(word.value) for word in node.value.keywords]
        sign = {"add": "+=", "multiply": "*="}[HOOKS[hook].combine]
        pairs = zip(names, starts, strict=True)
        body = _lines("\n".join(f"{name} = {start}" for name, start in pairs if name != start))
        for effect in having:
            call = ast.unparse(self._call(effect, hook))
            if len(names) == 1:
                text = f"{names[0]} {sign} {call}"
            else:
                parts = [f"part_of_{name}" for name in names]
                text = f"{', '.join(parts)} = {call}\n" + "\n".join(
                    f"{name} {sign} {part}" for name, part in zip(names, parts, strict=True)
                )
            body += self._where_it_acts(effect, _lines(text))
        return body

    def _switches(self) -> list[ast.stmt]:
        """Whether each effect beside the base is away from its null values; means over wheels.

        A complex step away from the null value counts as away.
        """
        texts = []
        for effect in self.spec.effects:
            if not effect.base:
                texts.append(f"acts_{effect.slug} = False")
                texts += (
                    f"acts_{effect.slug} |= parameters[{place}] != {parameter.null!r}"
                    for place, (owner, _, parameter, _) in enumerate(self.spec.slots)
                    if owner is effect and parameter.null is not None
                )
        for effect, name, parameter, element in self.spec.slots:
            if parameter.per == "wheel" and element == 0:
                mean, start = f"mean_{effect.slug}_{name}", self.spec.places[effect.slug, name]
                texts.append(f"{mean} = zero\nfor wheel in range({self.spec.wheel_count}):")
                texts.append(f"    {mean} += parameters[{start} + wheel] / wheel_count")
        return _lines("\n".join(texts))

    def _call(self, effect: type[Effect], hook: str) -> ast.expr:
        """The call of an effect's formula; its arguments are found by their names."""
        found = []
        for name in inspect.signature(effect.hooks[hook]).parameters:
            if name in effect.parameters:
                found.append(self._parameter(effect, name))
            else:
                found.append(f"row[{INDEX[name]}]" if name in INDEX else name)
        return _expression(f"{effect.slug}__{hook}({', '.join(found)})")

    def _parameter(self, effect: type[Effect], name: str) -> str:
        start, parameter = self.spec.places[effect.slug, name], effect.parameters[name]
        if parameter.per == "wheel":
            return f"(parameters[{start} + wheel] - mean_{effect.slug}_{name})"
        if parameter.per == "surface":
            return (
                f"(parameters[{start} + int({_SURFACE})]"
                f" if 0.0 <= {_SURFACE} < {self.spec.surface_count}"
                f" else zero + {parameter.null!r})"
            )
        return f"parameters[{start}]"


class _Calls(ast.NodeTransformer):
    """One effect in the place of ``effect``."""

    def __init__(self, call: ast.expr, books: str | None) -> None:
        self.call = call
        self.books = books

    def visit_Call(self, node: ast.Call) -> Any:
        """``effect(locals())``."""
        if ast.unparse(node) == "effect(locals())":
            return copy.deepcopy(self.call)
        return self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> Any:
        """``effect.takes(watts)``."""
        call = node.value
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "effect.takes":
            watts = ast.unparse(call.args[0])
            return _lines(f"watts_{self.books} += {watts}") if self.books else []
        return self.generic_visit(node)


class _Columns(ast.NodeTransformer):
    """Numbers instead of the names of columns and constants; conditions on numbers decided."""

    def visit_Name(self, node: ast.Name) -> Any:
        """``REST_SPEED``."""
        if node.id in _MARKERS:
            raise _refusal(node, "a marker cannot stand here (see stages.Hooks)")
        value = vars(stages).get(node.id)
        return ast.Constant(value) if isinstance(value, int | float) else node

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        """``Body.MASS``."""
        columns = vars(stages).get(node.value.id) if isinstance(node.value, ast.Name) else None
        if not isinstance(columns, type) or not issubclass(columns, IntEnum):
            return self.generic_visit(node)
        if node.attr not in columns.__members__:
            raise _refusal(node, f"no such column; there are {', '.join(columns.__members__)}")
        return ast.Constant(columns[node.attr].value)

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """``INDEX["vx"]``."""
        if not isinstance(node.value, ast.Name) or node.value.id != "INDEX":
            return self.generic_visit(node)
        name = ast.literal_eval(node.slice)
        if name not in INDEX:
            raise _refusal(node, f"no such quantity; there are {', '.join(INDEX)}")
        return ast.Constant(INDEX[name])

    def visit_Compare(self, node: ast.Compare) -> Any:
        """``"A" == "B"``."""
        self.generic_visit(node)
        left, right = node.left, node.comparators[0]
        if isinstance(left, ast.Constant) and isinstance(right, ast.Constant):
            return ast.Constant(left.value == right.value)
        return node


class _NoCirculation(ast.NodeTransformer):
    """Wheels that do not fight: one side of the mode, with the whole share."""

    def visit_For(self, node: ast.For) -> Any:
        """The loop over the sides of the mode."""
        self.generic_visit(node)
        return node.body if ast.unparse(node.iter) == "range(sides_of_mode)" else node

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        """``share * x`` and ``x + leading * circulation * ...``."""
        if isinstance(node.op, ast.Add) and "circulation" in ast.unparse(node.right):
            return self.visit(node.left)
        if isinstance(node.op, ast.Mult) and ast.unparse(node.left) == "share":
            return self.visit(node.right)
        return self.generic_visit(node)


def _for_each_side(
    stages_of_side: list[ast.stmt], watts: str, limits: list[str], spec: KernelSpec
) -> list[ast.stmt]:
    """The stages for each side of an unknown offset: mean of the watts, worst of the limits.

    Args:
        stages_of_side: all that follows ``centre_x, centre_y = hooks.side(zero)``.
        watts: name of the power.
        limits: names of the limits to return.
        spec: what the kernel is made for.
    """
    balanced = spec.output == "account"
    begin = _lines("\n".join(f"watts_{slug} = zero" for slug in BASE_EFFECTS if balanced))
    if not spec.having("centre_spread"):
        begin = _lines("centre_x = zero\ncentre_y = zero") + begin
        return [*begin, *stages_of_side, *_return([watts, *limits])]
    # What is kept of every side beside the watts, and where the stages leave it. Sums stand in
    # variables of their own: an array would take longer to compile than the rest.
    left = dict(LIMITS) if limits else {}
    if balanced:
        names = (*ACCOUNT[1:], *(f"watts_{slug}" for slug in BASE_EFFECTS))
        left = {name: f"account[{column}]" for column, name in enumerate(names, start=1)}
    first, after = [], []
    for name, here in left.items():
        kept = f"kept_{name}"
        if name in LIMITS:
            worse = "smaller" if name in _WORST_IS_LEAST else "larger"
            first.append(f"{kept} = {here} + zero")
            after.append(f"{kept} = {worse}({kept}, {here})")
        else:
            first.append(f"{kept} = zero")
            after.append(f"{kept} = {kept} + {here} * share_of_side")
    body = _expanded(_lines(_SPREAD), spec)
    body += _lines("\n".join(f"kept_{name} = zero" for name in left))
    [loop] = _lines(_EACH_SIDE)
    assert isinstance(loop, ast.For)
    loop.body += begin + stages_of_side + _lines(f"mean_watts += share_of_side * {watts}")
    if balanced:
        loop.body += _lines(f"if sides == 1:\n    return {watts}")
    if first:
        loop.body += _lines("if side == 0:\n    " + "\n    ".join(first))
        loop.body += _lines("\n".join(after))
    body.append(loop)
    if balanced:
        results = (f"{here} = kept_{name}" for name, here in left.items())
        body += _lines("\n".join(["account[0] = mean_watts", *results]))
    return [*body, *_return(["mean_watts", *(f"kept_{n}" for n in LIMITS if limits)])]


_SPREAD = """
sides = 1
mean_watts = zero
spread_x, spread_y = hooks.combine("centre_spread", locals(), spread_x=zero, spread_y=zero)
if spread_x != 0.0 or spread_y != 0.0:
    sides = 4
share_of_side = 1.0 / sides
"""
_EACH_SIDE = """
for side in range(sides):
    centre_x = spread_x if side < 2 else -spread_x
    centre_y = spread_y if side % 2 == 0 else -spread_y
"""


def _needed(body: list[ast.stmt], *, keep_arrays: bool) -> list[ast.stmt]:
    """The lines that some result depends on; a name stands for all values that it ever takes.

    Args:
        body: statements.
        keep_arrays: whether what is written to arrays is a result, besides what is returned.
    """
    lines = [*_reads_and_writes(body, set())]
    lines.reverse()  # most of what a line reads stands above it
    needed: set[str] = set()
    kept: set[ast.stmt] = set()
    grows = True
    while grows:
        before = len(kept)
        for line, reads, writes in lines:
            is_result = isinstance(line, ast.Return) or (
                keep_arrays and any("[" in n for n in writes)
            )
            if is_result or not needed.isdisjoint(writes):
                kept.add(line)
                needed |= reads
        grows = len(kept) > before
    return _only(body, kept)


def _reads_and_writes(
    body: list[ast.stmt], around: set[str]
) -> Iterator[tuple[ast.stmt, set[str], set[str]]]:
    """Every simple line, what it and the lines around it read, what it writes."""
    for line in body:
        if isinstance(line, ast.If | ast.For):
            head = line.test if isinstance(line, ast.If) else line.iter
            yield from _reads_and_writes(line.body, around | _places(head, ast.Load))
        else:
            yield line, around | _places(line, ast.Load), _places(line, ast.Store)


def _places(node: ast.AST, context: type[ast.expr_context]) -> set[str]:
    """Names and places in ``per_wheel`` and ``account`` that are read or written."""
    found = set()
    for part in ast.walk(node):
        if not isinstance(part, ast.Name | ast.Subscript) or not isinstance(part.ctx, context):
            continue
        if isinstance(part, ast.Name):
            found.add(part.id)
        elif isinstance(part.value, ast.Name) and part.value.id in ("per_wheel", "account"):
            found.add(ast.unparse(part))
    return found


def _only(body: list[ast.stmt], kept: set[ast.stmt]) -> list[ast.stmt]:
    found: list[ast.stmt] = []
    for line in body:
        if isinstance(line, ast.If | ast.For):
            line.body = _only(line.body, kept)
            found += [line] if line.body else []
        elif line in kept:
            found.append(line)
    return found
