"""The kernel's text: it follows from the effects, and holds no more than was asked for."""

from __future__ import annotations

import ast
from dataclasses import replace

import pytest

from planner.power.catalogue import all_effects
from planner.power.effect import Effect, Parameter
from planner.power.kernels.pipeline import kernel_source
from planner.power.kernels.specialise import KernelSpec

BASE = [effect for effect in all_effects().values() if effect.base]


def text_of(effects: list[type[Effect]], **changes: object) -> str:
    spec = KernelSpec(tuple(effects), wheel_count=4, surface_count=1, number="float64")
    return kernel_source(replace(spec, **changes))  # type: ignore[arg-type]


def test_same_effects_same_text_other_effects_other_text() -> None:
    effects = list(all_effects().values())
    text = text_of(effects)
    assert text == text_of(effects)
    assert text != text_of(effects[:-1])
    assert text != text_of(effects, wheel_count=3)


def test_effects_are_called_at_their_stage() -> None:
    """Whatever the order in which they are given."""
    catalogue = all_effects()
    names = ("air_drag__body_force(", "wheel_slip__slip(", "battery_sag__supply(")
    slugs = ("air_drag", "wheel_slip", "battery_sag")
    for given in (slugs, slugs[::-1]):
        text = text_of([*BASE, *(catalogue[slug] for slug in given)])
        body = text[text.index("def evaluate(") :]
        places = [body.index(name) for name in names]
        assert places == sorted(places)


def test_the_papers_motors_are_imported_only_where_asked_for() -> None:
    assert "printed" not in text_of(BASE)
    assert "import printed\n" in text_of(BASE, printed="A")


def test_limits_are_looked_at_only_where_asked_for() -> None:
    for output, wanted in (("power", False), ("limits", True), ("account", True)):
        text = text_of(BASE, output=output)
        ast.parse(text)
        assert ("most_current" in text) == wanted


def test_one_effect_alone_replaces_a_value() -> None:
    class OtherGear(Effect):
        slug = "other_gear"
        title = "another gear"
        share = Parameter(unit="1", default=0.0, null=0.0, bounds=(0.0, 1.0), doc="of torque.")

        @staticmethod
        def gear(wheel_torque, share):  # type: ignore[no-untyped-def]
            return wheel_torque * share

    with pytest.raises(ValueError, match="gear_loss and other_gear both replace it"):
        text_of([*BASE, OtherGear])
