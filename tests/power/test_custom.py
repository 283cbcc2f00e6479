"""Custom effects: what is no formula is refused, dimensions hold, the kernel computes the same."""

from __future__ import annotations

import inspect
import json
import math
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.catalogue import all_effects
from planner.power.custom import custom_effect
from planner.power.custom_parameters import NAMES
from planner.power.dimensions import UNITS, format_dimension, parse_unit
from planner.power.effect import Effect
from planner.power.formula import FUNCTIONS, check_formula
from planner.power.model import PowerModel, rows_from
from planner.power.pipeline import kernel_source
from planner.power.vehicle import load_vehicle
from planner.quantities import INDEX
from tests.power.states import column, random_columns

K = {"k": UNITS["W"]}
SCALE = {"k": {"unit": "W", "bounds": [-50, 50], "null": 0}}


def define(formula: Any, **changes: Any) -> type[Effect]:
    given: dict[str, Any] = {"name": "ripple", "unit": "W", "parameters": SCALE} | changes
    return custom_effect(formula=formula, **given)


# The grammar.

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
    with pytest.raises(ModelError, match=r"puts m·s\^-1 and kg together, at character 5"):
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


# Dimensions.


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("W", (1, 2, -3, 0, 0)),
        ("N·s/m", (1, 0, -1, 0, 0)),
        ("W/(m/s)^2", (1, 0, -1, 0, 0)),
        ("m/s²", (0, 1, -2, 0, 0)),
        ("V·A", (1, 2, -3, 0, 0)),
        ("1/K", (0, 0, 0, 0, -1)),
        ("Ω*A^2", (1, 2, -3, 0, 0)),
        ("rad/s", (0, 0, -1, 0, 0)),
        ("1", (0, 0, 0, 0, 0)),
    ],
)
def test_units_are_products_of_base_units(unit: str, exponents: tuple[int, ...]) -> None:
    assert parse_unit(unit) == exponents


@pytest.mark.parametrize(
    "unit", ["", "kW", "m//s", "(m", "m)", "m^", "furlong", "m s", 3, "m" * 99]
)
def test_no_unit(unit: Any) -> None:
    with pytest.raises(ModelError, match="no unit"):
        parse_unit(unit)


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
    with pytest.raises(ModelError, match=r"together|pure number"):
        check_formula(text, NAMES, UNITS["1"])


def test_every_function_has_a_dimension_rule_a_value_and_a_kernel_name() -> None:
    for name, (least, _) in FUNCTIONS.items():
        formula = check_formula(f"{name}({', '.join(['heading'] * least)})", NAMES, UNITS["1"])
        assert np.isfinite(formula.evaluate({"heading": np.array([0.3, -0.3])})).all()
        assert formula.kernel_expression({"heading": "h"}).count("h") >= least


