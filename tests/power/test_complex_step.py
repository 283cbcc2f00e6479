"""Formulas that a complex step cannot differentiate are refused, with what to use instead."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from planner.power import kernel_math
from planner.power.catalogue import all_effects
from planner.power.complex_step import REPLACEMENTS, check_differentiable
from planner.power.effect import REAL_INPUTS, Effect, Parameter
from planner.power.kernel_math import absolute, known, positive

REAL = ("speed", "wheel")
Formula = Callable[..., Any]


def largest(speed: Any, drag: Any) -> Any:
    return max(drag * speed, 0.0)


def least(speed: Any, drag: Any) -> Any:
    return min(drag * speed, 0.0)


def magnitude(speed: Any, drag: Any) -> Any:
    return abs(drag) * speed


def numpy_largest(speed: Any, drag: Any) -> Any:
    return np.maximum(drag, speed)


def numpy_least(speed: Any, drag: Any) -> Any:
    return np.minimum(drag, speed)


def numpy_magnitude(speed: Any, drag: Any) -> Any:
    return np.abs(drag * speed)


def numpy_sign(speed: Any, drag: Any) -> Any:
    return drag * np.sign(speed)


def chosen(speed: Any, drag: Any) -> Any:
    return np.where(speed > 0.0, drag, 0.0)


def math_root(speed: Any, drag: Any) -> Any:
    return math.sqrt(drag * speed)


def math_exponential(speed: Any, drag: Any) -> Any:
    return math.exp(-drag) * speed


def power(speed: Any, drag: Any) -> Any:
    return pow(speed, drag)


@pytest.mark.parametrize(
    ("formula", "instead"),
    [
        (largest, r"line \d+: .*max\(\); use kernel_math.larger\(x, y\), or positive\(x\)"),
        (least, r"min\(\); use kernel_math.smaller\(x, y\), or negative\(x\)"),
        (magnitude, r"abs\(\); use kernel_math.absolute\(x\)"),
        (numpy_largest, r"np.maximum\(\); use kernel_math.larger"),
        (numpy_least, r"np.minimum\(\); use kernel_math.smaller"),
        (numpy_magnitude, r"np.abs\(\); use kernel_math.absolute"),
        (numpy_sign, r"np.sign\(\); use kernel_math.sign\(x, width\)"),
        (chosen, r"np.where\(\); use kernel_math.positive"),
        (math_root, r"math.sqrt\(\); use kernel_math.root"),
        (math_exponential, r"math.exp\(\); use kernel_math.exponential"),
        (power, r"pow\(\); use kernel_math.power_of"),
    ],
)
def test_functions_that_drop_the_step_are_refused(formula: Formula, instead: str) -> None:
    with pytest.raises(TypeError, match=instead):
        check_differentiable(formula, REAL, "Wrong.hook")


def compared(speed: Any, drag: Any) -> Any:
    return drag if drag > 0.0 else 0.0


def compared_later(speed: Any, drag: Any) -> Any:
    force = drag * speed
    doubled = 2.0 * force
    if doubled < 1.0:
        force += 1.0
    return force


def condition(speed: Any, drag: Any) -> Any:
    return speed if drag else 0.0


def both(speed: Any, drag: Any) -> Any:
    return drag and speed


def denied(speed: Any, drag: Any) -> Any:
    return not drag


def real_part(speed: Any, drag: Any) -> Any:
    return drag.real * speed


def broken_power(speed: Any, drag: Any) -> Any:
    return drag**0.5 * speed


def power_of_a_parameter(speed: Any, drag: Any) -> Any:
    return speed**drag


def remainder(speed: Any, drag: Any) -> Any:
    return drag * speed % 1.0


def other_function(speed: Any, drag: Any) -> Any:
    return largest(speed, drag)


def rounded(speed: Any, drag: Any) -> Any:
    return round(drag * speed)


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        (compared, "'drag' may be complex and cannot be compared"),
        (compared_later, "'doubled' may be complex"),
        (condition, "'drag' is a number, not a condition"),
        (both, "'drag' is a number, not a condition"),
        (denied, "'drag' is a number, not a condition"),
        (real_part, r"\.real outside a comparison drops the derivative"),
        (broken_power, "power_of"),
        (power_of_a_parameter, "power_of"),
        (remainder, "no derivative"),
        (other_function, r"largest\(\) is not a function of planner.power.kernel_math"),
        (rounded, r"round\(\) is not a function of planner.power.kernel_math"),
    ],
)
def test_values_of_the_step_are_not_conditions(formula: Formula, words: str) -> None:
    with pytest.raises(TypeError, match=words):
        check_differentiable(formula, REAL, "Wrong.hook")


def branches(speed: Any, wheel: Any, drag: Any) -> Any:
    share = positive(drag * speed) if wheel == 0 else absolute(drag)
    if speed > 0.3 and known(drag):
        share = share + drag**2
    turned = (drag * speed).real >= 0.0
    return share if turned else -share


def test_real_inputs_and_real_parts_may_choose_a_branch() -> None:
    check_differentiable(branches, REAL, "Right.hook")


@pytest.mark.parametrize("effect", all_effects().values(), ids=all_effects())
def test_every_effect_of_the_catalogue_passes(effect: type[Effect]) -> None:
    for name, formula in effect.hooks.items():
        check_differentiable(formula, REAL_INPUTS, f"{effect.__name__}.{name}")


def test_replacements_exist() -> None:
    for instead in REPLACEMENTS.values():
        assert hasattr(kernel_math, instead.partition("(")[0])


def test_an_effect_is_refused_when_it_is_declared() -> None:
    with pytest.raises(TypeError, match=r"Blunt.bus, line \d+: .*positive\(x\) for max\(x, 0\)"):

        class Blunt(Effect):
            slug, title = "blunt", "blunt"
            watts = Parameter(unit="W", default=1.0, null=0.0, bounds=(0.0, 2.0), doc="Any.")

            @staticmethod
            def bus(speed, watts):  # type: ignore[no-untyped-def]
                return max(watts * speed, 0.0)


def test_inputs_called_real_stay_real_beside_complex_parameters() -> None:
    # What a formula may compare never depends on a parameter in the kernel.
    assert {"speed", "wheel", "rim_speed", "vx", "wind_x"} <= REAL_INPUTS
    assert not {"load", "axis_force", "wheel_torque", "current", "motor_speed"} & REAL_INPUTS
