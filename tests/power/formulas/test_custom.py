"""Custom effects: definitions that say too little are refused, the kernel computes the same."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.power.formulas.custom import custom_effect
from planner.power.formulas.custom_parameters import NAMES
from planner.power.formulas.dimensions import UNITS, parse_unit
from planner.power.formulas.formula import check_formula
from planner.power.kernels.pipeline import kernel_source
from planner.power.kernels.specialise import KernelSpec
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX
from tests.power.states import column, random_columns

K = {"k": UNITS["W"]}
SCALE = {"k": {"unit": "W", "bounds": [-50, 50], "null": 0}}


def define(formula: Any, **changes: Any) -> type[Effect]:
    given: dict[str, Any] = {"name": "ripple", "unit": "W", "parameters": SCALE} | changes
    return custom_effect(formula=formula, **given)


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
        ({"name": "Ripple"}, "not a name"),
        ({"name": "a; import os"}, "not a name"),
        ({"name": "lambda"}, "not a name"),
        ({"name": "x" * 99}, "not a name"),
        ({"name": 3}, "not a name"),
        ({"parameters": {}}, "missing"),
        ({"parameters": {"k": {"unit": "W", "bounds": [0, 1]}}}, "null value"),
        ({"parameters": {"k": {"unit": "W", "null": 0}}}, "unit and bounds"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [1, 0]}}}, "not a range"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [1, 2]}}}, "out of its bounds"),
        ({"parameters": {"k": SCALE["k"] | {"bounds": [0, math.inf]}}}, "JSON"),
        ({"parameters": {"k": SCALE["k"] | {"default": 99}}}, "out of its bounds"),
        ({"parameters": {"k": SCALE["k"] | {"code": 99}}}, "no such key"),
        ({"parameters": {"k": SCALE["k"] | {"unit": "blorp"}}}, "not a unit"),
        ({"parameters": SCALE | {"vx": SCALE["k"]}}, "another meaning"),
        ({"parameters": SCALE | {"hooks": SCALE["k"]}}, "another meaning"),
        ({"parameters": SCALE | {"unused": SCALE["k"]}}, "not in the formula"),
        ({"coefficient": "gravity"}, "no such coefficient"),
        ({"doc": "x" * 999}, "not a short text"),
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


def formula_of(effect: type[Effect], rows: Any) -> Any:
    """The formula's values, by NumPy instead of the kernel."""
    assert effect.definition is not None
    vx, vy = column(rows, "vx"), column(rows, "vy")
    values = {name: column(rows, name) for name in INDEX} | VALUES
    values |= {"speed": np.hypot(vx, vy), "heading": np.arctan2(vy, vx)}
    units = {name: parse_unit(parameter.unit) for name, parameter in effect.parameters.items()}
    formula = check_formula(effect.definition["formula"], NAMES | units, UNITS["W"])
    return formula.evaluate(values)


def test_at_null_the_model_is_the_one_without(plain: PowerModel, rows: Any) -> None:
    without = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[])
    assert np.allclose(plain.watts(rows), without.watts(rows), rtol=1e-14, atol=0)


def test_watts_enter_the_bus_as_the_formula_says(plain: PowerModel, rows: Any) -> None:
    extra = at(plain, BUS).watts(rows) - plain.watts(rows)
    assert np.allclose(extra, formula_of(BUS, rows), rtol=1e-9, atol=1e-10)
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
        "from planner.power.model import PowerModel\n"
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
        return kernel_source(KernelSpec(model.effects, 4, 1, "float64"))

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
