"""How a power model becomes text: numbering of parameters, calls of hooks, head of the module.

``KernelWriter`` knows nothing of the physics; pipeline.py writes the stages with it.

    slots       parameters of all effects one behind the other, the order of the catalogue
    a hook      njit-compiled formula of an effect, named ``<slug>__<hook>`` in the module
    an account  what the compiled function writes beside its result, planner.power.account
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

from planner.power.account import ACCOUNT, BASE_EFFECTS, LIMITS, Output
from planner.power.effect import HOOKS, Effect, parameter_slots
from planner.power.kernels import printed as printed_module
from planner.power.kernels.row_blocks import BLOCK_ARGUMENTS, in_blocks
from planner.quantities import INDEX

_LOW = ("least_load", "traction_left")
FORMULA_FUNCTIONS = (
    *("bell", "cosine", "exponential", "positive", "real_power", "root", "saturating", "sine"),
    "whole_power",
)
"""Functions of planner.power.kernel_math that the formulas of custom effects call besides."""


class KernelWriter(ABC):
    """Lines of one generated module; a subclass writes the stages.

    Args:
        effects: active effects in the order of the catalogue.
        wheel_count: number of wheels of the layout.
        surface_count: number of surface labels that the model tells apart.
        number: "float64" or "complex128".
        printed: "A" or "B" for the source paper's motor power.
        output: what it writes.

    Attributes:
        limited: whether the lines look at limits.
        balanced: whether they book what every effect takes.
    """

    def __init__(
        self,
        effects: Sequence[type[Effect]],
        wheel_count: int,
        surface_count: int,
        number: str,
        printed: str | None,
        output: Output = "account",
    ) -> None:
        self.effects = effects
        self.wheel_count = wheel_count
        self.surface_count = surface_count
        self.number = number
        self.printed = printed
        self.limited = output != "power"
        self.balanced = output == "account"
        self.offset: dict[tuple[str, str], int] = {}
        self.slots = parameter_slots(effects, wheel_count=wheel_count, surface_count=surface_count)
        for place, (effect, name, _, element) in enumerate(self.slots):
            if element == 0:
                self.offset[effect.slug, name] = place
        self.lines: list[str] = []
        self.depth = 0

    def module(self) -> str:
        """Text of the whole module."""
        imports = []
        for effect in self.effects:
            if effect.definition is None:
                imports.append(f"from {effect.__module__} import {effect.__name__}")
                imports += [
                    f"{effect.slug}__{hook} = njit({effect.__name__}.{hook})"
                    for hook in effect.hooks
                ]
        if any(effect.definition is not None for effect in self.effects):
            imports.append(f"from planner.power.kernel_math import {', '.join(FORMULA_FUNCTIONS)}")
            for effect in self.effects:
                imports += effect.kernel_text.values()
        numeric = f"types.{self.number}"
        head = [
            f'"""Power model written out by {type(self).__module__}; not to be edited."""',
            "from numba import njit, types",
            "import numpy as np",
            "from planner.power.kernel_math import SLIDING_SPEED, absolute, larger, sign, smaller",
            "from planner.power.kernel_math import still",
            *([f"from {printed_module.__package__} import printed"] if self.printed else []),
            *imports,
            "",
        ]
        self._body()
        real = "types.Array(types.float64, {}, 'C')"
        array = f"types.Array({numeric}, {{}}, 'C')"
        if not self.balanced:
            kinds = [real.format(1), "types.int64", array.format(1), real.format(1)]
            kinds += [real.format(2), real.format(1)]
            signature, arguments = f"types.void({', '.join(kinds)})", BLOCK_ARGUMENTS
            body = in_blocks(self.lines, self.wheel_count)
        else:
            kinds = [real.format(1), array.format(1), real.format(1), real.format(2)]
            kinds += [array.format(1), array.format(2)]
            signature = f"{numeric}({', '.join(kinds)})"
            arguments = ("row", "parameters", "body", "wheels", "account", "per_wheel")
            body = self.lines
        head += [
            f"SIGNATURE = {signature}",
            "",
            "@njit(SIGNATURE, cache=True, error_model='numpy')",
            f"def evaluate({', '.join(arguments)}):",
        ]
        return "\n".join([*head, *("    " + line for line in body), ""])

    def put(self, *lines: str) -> None:
        """Writes lines at the depth of the loops and conditions that are open."""
        self.lines += ["    " * self.depth + line for line in lines]

    @contextmanager
    def inside(self, head: str) -> Iterator[None]:
        """What is put meanwhile stands under this line; an empty one opens nothing."""
        if head:
            self.put(head)
            self.depth += 1
        yield
        if head:
            self.depth -= 1

    def _body(self) -> None:
        self._inputs()
        if any("centre_spread" in effect.hooks for effect in self.effects):
            self._sides()
        else:
            self.put("centre_x = zero; centre_y = zero")
            self._stages()
            self._return("bus_watts", LIMITS.values())

    @abstractmethod
    def _inputs(self) -> None:
        """Lines that do not depend on the centre of mass."""

    @abstractmethod
    def _stages(self) -> None:
        """Lines from the centre of mass to the source."""

    def _sides(self) -> None:
        """The stages for each side of an unknown offset: mean of the watts, worst of the limits."""
        # Sums stand in variables of their own: an array would take longer to compile than the rest.
        first, after, kept_limits = [], [], []
        for name, here in self._of_sides().items():
            kept = f"kept_{name}"
            if name in LIMITS:
                worse = "smaller" if name in _LOW else "larger"
                kept_limits.append(kept)
                first.append(f"{kept} = {here} + zero")
                after.append(f"{kept} = {worse}({kept}, {here})")
            else:
                first.append(f"{kept} = zero")
                after.append(f"{kept} = {kept} + {here} * share_of_side")
        self.put("spread_x = zero; spread_y = zero; mean_watts = zero; sides = 1")
        self._each("centre_spread", "dx, dy = {call}", "spread_x += dx; spread_y += dy")
        with self.inside("if spread_x != 0.0 or spread_y != 0.0:"):
            self.put("sides = 4")
        self.put("share_of_side = 1.0 / sides")
        self.put(*(f"kept_{name} = zero" for name in self._of_sides()))
        with self.inside("for side in range(sides):"):
            self.put("centre_x = spread_x if side < 2 else -spread_x")
            self.put("centre_y = spread_y if side % 2 == 0 else -spread_y")
            self._stages()
            self.put("mean_watts += share_of_side * bus_watts")
            if self.balanced:
                with self.inside("if sides == 1:"):
                    self.put("return bus_watts")
            if first:
                with self.inside("if side == 0:"):
                    self.put(*first)
                self.put(*after)
        if self.balanced:
            self.put("account[0] = mean_watts")
            self.put(*(f"{here} = kept_{name}" for name, here in self._of_sides().items()))
        self._return("mean_watts", kept_limits)

    def _of_sides(self) -> dict[str, str]:
        """What is kept of every side beside the watts → where the stages leave it."""
        if not self.balanced:
            return dict(LIMITS) if self.limited else {}
        names = (*ACCOUNT[1:], *(f"watts_{slug}" for slug in BASE_EFFECTS))
        return {name: f"account[{column}]" for column, name in enumerate(names, start=1)}

    def _return(self, watts: str, limits: Iterable[str]) -> None:
        with_limits = self.limited and not self.balanced
        self.put(f"return {', '.join([watts, *limits]) if with_limits else watts}")

    # How a hook is called and booked.

    def _each(self, hook: str, *lines: str, book: str = "") -> None:
        """Lines for every effect that has the hook, ``{call}`` standing for its formula.

        An effect at its null values is skipped, which saves time.

        Args:
            hook: name.
            lines: what to do with the result.
            book: W, what a base effect's balance gets.
        """
        having = [effect for effect in self.effects if hook in effect.hooks]
        if HOOKS[hook].combine == "replace" and len(having) > 1:
            raise ValueError(f"{hook}: {' and '.join(e.slug for e in having)} both replace it")
        for effect in having:
            call = f"{effect.slug}__{hook}({', '.join(self._arguments(effect, hook))})"
            with self.inside("" if effect.base else f"if acts_{effect.slug}:"):
                self.put(*(line.format(call=call) for line in lines))
                if book and effect.slug in BASE_EFFECTS and self.balanced:
                    self.put(f"watts_{effect.slug} += {book}")

    def _switches(self) -> None:
        """Lines that say for each effect beside the base whether it is away from its null values.

        A complex step away from the null value counts as away.
        """
        for effect in self.effects:
            if effect.base:
                continue
            self.put(f"acts_{effect.slug} = False")
            for place, (owner, _, parameter, _) in enumerate(self.slots):
                if owner is effect and parameter.null is not None:
                    self.put(f"acts_{effect.slug} |= parameters[{place}] != {parameter.null!r}")

    def _arguments(self, effect: type[Effect], hook: str) -> list[str]:
        found = []
        for name in inspect.signature(effect.hooks[hook]).parameters:
            if name in effect.parameters:
                found.append(self._parameter(effect, name))
            elif name in INDEX:
                found.append(f"row[{INDEX[name]}]")
            else:
                assert name in HOOKS[hook].reads
                found.append(name)
        return found

    def _parameter(self, effect: type[Effect], name: str) -> str:
        start = self.offset[effect.slug, name]
        parameter = effect.parameters[name]
        if parameter.per == "wheel":
            return f"(parameters[{start} + i] - mean_{effect.slug}_{name})"
        if parameter.per == "surface":
            label = f"row[{INDEX['surface']}]"
            return (
                f"(parameters[{start} + int({label})] if 0.0 <= {label} < {self.surface_count}"
                f" else zero + {parameter.null!r})"
            )
        return f"parameters[{start}]"
