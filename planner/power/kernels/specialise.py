"""The stages for one set of effects: markers expanded, idle lines dropped.

    specialise(function, spec)      # statements of a function body that numba compiles

``function`` is the tree of ``stages.power``. A marker becomes the calls of the
active effects' formulas, named ``<slug>__<hook>``. An effect at its null values is skipped, which
saves time. Names of columns become their numbers. What no result depends on is dropped: the power
alone books no balance and looks at no limits. The order of operations is that of the stages.

Parameters of all effects stand one behind the other in the array ``parameters``.
"""

from __future__ import annotations

import ast
import copy
import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from planner.code_cache import parsed
from planner.power.account import ACCOUNT, BASE_EFFECTS, LIMITS, Output
from planner.power.effect import HOOKS, Effect, Parameter, parameter_slots
from planner.power.kernels import stages
from planner.power.kernels.idle_lines import needed_lines
from planner.quantities import INDEX

_WORST_IS_LEAST = ("least_load", "traction_left")
_MARKERS = ("hooks", "effect", "locals")
_SURFACE = f"row[{INDEX['surface']}]"


@dataclass(frozen=True)
class KernelSpec:
    """What a kernel is made for.

    Attributes:
        effects: active effects in the order of the catalogue.
        wheel_count: number of wheels of the layout; 0 where no parameter has a value for each.
        surface_count: number of surface labels that the model tells apart, at least 1; 0 where no
            parameter has a value for each.
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
    place = next((k for k, line in enumerate(lines) if _marker(line) == "side"), len(lines))
    before, after = (_expanded(part, spec) for part in (lines[:place], lines[place + 1 :]))
    limits = list(LIMITS.values()) if spec.output == "limits" else []
    body = before + _for_each_side(after, last.value.id, limits, spec)
    return needed_lines(body, keep_arrays=spec.output == "account")


def _refusal(node: ast.AST, problem: str) -> ValueError:
    where = f"{stages.__name__}, line {getattr(node, 'lineno', 0)}"
    return ValueError(f"{where}: {ast.unparse(node)}: {problem}")


def _lines(texts: Iterable[str]) -> list[ast.stmt]:
    found: list[ast.stmt] = parsed("\n".join(texts)).body
    return found


def _expression(text: str) -> ast.expr:
    found: ast.expr = parsed(text, mode="eval").body
    return found


def _marker(node: ast.AST) -> str | None:
    """Name of a statement's or expression's marker, behind the dot; "" for a loop's."""
    if isinstance(node, ast.Assign | ast.Expr):
        return _marker(node.value)
    if isinstance(node, ast.Call):
        return "" if ast.unparse(node.func) == "hooks" else _marker(node.func)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return node.attr if node.value.id in ("hooks", "effect") else None
    return None


def _visited(step: ast.NodeTransformer, lines: Iterable[ast.stmt]) -> list[ast.stmt]:
    body: Any = step.generic_visit(ast.Module(list(lines), []))
    found: list[ast.stmt] = body.body
    return found


def _expanded(lines: Iterable[ast.stmt], spec: KernelSpec) -> list[ast.stmt]:
    found = _visited(_Columns(), _visited(_Markers(spec), lines))
    return found if spec.having("circulation") else _visited(_NoCirculation(), found)


class _Markers(ast.NodeTransformer):
    """Calls of the active effects instead of markers."""

    def __init__(self, spec: KernelSpec) -> None:
        self.spec = spec
        self.balanced = spec.output == "account"
        self.acting: tuple[type[Effect], str] | None = None  # effect and hook of the open loop

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
            self.acting = effect, hook
            found += self._where_it_acts(effect, _visited(self, copy.deepcopy(node.body)))
        self.acting = None
        return found

    def visit_Assign(self, node: ast.Assign) -> Any:
        """``x = hooks.combine("bus", locals(), x=start)`` and ``zero = hooks.zero``."""
        marker = _marker(node)
        if marker == "combine":
            return self._combined(node)
        self.generic_visit(node)
        return [node, *self._switches()] if marker == "zero" else node

    def visit_Expr(self, node: ast.Expr) -> Any:
        """``hooks.book(gravity=x)``, ``hooks.balance(account)``, ``effect.takes(x)``."""
        marker, call = _marker(node), node.value
        texts: Iterable[str]
        if marker == "book" and isinstance(call, ast.Call):
            texts = (f"watts_{word.arg} = {ast.unparse(word.value)}" for word in call.keywords)
        elif marker == "balance":
            columns = enumerate(BASE_EFFECTS, start=len(ACCOUNT))
            texts = (f"account[{column}] = watts_{slug}" for column, slug in columns)
        elif marker == "takes" and self.acting and isinstance(call, ast.Call):
            slug = self.acting[0].slug
            texts = [f"watts_{slug} += {ast.unparse(call.args[0])}"] * (slug in BASE_EFFECTS)
        else:
            return self.generic_visit(node)
        return _lines(texts) if self.balanced else []

    def visit_If(self, node: ast.If) -> Any:
        """``if hooks.printed:``."""
        if _marker(node.test) != "printed":
            return self.generic_visit(node)
        return _visited(self, node.body) if self.spec.printed else []

    def visit_Call(self, node: ast.Call) -> Any:
        """``effect(locals())``, ``hooks.act("slip")``, ``hooks.parameter("gear_loss", "x")``."""
        marker = _marker(node)
        if self.acting and ast.unparse(node) == "effect(locals())":
            return self._call(*self.acting)
        if marker == "act":
            acts = [f"acts_{effect.slug}" for effect in self._hook(node)[1]]
            return _expression(" or ".join(acts) or "False")
        if marker == "parameter":
            slug, name = (ast.literal_eval(argument) for argument in node.args)
            return _expression(f"parameters[{self.spec.places[slug, name]}]")
        return self.generic_visit(node)

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        """``hooks.zero`` and ``hooks.reading_b``."""
        zero = 0j if self.spec.number == "complex128" else 0.0
        values = {"zero": zero, "reading_b": self.spec.printed == "B"}
        marker = _marker(node)
        return ast.Constant(values[marker]) if marker in values else self.generic_visit(node)

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
        starts = (f"{word.arg} = {ast.unparse(word.value)}" for word in node.value.keywords)
        body = _lines(start for start in starts if start not in [f"{n} = {n}" for n in names])
        parts = [f"part_of_{name}" for name in names]
        sign = {"add": "+=", "multiply": "*="}[HOOKS[hook].combine]
        adding = [f"{name} {sign} {part}" for name, part in zip(names, parts, strict=True)]
        for effect in having:
            call = ast.unparse(self._call(effect, hook))
            body += self._where_it_acts(effect, _lines([f"{', '.join(parts)} = {call}", *adding]))
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
        return _lines(texts)

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


