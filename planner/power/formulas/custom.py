"""Effects that users write as a formula, checked and compiled into the same kernel as all others.

    custom_effect("tow", "drag * abs(wind_x - vx) * vx", "W",
                  {"drag": {"unit": "kg/m", "bounds": (0, 50), "null": 0}})

The unit of the result says where the formula acts:

    "W"   power on the bus                                                 hook bus
    "N"   force against the travel, faded out at standstill:
          F·v / √(v² + (5 mm/s)²) along v                                  hook body_force
    "1"   factor 1 + formula, never below 0, on a named coefficient: "contact" (rolling and roller
          drag), "resistance" or "torque_constant"             hooks contact_factor, winding

Names in a formula are the quantities of planner.quantities (without ``surface``), ``speed`` in m/s,
``heading`` = atan2(vy, vx) in rad, and its parameters. A row in which a quantity that the formula
reads is not known is computed without the effect. At the null values of its parameters a formula
has to vanish, which is checked on rows all over the possible range. Grammar and safety are those of
formula.

Left out
    values of single wheels; formulas that read each other.
"""

from __future__ import annotations

import inspect
import json
import keyword
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from planner.errors import ModelError
from planner.power.catalogue import all_effects
from planner.power.effect import Effect, Parameter
from planner.power.formulas.custom_parameters import (
    IDENTIFIER,
    NAMES,
    QUANTITY_BY_NAME,
    check_values,
    read_parameters,
)
from planner.power.formulas.dimensions import UNITS
from planner.power.formulas.formula import Formula, check_formula
from planner.power.kernel_math import SLIDING_SPEED
from planner.quantities import QUANTITIES

COEFFICIENTS = ("contact", "resistance", "torque_constant")
_MAY_BE_UNKNOWN = frozenset(q.name for q in QUANTITIES if math.isnan(q.default))


def custom_effect(
    name: str,
    formula: str,
    unit: str,
    parameters: Mapping[str, Mapping[str, Any]],
    *,
    coefficient: str = "contact",
    title: str | None = None,
    doc: str = "",
) -> type[Effect]:
    """An effect made of a formula, to be used like any of the catalogue.

    Args:
        name: its slug: lower case letters, digits and _; not one of the catalogue's.
        formula: the expression, see formula.
        unit: "W", "N" or "1".
        parameters: name to {"unit", "bounds", "null", "default", "fitted", "doc", "grid",
            "spread"}; unit and bounds are needed, and a null value in at least one of them.
            Without default, a parameter starts at its null value, or amid its bounds where it
            only shapes.
        coefficient: what a factor acts on, one of COEFFICIENTS; for unit "1" only.
        title: a short name for tables; the slug when None.
        doc: what it stands for.

    Raises:
        ModelError: the definition cannot be used; says where.
    """
    needed = {"name": name, "formula": formula, "unit": unit, "parameters": parameters}
    further = {"coefficient": coefficient, "title": title, "doc": doc}
    return effect_from_definition({**needed, **further})


def effect_from_definition(definition: Any) -> type[Effect]:
    """The effect that ``definition`` of a custom effect describes; the same one for the same text.

    Raises:
        ModelError: as custom_effect.
    """
    accepted = "name, formula, unit, parameters and, if wanted, coefficient, title, doc"
    known = ("name", "formula", "unit", "parameters", "coefficient", "title", "doc")
    if not isinstance(definition, Mapping) or not {"name", "formula", "unit"} <= set(definition):
        raise ModelError("custom effect", "is incomplete", accepted=accepted)
    for key in definition:
        if key not in known:
            raise ModelError("custom effect", "no such key", value=key, accepted=accepted)
    try:
        text = json.dumps(dict(definition), default=_plain, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise ModelError(
            "custom effect", f"cannot be written as JSON: {error}", accepted=accepted
        ) from error
    return _from_text(text)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.floating | np.integer | np.bool_):
        return value.item()
    raise TypeError(f"{type(value).__name__} is not JSON")


