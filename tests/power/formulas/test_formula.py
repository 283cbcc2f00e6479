"""Formulas: whatever is not one is refused, quickly and with its place; dimensions hold."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.effect import Effect
from planner.power.formulas.custom import custom_effect
from planner.power.formulas.custom_parameters import NAMES
from planner.power.formulas.dimensions import UNITS, parse_unit
from planner.power.formulas.formula import FUNCTIONS, check_formula

K = {"k": UNITS["W"]}
SCALE = {"k": {"unit": "W", "bounds": [-50, 50], "null": 0}}


def define(formula: Any, **changes: Any) -> type[Effect]:
    given: dict[str, Any] = {"name": "ripple", "unit": "W", "parameters": SCALE} | changes
    return custom_effect(formula=formula, **given)


HOSTILE = [
    "__import__('os').system('true')",
    "__import__",
    "().__class__",
    "().__class__.__bases__[0].__subclasses__()",
    "k.real",
    "k.__class__",
    "k[0]",
    "[k][0]",
    "{k}",
    "{'a': k}",
    "(k, k)",
    "k,",
    "9**9**9",
    "k*2**99999999",
    "k**k",
    "k*vx**-5",
    "k*2**(1+1)",
    "k*1e999",
    "k*1j",
    "k*True",
    "k*None",
    "k*...",
    "'k'",
    "k*'a'",
    "f'{k}'",
    "b'k'",
    "(k := 3)",
    "lambda: k",
    "k if k else k",
    "1if k else k",
    "1or k",
    "0x1for k",
    "k*1_0",
    "1.k",
    "k and k",
    "not k",
    "k < 3",
    "k == k",
    "[k for k in (1,)]",
    "sum(k for k in (1,))",
    "k @ k",
    "k // 2",
    "k % 2",
    "k << 2",
    "~k",
    "k; import os",
    "k\nimport os",
    "k # comment",
    "k \\\n",
    "import os",
    "yield k",
    "await k",
    "eval(k)",
    "exec(k)",
    "open(k)",
    "getattr(k, k)",
    "print",
    "globals()",
    "abs",
    "abs()",
    "abs(k, k)",
    "abs(*k)",
    "abs(k, x=1)",
    "abs(x=k)",
    "max(k)",
    "abs(k)(k)",
    "(abs)(k).x",
    "sqrt.__globals__",
    "np.sqrt(k)",
    "math.pi*k",
    "ｋ",  # full-width letter, which Python reads as k
    "𝓀*1",
    "k\u200b",
    "k\u202e",
    "k\x00",
    "é",
    "",
    "   ",
    "()",
    "k k",
    "k*",
    "((k)",
    "k)",
    "(" * 100 + "k" + ")" * 100,
    "-" * 450 + "k",
    "k" + "+k" * 240,
    "abs(" * 60 + "k" + ")" * 60,
    "k" * 100_000,
    "k*" + "9" * 400,
    "0x" + "f" * 300,
    "load*k",
    "mass*k",
    "surface*k",
    "p_k",
    "q_vx*k",
    "row*k",
    "parameters*k",
    "self",
    "vX*k",
    "k/0",
    None,
    3,
    ["k"],
]


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: repr(text)[:40])
def test_whatever_is_no_formula_is_refused(text: Any) -> None:
    with pytest.raises(ModelError, match=r"formula: .*; accepted: ") as caught:
        define(text)
    assert len(str(caught.value)) < 500
    # The message may quote a new line of the input, but only escaped.
    assert "\n" not in str(caught.value)


def test_refusals_say_where() -> None:
    with pytest.raises(ModelError, match=r"'drak' is neither .* at character 5"):
        check_formula("k * drak", K, UNITS["W"])
    with pytest.raises(ModelError, match=r"mixes m·s\^-1 and kg, at character 5"):
        check_formula("k *(vx + payload)", K | NAMES, UNITS["W"])


def test_no_probe_runs_longer_than_a_blink() -> None:
    for text in HOSTILE:
        begin = time.perf_counter()
        with pytest.raises(ModelError):
            check_formula(text, K | NAMES, UNITS["W"])
        assert time.perf_counter() - begin < 0.05


def test_a_check_takes_less_than_a_millisecond() -> None:
    text = "k*tanh(speed/c)*bump(heading,1,0.5)*(1+hinge(gravity_x)/gravity_normal)"
    names = K | NAMES | {"c": parse_unit("m/s")}
    check_formula(text, names, UNITS["W"])
    times = []
    for _ in range(50):
        begin = time.perf_counter()
        check_formula(text, names, UNITS["W"])
        times.append(time.perf_counter() - begin)
    assert float(np.median(times)) < 1e-3


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("payload*vx*ax", "W"),
        ("payload*gravity_x", "N"),
        ("vx**2/(gravity_normal*odometer)", "1"),
        ("sqrt(payload*payload)*gravity_normal*speed", "W"),
        ("(payload**0.5*gravity_normal**0.5)**2", "N"),
        ("max(payload*ax, 0)", "N"),
        ("sign(vx)*exp(-abs(wz)*time_since_start)", "1"),
        ("bump(speed, vx, vy)", "1"),
        ("(motor_temp-ambient_temp)/motor_temp", "1"),
        ("heading*2", "1"),
    ],
)
def test_dimensions_follow_physics(text: str, unit: str) -> None:
    assert check_formula(text, NAMES, UNITS[unit]).text == text
    other = "N" if unit == "W" else "W"
    with pytest.raises(ModelError, match=f"where {other} is needed"):
        check_formula(text, NAMES, UNITS[other])


@pytest.mark.parametrize(
    "text",
    [
        "vx+1",
        "vx+wz",
        "exp(vx)",
        "sin(payload)",
        "min(vx, ax)",
        "bump(vx, wz, vx)",
        "motor_temp-20",
    ],
)
def test_what_does_not_add_up(text: str) -> None:
    with pytest.raises(ModelError, match=r"mixes|pure number"):
        check_formula(text, NAMES, UNITS["1"])


def test_every_function_has_a_dimension_rule_a_value_and_a_kernel_name() -> None:
    for name, (least, *_) in FUNCTIONS.items():
        formula = check_formula(f"{name}({', '.join(['heading'] * least)})", NAMES, UNITS["1"])
        assert np.isfinite(formula.evaluate({"heading": np.array([0.3, -0.3])})).all()
        assert formula.kernel_expression({"heading": "h"}).count("h") >= least
