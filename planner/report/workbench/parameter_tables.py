"""Tables of parameters: fitted ones with their uncertainty, and all that a model has."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from planner.amounts import number
from planner.power.model import PowerModel
from planner.report.markup import Markup, section, table
from planner.telemetry.estimation import FittedParameter

_Place = tuple[str, str, int]
"""Of a parameter: slug of its effect, its name, the number of its element."""


def parameters(
    fitted: Sequence[FittedParameter], model: PowerModel, before: PowerModel | None
) -> Markup:
    """Fitted parameters with their uncertainty, and what they were without the new effects."""
    known = {(p.effect, p.name, p.element): (p.value, p.stderr) for p in fitted}
    notes = {
        place: f"{p.note.capitalize()}." for place, p in zip(known, fitted, strict=True) if p.note
    }
    rows = [
        [*row[:4], " ".join(filter(None, [row[4], notes.get(place)]))]
        for place, row in zip(known, _rows(known, model), strict=True)
    ]
    heads, words, new = [*_HEADS], [0, 3, 4], []
    if before is not None:
        old = dict(zip(_places(before), before.parameters.tolist(), strict=True))
        heads.insert(4, "without what is new")
        words = [0, 3, 5]
        new = [k for k, place in enumerate(known) if place not in old]
        for place, row in zip(known, rows, strict=True):
            row.insert(4, number(old.get(place)))
    return section("Parameters", table("", heads, rows, words=words, strong=new))


def known_parameters(model: PowerModel) -> Markup:
    """All parameters of a model."""
    values = model.parameters.tolist()
    errors = [math.nan] * len(values) if model.stderr is None else model.stderr.tolist()
    known = dict(zip(_places(model), zip(values, errors, strict=True), strict=True))
    return section("Parameters", table("", _HEADS, _rows(known, model), words=(0, 3, 4)))


_HEADS = ["parameter", "value", "± (standard error)", "unit", "meaning"]


def _rows(known: dict[_Place, tuple[float, float]], model: PowerModel) -> list[list[str]]:
    """Cells of every parameter, from its value and standard error."""
    declared = dict(zip(_places(model), (slot[2] for slot in model.slots), strict=True))
    several = Counter(place[:2] for place in known)
    rows = []
    for (effect, name, k), (value, error) in known.items():
        what = declared[effect, name, k]
        element = _element(what.per, k, model) if several[effect, name] > 1 else ""
        rows.append(
            [
                f"{effect}.{name}{element}",
                number(value, error),
                f"{error:.2g}" if math.isfinite(error) else "",
                "" if what.unit == "1" else what.unit,
                what.doc,
            ]
        )
    return rows


def _places(model: PowerModel) -> Iterable[_Place]:
    return ((effect.slug, name, k) for effect, name, _, k in model.slots)


def _element(per: str | None, element: int, model: PowerModel) -> str:
    if per == "surface" and element < len(model.surfaces):
        return f" on {model.surfaces[element]}"
    return f" of wheel {element + 1}" if per == "wheel" else f" {element + 1}"
