"""All effects that are installed, found by looking into ``planner/power/effects``.

Order is that of the physics, by stage, then by name: the order in which an effect is switched on
when watts are shared out among effects (planner.power.model).
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import lru_cache
from types import ModuleType

from planner.errors import ModelError
from planner.power import effects as effects_package
from planner.power.account import BASE_EFFECTS
from planner.power.effect import HOOKS, Effect


@lru_cache(maxsize=1)  # the package's own classes
def all_effects() -> dict[str, type[Effect]]:
    """Every effect by its slug, those of the base model first.

    Raises:
        TypeError: a file does not declare one effect of its own name that a virtual robot can hide.
    """
    names = [module.name for module in pkgutil.iter_modules(effects_package.__path__)]
    modules = [importlib.import_module(f"{effects_package.__name__}.{name}") for name in names]
    stages = list(dict.fromkeys(hook.stage for hook in HOOKS.values()))
    found = sorted(
        map(_declared, names, modules),
        key=lambda effect: (
            BASE_EFFECTS.index(effect.slug) if effect.base else len(BASE_EFFECTS),
            stages.index(effect.stages()[0]),
            effect.slug,
        ),
    )
    return {effect.slug: effect for effect in found}


def _declared(name: str, module: ModuleType) -> type[Effect]:
    """The effect that a file declares, checked for what only effects of files need."""
    own = [e for e in Effect.__subclasses__() if e.__module__ == module.__name__]
    if [effect.slug for effect in own] != [name]:
        raise TypeError(f"{module.__file__}: needs one class of Effect with slug = {name!r}")
    effect = own[0]
    if not effect.hooks:
        raise TypeError(f"{effect.__name__}: no hook; there are {', '.join(HOOKS)}")
    if effect.base and effect.slug not in BASE_EFFECTS:
        raise TypeError(f"{effect.__name__}.base: only {', '.join(BASE_EFFECTS)} have it")
    strengths = [p for p in effect.parameters.values() if p.null is not None]
    if strengths and all(p.in_virtual_robot == p.null for p in strengths):
        raise TypeError(
            f"{effect.__name__}: every parameter's default is its null value; give one hidden_at"
        )
    return effect


def find_effect(slug: str) -> type[Effect]:
    """The effect of this slug.

    Raises:
        ModelError: there is none.
    """
    known = all_effects()
    if slug not in known:
        raise ModelError("effect", "no such effect", value=slug, accepted=", ".join(known))
    return known[slug]


def is_effect(given: object) -> bool:
    """Whether it is an effect itself, and not its name or anything else."""
    return isinstance(given, type) and issubclass(given, Effect)


_LISTED = ("unit", "default", "null", "bounds", "per", "doc")  # of a parameter


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
                name: {key: getattr(parameter, key) for key in _LISTED}
                for name, parameter in effect.parameters.items()
            },
        }
        for effect in all_effects().values()
    ]
