"""docs/effects.md says what the catalogue says."""

from __future__ import annotations

from docs.make_effects import PAGE, effects_page
from planner.power.catalogue import all_effects


def test_page_is_up_to_date() -> None:
    assert PAGE.read_text("utf-8") == effects_page(), "run python -m docs.make_effects"


def test_page_names_every_effect_and_parameter() -> None:
    text = PAGE.read_text("utf-8")
    for slug, effect in all_effects().items():
        assert f"\n## {slug}\n" in text
        for name in effect.parameters:
            assert f"| `{name}` |" in text
