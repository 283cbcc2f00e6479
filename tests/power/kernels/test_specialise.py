"""The pass over the stages: what it makes of markers, and what it refuses."""

from __future__ import annotations

import ast

import pytest

from planner.power.account import Output
from planner.power.catalogue import all_effects
from planner.power.kernels.specialise import KernelSpec, specialise

BASE = tuple(effect for effect in all_effects().values() if effect.base)


def made(*lines: str, slugs: tuple[str, ...] = (), output: Output = "account") -> str:
    """Text of the specialised lines, for the base model and other effects."""
    text = "def power(row, hooks):\n" + "".join(f"    {line}\n" for line in lines)
    [function] = ast.parse(text).body
    assert isinstance(function, ast.FunctionDef)
    effects = BASE + tuple(all_effects()[slug] for slug in slugs)
    spec = KernelSpec(effects, 4, 1, "float64", output=output)
    return "\n".join(ast.unparse(line) for line in specialise(function, spec))


def test_a_loop_becomes_the_calls_of_the_effects_that_act() -> None:
    text = made(
        "zero = hooks.zero",
        "drag = zero",
        "for effect in hooks('wheel_drag'):",
        "    drag += 2.0 * effect(locals())",
        "return drag",
        slugs=("vibration",),
    )
    assert text.splitlines() == [
        "zero = 0.0",
        "drag = zero",
        "drag += 2.0 * wheel_rolling__wheel_drag(load, parameters[4])",
        "return drag",
    ]


def test_an_effect_beside_the_base_asks_for_its_switch() -> None:
    text = made(
        "zero = hooks.zero",
        "bus_watts = hooks.combine('supply', locals(), bus_watts=zero)",
        "return bus_watts",
        slugs=("regeneration_limit",),
    )
    assert "if acts_regeneration_limit:\n    part_of_bus_watts = regeneration_limit__su" in text


def test_only_an_account_books_what_effects_take() -> None:
    lines = (
        "zero = hooks.zero",
        "watts = zero",
        "centre_x, centre_y = hooks.side(zero)",
        "for effect in hooks('electronics'):",
        "    part = effect(locals())",
        "    watts += part",
        "    effect.takes(part)",
        "hooks.balance(account)",
        "return watts",
    )
    assert "account[12] = watts_electronics" in made(*lines)
    assert "watts_electronics" not in made(*lines, output="power")


def test_columns_become_numbers() -> None:
    text = made("watts = row[INDEX['wz']] * body[Body.GEAR_RATIO] * REST_SPEED", "return watts")
    assert text == "watts = row[2] * body[3] * 2.0\nreturn watts"


def test_idle_lines_are_dropped() -> None:
    text = made(
        "a = row[0]",
        "b = row[1]",
        "c = b",
        "for wheel in range(4):",
        "    c += 1.0",
        "for wheel in range(4):",
        "    a += 1.0",
        "return a",
    )
    assert text == "a = row[0]\nfor wheel in range(4):\n    a += 1.0\nreturn a"


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("for effect in hooks('body_forces'): x = effect(locals())", "no such hook.*body_force"),
        ("x = hooks.combine('buss', locals(), x=0.0)", "no such hook"),
        ("x = 2 if hooks.act('nothing') else 1", "no such hook"),
        ("for drag in hooks('wheel_drag'): x = drag(locals())", "names each 'effect'"),
        ("x = hooks.combine('bus', locals(), y=0.0)", "names that it is assigned to"),
        ("x = 1.0 + hooks.combine('bus', locals(), x=0.0)", "cannot stand here"),
        ("x = effect(locals())", "cannot stand here"),
        ("effect.takes(x)", "cannot stand here"),
        ("for effect in hooks('wheel_drag'): x = effect(x)", "cannot stand here"),
        ("for effect in hooks('wheel_drag'): x = effect.takes(x)", "cannot stand here"),
        ("x = hooks('bus')", "cannot stand here"),
        ("x = hooks.typo", "cannot stand here"),
        ("hooks.typo(x)", "cannot stand here"),
        ("if x: centre_x, centre_y = hooks.side(0.0)", "cannot stand here"),
        ("x = body[Body.WEIGHT]", "no such column"),
        ("x = row[INDEX['velocity']]", "no such quantity; there are vx"),
    ],
)
def test_a_wrong_marker_is_refused_with_its_line(line: str, problem: str) -> None:
    with pytest.raises(ValueError, match=f"line 3: .*{problem}"):
        made("x = 1.0", line, "return x")


def test_the_last_line_returns_the_power() -> None:
    with pytest.raises(ValueError, match="the last line must return the power"):
        made("x = 1.0")
