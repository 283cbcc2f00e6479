"""How a power model becomes text: numbering of parameters, calls of hooks, head of the module.

``KernelWriter`` knows nothing of the physics; planner.power.pipeline writes the stages with it.

    slots       parameters of all effects one behind the other, the order of the catalogue
    a hook      njit-compiled formula of an effect, named ``<slug>__<hook>`` in the module
    an account  what the compiled function writes beside its result, the columns below
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Sequence

from planner.power.effect import HOOKS, Effect, Parameter
from planner.quantities import INDEX

BODY = ("mass", "centre_height", "wheel_radius", "gear_ratio", "traction")
PER_WHEEL = (
    *("load", "wheel_speed", "roller_speed", "axis_force", "wheel_torque", "motor_torque"),
    *("current", "voltage", "motor_watts"),
)
ACCOUNT = (
    # W; parts of the balance
    *("supply", "bus", "terminal", "shaft", "copper", "driver", "electronics"),
    # limits: N, A, V, N·m, share of the traction limit that is left
    *("least_load", "current", "voltage", "motor_torque", "traction_left"),
)
_LOW, _HIGH = ("least_load", "traction_left"), ("current", "voltage", "motor_torque")
BASE_EFFECTS = (
    *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
    *("copper_loss", "coulomb_drag"),
)
FORMULA_FUNCTIONS = (
    *("bell", "cosine", "exponential", "positive", "real_power", "root", "saturating", "sine"),
    "whole_power",
)
"""Functions of planner.power.kernel_math that the formulas of custom effects call besides."""
ACCOUNT_LENGTH = len(ACCOUNT) + len(BASE_EFFECTS)
"""Behind the named columns follow the watts of the base effects, each by its own balance."""


def parameter_slots(
    effects: Sequence[type[Effect]], *, wheel_count: int, surface_count: int
) -> list[tuple[type[Effect], str, Parameter, int]]:
    """One entry for every number in the parameter array: effect, name, declaration, element.

    The element counts the wheels or surface labels of a parameter that has one value for each.
    """
    slots = []
    for effect in effects:
        for name, parameter in effect.parameters.items():
            count = {None: 1, "wheel": wheel_count, "surface": surface_count}[parameter.per]
            slots += [(effect, name, parameter, element) for element in range(count)]
    return slots


class KernelWriter(ABC):
    """Lines of one generated module; a subclass writes the stages.

    Args:
        effects: active effects in the order of the catalogue.
        wheel_count: number of wheels of the layout.
        surface_count: number of surface labels that the model tells apart.
        number: "float64" or "complex128".
        printed: "A" or "B" for the source paper's motor power.
        lean: leave out balances and limits; only the result counts.
    """

    def __init__(
        self,
        effects: Sequence[type[Effect]],
        wheel_count: int,
        surface_count: int,
        number: str,
        printed: str | None,
        lean: bool = False,
    ) -> None:
        self.effects = effects
        self.wheel_count = wheel_count
        self.surface_count = surface_count
        self.number = number
        self.printed = printed
        self.lean = lean and not printed
        self.offset: dict[tuple[str, str], int] = {}
        self.slots = parameter_slots(effects, wheel_count=wheel_count, surface_count=surface_count)
        for place, (effect, name, _, element) in enumerate(self.slots):
            if element == 0:
                self.offset[effect.slug, name] = place
        self.lines: list[str] = []

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
            '"""Power model written out by planner.power.pipeline; not to be edited."""',
            "from numba import njit, types",
            "import numpy as np",
            "from planner.power.kernel_math import SLIDING_SPEED, absolute, larger, sign, smaller",
            "from planner.power.kernel_math import still",
            *(["from planner.power import printed"] if self.printed else []),
            *imports,
            "",
            f"SIGNATURE = {numeric}(types.Array(types.float64, 1, 'C'),"
            f" types.Array({numeric}, 1, 'C'), types.Array(types.float64, 1, 'C'),"
            f" types.Array(types.float64, 2, 'C'), types.Array({numeric}, 1, 'C'),"
            f" types.Array({numeric}, 2, 'C'))",
            "",
            "@njit(SIGNATURE, cache=True, error_model='numpy')",
            "def evaluate(row, parameters, body, wheels, account, per_wheel):",
        ]
        self._body()
        return "\n".join([*head, *("    " + line for line in self.lines), ""])

    def _body(self) -> None:
        self._inputs()
        spread = self._calls("centre_spread")
        if not spread:
            self.lines.append("centre_x = zero; centre_y = zero")
            self._stages()
            self.lines.append("return bus_watts")
            return
        outer, self.lines = self.lines, []
        self._stages()
        self.lines = outer + self._sides(spread, self.lines)

    @abstractmethod
    def _inputs(self) -> None:
        """Lines that do not depend on the centre of mass."""

    @abstractmethod
    def _stages(self) -> None:
        """Lines from the centre of mass to the source."""

    def _sides(self, spread: list[tuple[str, type[Effect]]], stages: list[str]) -> list[str]:
        """The stages for each side of an unknown offset: mean of the watts, worst of the limits."""
        # Sums stand in variables of their own: an array would take longer to compile than the rest.
        first, after = [], []
        count = 1 if self.lean else ACCOUNT_LENGTH
        for column in range(count):
            here, kept = f"account[{column}]", f"kept_{column}"
            name = ACCOUNT[column] if column < len(ACCOUNT) else ""
            worse = "smaller" if name in _LOW else "larger" if name in _HIGH else ""
            mean = f"{kept} + 0.25 * {here}"
            first.append(f"{kept} = zero" if not worse else f"{kept} = {here} + zero")
            after.append(f"{kept} = {worse}({kept}, {here})" if worse else f"{kept} = {mean}")
        return [
            "spread_x = zero; spread_y = zero",
            *(
                line
                for call, _ in spread
                for line in (f"dx, dy = {call}", "spread_x += dx; spread_y += dy")
            ),
            "sides = 1 if spread_x == 0.0 and spread_y == 0.0 else 4",
            *(f"kept_{column} = zero" for column in range(count)),
            "for side in range(sides):",
            "    centre_x = spread_x if side < 2 else -spread_x",
            "    centre_y = spread_y if side % 2 == 0 else -spread_y",
            *("    " + line for line in stages),
            "    if sides == 1:",
            "        return bus_watts",
            "    if side == 0:",
            *("        " + line for line in first),
            *("    " + line for line in after),
            *(f"account[{column}] = kept_{column}" for column in range(count)),
            "return kept_0",
        ]

    # How a hook is called and booked.

    def _book(self, effect: type[Effect], watts: str, indent: str = "") -> None:
        if effect.slug in BASE_EFFECTS and not self.lean:
            self.lines.append(f"{indent}watts_{effect.slug} += {watts}")

    def _calls(self, hook: str) -> list[tuple[str, type[Effect]]]:
        """Call of every effect's formula; one at its null values is skipped, which saves time."""
        width = len(HOOKS[hook].returns)
        neutral = "zero" if HOOKS[hook].combine == "add" else "1.0 + zero"
        nothing = neutral if width == 1 else f"({', '.join([neutral] * width)})"
        calls = []
        for effect in self.effects:
            if hook in effect.hooks:
                call = f"{effect.slug}__{hook}({', '.join(self._arguments(effect, hook))})"
                if not effect.base:
                    call = f"({call} if acts_{effect.slug} else {nothing})"
                calls.append((call, effect))
        return calls

    def _switches(self) -> list[str]:
        """Lines that say for each effect beside the base whether it is away from its null values.

        A complex step away from the null value counts as away.
        """
        lines = []
        for effect in self.effects:
            if effect.base:
                continue
            lines.append(f"acts_{effect.slug} = False")
            for place, (owner, _, parameter, _) in enumerate(self.slots):
                if owner is effect and parameter.null is not None:
                    lines.append(f"acts_{effect.slug} |= parameters[{place}] != {parameter.null!r}")
        return lines

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
