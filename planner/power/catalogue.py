"""All effects that are installed, found by looking into ``planner/power/effects``.

Order is that of the physics, by stage, then by name: the order in which an effect is switched on
when watts are shared out among effects (planner.power.model).
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import lru_cache

from planner.errors import ModelError
from planner.power import effects as effects_package
from planner.power.account import BASE_EFFECTS
from planner.power.effect import HOOKS, Effect


@lru_cache(maxsize=1)  # the package's own classes
def all_effects() -> dict[str, type[Effect]]:
    """Every effect by its slug, those of the base model first."""
    for module in pkgutil.iter_modules(effects_package.__path__):
        importlib.import_module(f"{effects_package.__name__}.{module.name}")
    stages = list(dict.fromkeys(hook.stage for hook in HOOKS.values()))
    found = sorted(
        # Custom effects and a price of time are classes as well, and belong to no catalogue.
        (e for e in Effect.__subclasses__() if e.__module__.startswith(effects_package.__name__)),
        key=lambda effect: (
            BASE_EFFECTS.index(effect.slug) if effect.base else len(BASE_EFFECTS),
            stages.index(effect.stages()[0]),
            effect.slug,
        ),
    )
    return {effect.slug: effect for effect in found}


def find_effect(slug: str) -> type[Effect]:
    """The effect of this slug.

    Raises:
        ModelError: there is none.
    """
    known = all_effects()
    if slug not in known:
        raise ModelError("effect", "no such effect", value=slug, accepted=", ".join(known))
    return known[slug]


def list_effects() -> list[dict[str, object]]:
    """Name, title, stages and parameters of every effect, ready for JSON."""
    return [
        {
            "name": effect.slug,
            "title": effect.title,
            "stages": list(effect.stages()),
            "base": effect.base,
            "summary": " ".join(effect.summary().split()),
            "parameters": {
                name: {
                    "unit": parameter.unit,
                    "default": parameter.default,
                    "null": parameter.null,
                    "bounds": list(parameter.bounds),
                    "per": parameter.per,
                    "doc": parameter.doc,
                }
                for name, parameter in effect.parameters.items()
            },
        }
        for effect in all_effects().values()
    ]