# What a definition has to say.


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"formula": "k + 1*vx*ax*payload"}, "does not vanish"),
        (
            {"formula": "k / (speed*1)", "parameters": {"k": SCALE["k"] | {"unit": "N·m^2/s^2"}}},
            "stand",
        ),
        ({"formula": "k*wz/wz"}, "no finite value"),
        ({"formula": "k*exp(exp(abs(heading)*99))"}, "no finite value"),
        ({"formula": "k - k"}, "always 0"),
        ({"unit": "J"}, "no such place"),
        ({"unit": "kW"}, "no such place"),
        ({"name": "air_drag"}, "catalogue"),
        ({"name": "Ripple"}, "no name"),
        ({"name": "a; import os"}, "no name"),
        ({"name": "lambda"}, "no name"),
        ({"name": "x" * 99}, "no name"),
        ({"name": 3}, "no name"),
        ({"parameters": {}}, "missing"),
        ({"parameters": {"k": {"unit": "W", "bounds": [0, 1]}}}, "null value"),
        ({"parameters": {"k": {"unit": "W", "null": 0}}}, "unit and bounds"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [1, 0]}}}, "no range"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [1, 2]}}}, "out of its bounds"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [0, math.inf]}}}, "JSON"),
        ({"parameters": {"k": SCALE["k"] | {"default": 99}}}, "out of its bounds"),
        ({"parameters": {"k": SCALE["k"] | {"code": 99}}}, "no such key"),
        ({"parameters": {"k": SCALE["k"] | {"unit": "blorp"}}}, "no unit"),
        ({"parameters": SCALE | {"vx": SCALE["k"]}}, "another meaning"),
        ({"parameters": SCALE | {"hooks": SCALE["k"]}}, "another meaning"),
        ({"parameters": SCALE | {"unused": SCALE["k"]}}, "not in the formula"),
        ({"coefficient": "gravity"}, "no such coefficient"),
        ({"doc": "x" * 999}, "no short text"),
    ],
)
def test_a_bad_definition_is_one_clear_sentence(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(ModelError, match=says):
        define(**({"formula": "k"} | changes))


def test_custom_effects_stay_out_of_the_catalogue() -> None:
    effect = define("k*bump(heading, 1, 0.3)", name="catalogued")
    all_effects.cache_clear()
    assert effect not in all_effects().values()


# The kernel.


def written(name: str, formula: str, unit: str, **parameters: Any) -> type[Effect]:
    kinds = {
        "w": {"unit": "W", "bounds": [-50, 50], "null": 0},
        "f": {"unit": "N", "bounds": [0, 50], "null": 0},
        "g": {"unit": "1", "bounds": [-1, 5], "null": 0},
        "c": {"unit": "m/s", "bounds": [0.1, 2], "default": 0.6},
        "h": {"unit": "1/K", "bounds": [0, 1], "default": 0.02},
    }
    used = {key: kinds[key] for key in parameters.pop("uses")}
    return custom_effect(name, formula, unit, used, **parameters)


EVERYTHING = (
    "w*(tanh(300*(vx-c)/c)/(1+h*motor_temp)**2 + (vy/c)**3 + bump(heading, 1, 0.5)"
    " + max(vy/c, -0.2, sin(heading)) + sqrt(speed/c) + hinge(-vx/c)**1.5 + exp(-speed/c)"
    " + sign(vy) + cos(heading) + min(1, speed/c) + abs(vx/c)**-0.0 - abs(vy)/c)"
)
BUS = written("everything", EVERYTHING, "W", uses="wch")
FORCE = written("slope_push", "f*(1+hinge(gravity_x)/gravity_normal)", "N", uses="f")
CONTACT = written("rubber", "g*bump(speed, c, c)", "1", uses="gc")
WARM = written(
    "warm_wire", "g*h*(motor_temp-ambient_temp)", "1", uses="gh", coefficient="resistance"
)
EFFECTS = (BUS, FORCE, CONTACT, WARM)
VALUES = {"w": 3.0, "f": 1.3, "g": 0.4, "c": 0.7, "h": 0.02}


@pytest.fixture(scope="module")
def plain() -> PowerModel:
    return PowerModel.from_vehicle(load_vehicle("minibalance"), effects=EFFECTS)


def at(model: PowerModel, *effects: type[Effect]) -> PowerModel:
    """The model with the given effects switched on, others at null."""
    values = [
        VALUES[name] if effect in effects else value
        for (effect, name, _, _), value in zip(model.slots, model.parameters, strict=True)
    ]
    return replace(model, parameters=np.array(values))


@pytest.fixture(scope="module")
def rows() -> Any:
    rows = rows_from(**random_columns(40, seed=8))
    rows[:, INDEX["ambient_temp"]] = 20.0
    return rows


def hook_of(effect: type[Effect], rows: Any) -> Any:
    (hook,) = effect.hooks.values()
    names = inspect.signature(hook).parameters
    return hook(*(column(rows, n) if n in INDEX else VALUES[n] for n in names))


def test_at_null_the_model_is_the_one_without(plain: PowerModel, rows: Any) -> None:
    without = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[])
    assert np.allclose(plain.watts(rows), without.watts(rows), rtol=1e-14, atol=0)


