"""Arguments of the workbench's verbs, the same on the command line and in a worker.

    compare(log, starting_model(vehicle="minibalance", model=None))
    adopt(effects_to_adopt(["tow"], definition), log, …)

Imports of the planner stand inside the functions, so that this module costs nothing to load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.errors import RequestError

DIAGNOSED = "diagnosed"
"""Stands for all effects that the diagnosis selects and proposes."""


def starting_model(vehicle: str | None, model: str | Path | None, *, prefix: str = "") -> Any:
    """The initial model of a verb: a vehicle's name or TOML unchanged, or a loaded model.

    Args:
        vehicle: name of a vehicle, or its TOML.
        model: path of a saved model.
        prefix: before the names of the fields in an error, such as "--".

    Raises:
        RequestError: neither of them is given, or both.
        ModelError: the model's file cannot be used.
    """
    if (vehicle is None) == (model is None):
        raise RequestError(
            f"{prefix}vehicle",
            "is missing" if vehicle is None else f"is given together with {prefix}model",
            accepted=f"either {prefix}vehicle (a name or a TOML file; the base model is then "
            f"fitted to the log) or {prefix}model (a saved model)",
        )
    if model is None:
        return vehicle
    from planner.power.model import PowerModel

    return PowerModel.load(model)


def effects_to_adopt(
    effects: Sequence[str], definition: Mapping[str, Any] | None = None
) -> str | list[Any]:
    """The effects for ``adopt``: slugs, and a custom effect in the place of its name.

    Args:
        effects: slugs, names of proposals, or the one word "diagnosed".
        definition: of a custom effect, see planner.power.formulas; its name is one of ``effects``,
            which may be empty beside it.

    Raises:
        RequestError: no effect at all, or the definition's name is not among them.
        ModelError: the definition cannot be used.
    """
    named = list(dict.fromkeys(effects))
    if DIAGNOSED in named:
        if len(named) > 1 or definition is not None:
            raise RequestError(
                "effects",
                f"{DIAGNOSED!r} is given together with others",
                accepted=f"{DIAGNOSED!r} alone, or names of effects",
            )
        return DIAGNOSED
    if definition is None:
        if not named or not all(named):
            raise RequestError(
                "effects", "is empty", accepted=f"names of effects, or {DIAGNOSED!r}"
            )
        return named
    from planner.power.formulas import effect_from_definition

    custom = effect_from_definition(definition)
    if named and custom.slug not in named:
        raise RequestError(
            "effects",
            "does not name the effect that the formula defines",
            value=",".join(named),
            accepted=f"{custom.slug}, alone or among others",
        )
    return [custom if name == custom.slug else name for name in named or [custom.slug]]
