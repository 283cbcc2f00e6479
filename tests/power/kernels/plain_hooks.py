"""The stages as plain Python: nothing generated, nothing compiled.

watts, account, per_wheel = plain_power(model, row)
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from planner.power.account import ACCOUNT, ACCOUNT_LENGTH, BASE_EFFECTS, LIMITS, PerWheel
from planner.power.effect import HOOKS, Effect
from planner.power.kernels import stages
from planner.power.model import PowerModel
from planner.quantities import INDEX
from tests.power.states import Array


@dataclass
class PlainEffect:
    """One effect at one hook."""

    hooks: PlainHooks
    effect: type[Effect]
    hook: str

    def __call__(self, seen: Mapping[str, Any]) -> Any:
        formula = self.effect.hooks[self.hook]
        return formula(*(self._argument(n, seen) for n in inspect.signature(formula).parameters))

    def takes(self, watts: Any) -> None:
        """Book watts."""
        if self.effect.slug in self.hooks.watts:
            self.hooks.watts[self.effect.slug] += watts

    def _argument(self, name: str, seen: Mapping[str, Any]) -> Any:
        if name in self.effect.parameters:
            return self._parameter(name, seen)
        return self.hooks.row[INDEX[name]] if name in INDEX else seen[name]

    def _parameter(self, name: str, seen: Mapping[str, Any]) -> Any:
        parameter, values = self.effect.parameters[name], self.hooks.values(self.effect, name)
        if parameter.per == "wheel":
            mean = 0.0
            for value in values:
                mean += value / len(values)
            return values[seen["wheel"]] - mean
        if parameter.per == "surface":
            label = int(self.hooks.row[INDEX["surface"]])
            return values[label] if 0 <= label < len(values) else parameter.null
        return values[0]


class PlainHooks:
    """Markers of ``stages.power`` for one row and one side of an unknown centre of mass."""

    zero = 0.0

    def __init__(self, model: PowerModel, row: Array, side: tuple[float, float]) -> None:
        self.model = model
        self.row = row
        self.printed = model.kind.partition("/")[2] or None
        self.reading_b = model.kind == "printed/B"
        self.centre = side
        self.watts: dict[str, Any] = dict.fromkeys(BASE_EFFECTS, 0.0)

    def values(self, effect: type[Effect], name: str) -> list[float]:
        """All elements of a parameter."""
        slots = zip(self.model.slots, self.model.parameters, strict=True)
        return [value for (owner, own, _, _), value in slots if (owner, own) == (effect, name)]

    def _acts(self, effect: type[Effect]) -> bool:
        return effect.base or any(
            parameter.null is not None and value != parameter.null
            for name, parameter in effect.parameters.items()
            for value in self.values(effect, name)
        )

    def __call__(self, hook: str) -> Iterator[PlainEffect]:
        for effect in self.model.effects:
            if hook in effect.hooks and self._acts(effect):
                yield PlainEffect(self, effect, hook)

    def combine(self, hook: str, seen: Mapping[str, Any], **start: Any) -> Any:
        """Start values, each effect's part added or multiplied."""
        for effect in self(hook):
            found = effect({**seen, **start})
            for name, part in zip(start, np.atleast_1d(found), strict=True):
                start[name] = (
                    start[name] + part if HOOKS[hook].combine == "add" else start[name] * part
                )
        return start.popitem()[1] if len(start) == 1 else tuple(start.values())

    def act(self, hook: str) -> bool:
        """Whether any effect acts at the hook."""
        return any(True for _ in self(hook))

    def side(self, zero: Any) -> tuple[float, float]:
        """The side that this run is for."""
        return self.centre

    def parameter(self, slug: str, name: str) -> Any:
        """First element of a parameter."""
        [effect] = (effect for effect in self.model.effects if effect.slug == slug)
        return self.values(effect, name)[0]

    def book(self, **watts: Any) -> None:
        """Replace watts."""
        self.watts |= watts

    def balance(self, account: Any) -> None:
        """Write watts."""
        account[len(ACCOUNT) :] = [self.watts[slug] for slug in BASE_EFFECTS]


# Compiled code calls the C library, whose last bits are not those of numpy's own functions.
@patch.multiple(np, exp=math.exp, log=math.log)
def plain_power(model: PowerModel, row: Array) -> tuple[float, Array, Array]:
    """W, account and per_wheel of one row; per_wheel shows the last side."""
    x, y = PlainHooks(model, row, (0.0, 0.0)).combine("centre_spread", {}, x=0.0, y=0.0)
    sides = [(x, y), (x, -y), (-x, y), (-x, -y)] if x != 0.0 or y != 0.0 else [(0.0, 0.0)]
    per_wheel = np.empty((len(model.wheels), len(PerWheel)))
    mean, kept = 0.0, np.zeros(ACCOUNT_LENGTH)
    for number, side in enumerate(sides):
        account = np.empty(ACCOUNT_LENGTH)
        hooks = PlainHooks(model, row, side)
        watts = stages.power(row, model.body, model.wheels, account, per_wheel, hooks)
        mean += watts / len(sides)
        for column in range(ACCOUNT_LENGTH):
            name = ACCOUNT[column] if column < len(ACCOUNT) else ""
            if name not in LIMITS:
                kept[column] += account[column] / len(sides)
            elif number == 0:
                kept[column] = account[column]
            else:
                worst = min if name in ("least_load", "traction_left") else max
                kept[column] = worst(kept[column], account[column])
    return mean, kept, per_wheel