def test_watts_enter_the_bus_as_the_formula_says(plain: PowerModel, rows: Any) -> None:
    extra = at(plain, BUS).watts(rows) - plain.watts(rows)
    assert np.allclose(extra, hook_of(BUS, rows), rtol=1e-9, atol=1e-10)
    # By hand: vx = 0, vy = 0.35, everything else as written above.
    one = rows_from(vx=0.0, vy=0.35, motor_temp=50.0)
    wanted = 3.0 * (
        -1.0 / 2.0**2
        + 0.125
        + math.exp(-(((math.pi / 2 - 1) / 0.5) ** 2))
        + 1.0
        + math.sqrt(0.5)
        + math.exp(-0.5)
        + 0.35 / math.hypot(0.35, 0.005)
        + 0.5
        + 1.0
        - 0.5
    )
    extra = at(plain, BUS).watts(one) - plain.watts(one)
    assert extra[0] == pytest.approx(wanted, rel=1e-9)


def test_a_force_along_the_travel_costs_force_times_speed_at_the_wheels(
    plain: PowerModel, rows: Any
) -> None:
    shaft = at(plain, FORCE).account(rows)["shaft"] - plain.account(rows)["shaft"]
    speed = np.hypot(column(rows, "vx"), column(rows, "vy"))
    steep = np.maximum(column(rows, "gravity_x"), 0.0) / column(rows, "gravity_normal")
    assert np.allclose(shaft, 1.3 * (1.0 + steep) * speed**2 / np.hypot(speed, 0.005))
    still = rows_from(vx=0.0)
    assert at(plain, FORCE).watts(still) == pytest.approx(plain.watts(still))


def test_a_factor_scales_its_coefficient(plain: PowerModel, rows: Any) -> None:
    speed = np.hypot(column(rows, "vx"), column(rows, "vy"))
    factor = 1.0 + 0.4 * np.exp(-(((speed - 0.7) / 0.7) ** 2))
    rolling = plain.watts_by_effect(rows)["wheel_rolling"]
    known = rows.copy()
    known[:, INDEX["rolling_factor"]] *= factor
    assert np.allclose(at(plain, CONTACT).watts(rows), plain.watts(known))
    assert (rolling > 0.0).all()
    warm = at(plain, WARM).account(rows)["copper"] / plain.account(rows)["copper"]
    assert np.allclose(warm, 1.0 + 0.4 * 0.02 * (column(rows, "motor_temp") - 20.0))


def test_an_unknown_quantity_switches_the_effect_off(plain: PowerModel, rows: Any) -> None:
    unknown = rows.copy()
    unknown[:, INDEX["motor_temp"]] = math.nan
    assert np.array_equal(at(plain, BUS, WARM).watts(unknown), plain.watts(unknown))


def test_parts_add_up_and_derivatives_are_exact(plain: PowerModel, rows: Any) -> None:
    model = at(plain, *EFFECTS)
    parts = model.watts_by_effect(rows)
    assert {effect.slug for effect in EFFECTS} <= set(parts)
    assert np.allclose(sum(parts.values()), model.watts(rows), rtol=1e-9)
    jacobian = model.jacobian(rows)
    for place, (effect, name, _, _) in enumerate(model.slots):
        if effect in EFFECTS:
            step = 1e-6 * VALUES[name]
            up = model.with_parameter(place, VALUES[name] + step).watts(rows)
            down = model.with_parameter(place, VALUES[name] - step).watts(rows)
            error = np.abs((up - down) / (2.0 * step) - jacobian[:, place]).max()
            assert error < 1e-7 * np.abs(jacobian[:, place]).max() + 1e-7, (effect.slug, name)


def test_saved_and_loaded_bit_by_bit(plain: PowerModel, rows: Any, tmp_path: Path) -> None:
    model = at(plain, *EFFECTS)
    model.save(tmp_path / "model.json")
    back = PowerModel.load(tmp_path / "model.json")
    assert back.effects == model.effects
    assert np.array_equal(back.parameters, model.parameters)
    assert np.array_equal(back.watts(rows), model.watts(rows))