class _Columns(ast.NodeTransformer):
    """Numbers instead of the names of columns and constants; conditions on numbers decided."""

    def visit_Name(self, node: ast.Name) -> Any:
        """``REST_SPEED``."""
        if node.id in _MARKERS:
            raise _refusal(node, "a marker cannot stand here (see stages)")
        value = vars(stages).get(node.id)
        return ast.Constant(value) if isinstance(value, int | float) else node

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        """``Body.MASS`` and ``table.RIM_VX``."""
        owner = vars(stages).get(ast.unparse(node.value))
        if owner is not None and not hasattr(owner, node.attr):
            raise _refusal(node, "no such column")
        value = getattr(owner, node.attr, None)
        return ast.Constant(int(value)) if isinstance(value, int) else self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """``INDEX["vx"]`` and ``w[column]``."""
        array = ast.unparse(node.value)
        self.generic_visit(node)
        if array == "w":
            return _expression(f"wheels[wheel, {ast.unparse(node.slice)}]")
        if array != "INDEX":
            return node
        name = ast.literal_eval(node.slice)
        if name not in INDEX:
            raise _refusal(node, f"no such quantity; there are {', '.join(INDEX)}")
        return ast.Constant(INDEX[name])

    def visit_Assign(self, node: ast.Assign) -> Any:
        """``w = wheels[wheel]``, which is left out, and ``a = b = c``, which are several lines."""
        if ast.unparse(node.targets[0]) == "w":
            return []
        self.generic_visit(node)
        return [ast.Assign([target], node.value, lineno=0) for target in node.targets]


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
    begin = _lines(f"watts_{slug} = zero" for slug in BASE_EFFECTS if balanced)
    if not spec.having("centre_spread"):
        begin += _lines(["centre_x = zero", "centre_y = zero"])
        return [*begin, *stages_of_side, *_lines([f"return {', '.join([watts, *limits])}"])]
    # What is kept of every side beside the watts, and where the stages leave it. Sums stand in
    # variables of their own: an array would take longer to compile than the rest.
    left = dict(LIMITS) if limits else {}
    if balanced:
        names = (*ACCOUNT[1:], *(f"watts_{slug}" for slug in BASE_EFFECTS))
        left = {name: f"account[{column}]" for column, name in enumerate(names, start=1)}
    body = _expanded(_lines([_SPREAD]), spec) + _lines(f"kept_{name} = zero" for name in left)
    [loop] = _lines([_EACH_SIDE])
    assert isinstance(loop, ast.For)
    ends = [f"mean_watts += share_of_side * {watts}"]
    if balanced:
        ends.append(f"if sides == 1:\n    return {watts}")
    if left:
        first = (f"\n    kept_{name} = {left[name]} + zero" for name in LIMITS)
        ends.append(f"if side == 0:{''.join(first)}")
    for name, here in left.items():
        if name in LIMITS:
            worse = "smaller" if name in _WORST_IS_LEAST else "larger"
            ends.append(f"kept_{name} = {worse}(kept_{name}, {here})")
        else:
            ends.append(f"kept_{name} = kept_{name} + {here} * share_of_side")
    loop.body += [*begin, *stages_of_side, *_lines(ends)]
    kept = [f"kept_{name}" for name in LIMITS if limits]
    results = [f"{here} = kept_{name}" for name, here in left.items() if balanced]
    results = ["account[0] = mean_watts", *results] if balanced else []
    return [*body, loop, *_lines([*results, f"return {', '.join(['mean_watts', *kept])}"])]


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
