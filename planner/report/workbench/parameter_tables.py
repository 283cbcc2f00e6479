"""Tables of parameters: fitted ones with their uncertainty, and all that a model has."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from planner.amounts import number
from planner.power.model import PowerModel
from planner.report.markup import Markup, section, table
from planner.telemetry.estimation import FittedParameter


def parameters(
    fitted: Sequence[FittedParameter], model: PowerModel, before: PowerModel | None
) -> Markup:
    """Fitted parameters with their uncertainty, and what they were without the new effects."""
    slots = {(e.slug, name, k): (p, place) for place, (e, name, p, k) in enumerate(model.slots)}
    old = {} if before is None else _values(before)
    several = Counter((p.effect, p.name) for p in fitted)
    rows, new = [], []
    for k, p in enumerate(fitted):
        if old and (p.effect, p.name, p.element) not in old:
            new.append(k)
        declared, _ = slots[p.effect, p.name, p.element]
        element = _element(declared.per, p.element, model) if several[p.effect, p.name] > 1 else ""
        unit = "" if p.unit == "1" else p.unit
        notes = " ".join(filter(None, [declared.doc, f"{p.note.capitalize()}." if p.note else ""]))
        row = [
            f"{p.effect}.{p.name}{element}",
            number(p.value, p.stderr),
            "" if not math.isfinite(p.stderr) else f"{p.stderr:.2g}",
            unit,
            number(old.get((p.effect, p.name, p.element))),
            notes,
        ]
        rows.append(row)
    heads = ["parameter", "value", "± (standard error)", "unit", "without what is new", "meaning"]
    wordy = (0, 3, 5)
    if not old:
        rows = [[*row[:4], row[5]] for row in rows]
        heads, wordy = [*heads[:4], heads[5]], (0, 3, 4)
    return section("Parameters", table("", heads, rows, words=wordy, strong=new) if rows else "")


def known_parameters(model: PowerModel) -> Markup:
    """All parameters of a model."""
    errors = [math.nan] * len(model.parameters) if model.stderr is None else model.stderr.tolist()
    several = Counter((effect.slug, name) for effect, name, _, _ in model.slots)
    rows = []
    for (effect, name, declared, k), value, error in zip(
        model.slots, model.parameters.tolist(), errors, strict=True
    ):
        element = _element(declared.per, k, model) if several[effect.slug, name] > 1 else ""
        rows.append(
            [
                f"{effect.slug}.{name}{element}",
                number(value, error),
                f"{error:.2g}" if math.isfinite(error) else "",
                "" if declared.unit == "1" else declared.unit,
                declared.doc,
            ]
        )
    heads = ["parameter", "value", "± (standard error)", "unit", "meaning"]
    return section("Parameters", table("", heads, rows, words=(0, 3, 4)))


def _values(model: PowerModel) -> dict[tuple[str, str, int], float]:
    return {
        (e.slug, name, k): float(v)
        for (e, name, _, k), v in zip(model.slots, model.parameters, strict=True)
    }


def _element(per: str | None, element: int, model: PowerModel) -> str:
    if per == "surface" and element < len(model.surfaces):
        return f" on {model.surfaces[element]}"
    return f" of wheel {element + 1}" if per == "wheel" else f" {element + 1}"