def test_a_saved_formula_is_checked_again(plain: PowerModel, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    plain.save(path)
    document = json.loads(path.read_text())
    document["custom"][0]["formula"] = "w*__import__('os').getpid()"
    path.write_text(json.dumps(document))
    with pytest.raises(ModelError, match="everything: formula"):
        PowerModel.load(path)
    for spoilt in (3, [3], [{}], {"a": 1}):
        document["custom"] = spoilt
        path.write_text(json.dumps(document))
        with pytest.raises(ModelError):
            PowerModel.load(path)


def test_another_process_loads_the_model_without_compiling(
    plain: PowerModel, rows: Any, tmp_path: Path
) -> None:
    at(plain, *EFFECTS).save(tmp_path / "model.json")
    wanted = float(at(plain, *EFFECTS).watts(rows[:1])[0])
    program = (
        "import sys, time\n"
        "from planner.power.model import PowerModel, rows_from\n"
        "import numpy as np\n"
        "model = PowerModel.load(sys.argv[1])\n"
        "print(repr(float(model.watts(np.load(sys.argv[2]))[0])), end='')\n"
    )
    np.save(tmp_path / "rows.npy", rows[:1])
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "model.json"), str(tmp_path / "rows.npy")],
        capture_output=True,
        text=True,
        check=True,
        env=dict(os.environ),
    )
    assert float(done.stdout) == wanted


def test_another_formula_is_another_kernel() -> None:
    def source(effect: type[Effect]) -> str:
        model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[effect])
        return kernel_source(model.effects, wheel_count=4, surface_count=1, number="float64")

    one, two = source(define("k*bump(heading,1,0.3)")), source(define("k*bump(heading,1,0.4)"))
    assert one != two
    assert one == source(define("k*bump(heading,1,0.3)"))
    assert define("k*bump(heading,1,0.3)") is define("k*bump(heading,1,0.3)")
    blanks = check_formula("k * bump( heading, 1, 0.3 )", K | NAMES, UNITS["W"])
    assert blanks.sha256 == check_formula("k*bump(heading,1,0.3)", K | NAMES, UNITS["W"]).sha256


def test_hostile_names_cannot_meet_those_of_the_kernel(rows: Any) -> None:
    # Each of these is a name in the generated module; in a formula it is a parameter like others.
    names = ("np", "njit", "types", "zero", "i", "part", "absolute", "evaluate", "watts_gravity")
    formula = "+".join(names[:8]) + "+0*watts_gravity+watts_gravity"
    parameters = {n: {"unit": "W", "bounds": [-9, 9], "null": 0} for n in names[:8]}
    with pytest.raises(ModelError, match="watts_gravity"):
        custom_effect("names", formula, "W", parameters)
    effect = custom_effect("names", "+".join(names[:8]), "W", parameters)
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[effect])
    ones = [
        1.0 if e is effect else v for (e, *_), v in zip(model.slots, model.parameters, strict=True)
    ]
    extra = replace(model, parameters=np.array(ones)).watts(rows) - model.watts(rows)
    assert np.allclose(extra, 8.0)


def test_a_formula_of_the_search_for_unknown_effects_is_planned_with(tmp_path: Path) -> None:
    from planner import plan_route

    effect = custom_effect(
        "resonance",
        "k*bump(speed, centre, width)",
        "W",
        {
            "k": {"unit": "W", "bounds": [0, 500], "null": 0, "default": 200},
            "centre": {"unit": "m/s", "bounds": [0.1, 2], "default": 0.6},
            "width": {"unit": "m/s", "bounds": [0.05, 1], "default": 0.15},
        },
    )
    vehicle = load_vehicle("minibalance")
    PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, effect]).save(tmp_path / "m.json")
    request = {
        "map": "tilted-plane",
        "model": str(tmp_path / "m.json"),
        "start": {"x": 5.0, "y": 12.0},
        "goal": {"x": 9.0, "y": 12.0},
        "seed": 1,
    }
    answer = plan_route(request)
    assert answer.status == "ok"
    route = answer.routes[0]
    assert "resonance" in route.breakdown_j
    assert route.lower_bound_j <= route.energy_j
    assert sum(route.breakdown_j.values()) == pytest.approx(route.energy_j, rel=1e-6)
    speeds = np.array([pose.speed for pose in route.poses])
    # 200 W at 0.6 m/s: the planner drives faster or slower than that where it can.
    assert abs(np.median(speeds) - 0.6) > 0.15


def test_dimensions_are_written_readably() -> None:
    assert format_dimension(parse_unit("N·m/s")) == "W"
    assert format_dimension(parse_unit("m/s")) == "m·s^-1"
    assert format_dimension(UNITS["1"]) == "1"