@lru_cache(maxsize=256)  # small, and the same text must give the same class
def _from_text(text: str) -> type[Effect]:
    definition: dict[str, Any] = json.loads(text)
    slug = definition["name"]
    _check_slug(slug)
    field = f"custom effect {slug}"
    unit = definition["unit"]
    if unit not in ("W", "N", "1"):
        raise ModelError(
            f"{field}: unit", "no such place", value=unit, accepted='"W", "N" (force), "1" (factor)'
        )
    coefficient = definition.setdefault("coefficient", "contact")
    if coefficient not in COEFFICIENTS:
        raise ModelError(
            f"{field}: coefficient",
            "no such coefficient",
            value=coefficient,
            accepted=", ".join(COEFFICIENTS),
        )
    for key in ("title", "doc"):
        if not isinstance(definition.get(key), str | None) or len(definition.get(key) or "") > 300:
            raise ModelError(
                f"{field}: {key}", "not a short text", accepted="at most 300 characters"
            )
    parameters, dimensions = read_parameters(definition.get("parameters"), field)
    formula = check_formula(
        definition["formula"], NAMES | dimensions, UNITS[unit], field=f"{field}: formula"
    )
    for name in parameters:
        if name not in formula.names:
            raise ModelError(
                f"{field}: {name}", "is declared and not in the formula", accepted="used parameters"
            )
    check_values(formula, parameters, field)
    hook = {"W": "bus", "N": "body_force"}.get(
        unit, "contact_factor" if coefficient == "contact" else "winding"
    )
    arguments = [n for n in formula.names if n in QUANTITY_BY_NAME]
    for velocity in ("vx", "vy"):
        if velocity not in arguments and (unit == "N" or {"speed", "heading"} & {*formula.names}):
            arguments.append(velocity)
    arguments += list(parameters)
    namespace: dict[str, Any] = {
        "__doc__": definition.get("doc") or f"Custom effect: {formula.text} in {unit}.",
        "__module__": __name__,
        "slug": slug,
        "title": definition.get("title") or slug,
        "definition": definition,
        "kernel_text": {
            hook: _kernel_function(formula, parameters, arguments, slug, hook, unit, coefficient)
        },
        "summary": classmethod(lambda cls: str(cls.__doc__)),
        hook: staticmethod(_hook_with(arguments)),
        **parameters,
    }
    return type(f"Custom_{slug}", (Effect,), namespace)


def _check_slug(slug: Any) -> None:
    if not isinstance(slug, str) or not IDENTIFIER.fullmatch(slug) or keyword.iskeyword(slug):
        raise ModelError(
            "custom effect: name",
            "not a name",
            value=slug,
            accepted="a lower case letter, then up to 39 lower case letters, digits and _",
        )
    if slug in all_effects():
        raise ModelError(
            "custom effect: name",
            "the catalogue has an effect of this name",
            value=slug,
            accepted="another name",
        )


def _kernel_function(
    formula: Formula,
    parameters: Mapping[str, Parameter],
    arguments: list[str],
    slug: str,
    hook: str,
    unit: str,
    coefficient: str,
) -> str:
    """Lines of the kernel's module that define the hook; every name in them is made here."""
    written = {n: f"{'p' if n in parameters else 'q'}_{n}" for n in arguments}
    zero = f"0.0 * ({' + '.join(written[n] for n in parameters)})"
    lines = [
        f"# formula {formula.sha256}",
        "@njit",
        f"def {slug}__{hook}({', '.join(written[n] for n in arguments)}):",
    ]
    if {"speed", "heading"} & {*formula.names}:
        lines.append("    q_speed = np.sqrt(q_vx * q_vx + q_vy * q_vy)")
        lines.append("    q_heading = np.arctan2(q_vy, q_vx)")
        written |= {"speed": "q_speed", "heading": "q_heading"}
    lines.append(f"    value = {zero} + {formula.kernel_expression(written)}")
    unsure = [written[n] for n in arguments if n in _MAY_BE_UNKNOWN or n.startswith("wind_")]
    if unsure:
        lines.append(f"    if {' or '.join(f'{n} != {n}' for n in unsure)}:")
        lines.append(f"        value = {zero}")
    if unit == "W":
        lines.append("    return value")
    elif unit == "N":
        lines.append(
            f"    share = value / np.sqrt(q_vx * q_vx + q_vy * q_vy + {SLIDING_SPEED**2!r})"
        )
        lines.append("    return share * q_vx, share * q_vy, 0.0 * share")
    else:
        lines.append("    factor = larger(1.0 + value, 0.0)")
        one = "1.0 + 0.0 * factor"
        returned = {"contact": "factor", "resistance": f"factor, {one}"}
        lines.append(f"    return {returned.get(coefficient, f'{one}, factor')}")
    return "\n".join(lines)


def _hook_with(arguments: list[str]) -> Callable[..., Any]:
    """A hook with the signature that the pipeline reads; its text in the kernel computes."""

    def hook(*_: Any) -> Any:
        raise TypeError("a custom effect is computed by its kernel: call PowerModel.watts")

    hook.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(n, inspect.Parameter.POSITIONAL_OR_KEYWORD) for n in arguments]
    )
    return hook
