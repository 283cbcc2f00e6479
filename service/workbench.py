"""What the workbench's verbs are asked with, the same on the command line and in a worker.

    compare(log, starting_model(vehicle="minibalance", model=None))
    adopt(effects_to_adopt(["tow"], definition), log, …)

Imports of the planner stand inside the functions, so that this module costs nothing to load.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.errors import ModelError, RequestError

DIAGNOSED = "diagnosed"
"""In place of effects: everything that the diagnosis selects and proposes."""

MOST_DEFINITION = 65_536  # bytes of a custom effect's file
_DEFINITION = (
    "a JSON or TOML file with name, formula, unit and parameters of a custom effect, "
    "see docs/custom-effects.md"
)


def starting_model(vehicle: str | None, model: str | Path | None, *, prefix: str = "") -> Any:
    """What a verb starts from: a vehicle's name or TOML as it is, or a saved model, loaded.

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
            "is missing" if vehicle is None else f"is given beside {prefix}model",
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
        definition: of a custom effect, see planner.power.custom; its name is one of ``effects``,
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
                f"{DIAGNOSED!r} is given beside others",
                accepted=f"{DIAGNOSED!r} alone, or names of effects",
            )
        return DIAGNOSED
    if definition is None:
        if not named or not all(named):
            raise RequestError(
                "effects", "is empty", accepted=f"names of effects, or {DIAGNOSED!r}"
            )
        return named
    from planner.power.custom import effect_from_definition

    custom = effect_from_definition(definition)
    if named and custom.slug not in named:
        raise RequestError(
            "effects",
            "does not name the effect that the formula defines",
            value=",".join(named),
            accepted=f"{custom.slug}, alone or among others",
        )
    return [custom if name == custom.slug else name for name in named or [custom.slug]]


def read_definition(path: Path) -> Mapping[str, Any]:
    """The definition of a custom effect out of a JSON or TOML file.

    Raises:
        ModelError: the file cannot be read or holds no definition.
    """
    where = str(path)
    try:
        with path.open("rb") as file:
            content = file.read(MOST_DEFINITION + 1)
    except OSError as error:
        raise ModelError(where, f"cannot be read: {error.strerror}", accepted=_DEFINITION) from None
    if len(content) > MOST_DEFINITION:
        raise ModelError(where, f"is larger than {MOST_DEFINITION} bytes", accepted=_DEFINITION)
    toml = path.suffix.lower() == ".toml"
    try:
        text = content.decode("utf-8-sig")
        definition = tomllib.loads(text) if toml else json.loads(text)
    except (ValueError, RecursionError) as error:
        kind = "TOML" if toml else "JSON"
        raise ModelError(where, f"is not {kind}: {error}", accepted=_DEFINITION) from None
    if not isinstance(definition, Mapping):
        raise ModelError(where, "is no object", accepted=_DEFINITION)
    return definition


def save_model(model: Any, path: Path) -> None:
    """Write a model so that a reader sees all of it or none of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    model.save(unfinished)
    unfinished.replace(path)
