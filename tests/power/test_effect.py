"""What holds for every effect of the catalogue, without exception."""

from __future__ import annotations

import ast
import inspect
import itertools
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import planner.power.effects as effects_package
from planner.power.catalogue import all_effects, find_effect, list_effects
from planner.power.effect import HOOKS, Effect, Parameter
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX, QUANTITIES
from tests.power.states import Array, random_columns

EFFECTS = all_effects()
CANDIDATES = [effect for effect in EFFECTS.values() if not effect.base]
each_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
each_candidate = pytest.mark.parametrize("effect", CANDIDATES, ids=[e.slug for e in CANDIDATES])

BASE = {
    *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
    *("copper_loss", "coulomb_drag"),
}
CATALOGUE = {
    *("motor_heating", "load_dependent_rolling", "com_offset", "gear_asymmetry"),
    *("regeneration_limit", "viscous_drag", "stiction", "driver_loss", "sensor_rate"),
    *("slope_transition", "current_ripple", "wheel_preload", "wheel_slip", "yaw_scrub"),
    *("surface_rolling", "sinkage", "battery_sag", "converter_efficiency", "air_drag"),
    *("vibration", "cold_grease", "light_load_gear_drag", "wear", "wheel_imbalance"),
    "roller_presliding",
}
SYMBOLS = {"W", "N", "m", "s", "rad", "kg", "K", "J", "Hz", "V", "A", "Ω", "1"}


def module_of(effect: type[Effect]) -> ModuleType:
    module = inspect.getmodule(effect)
    assert module is not None
    return module


def test_catalogue_is_complete() -> None:
    assert {slug for slug, effect in EFFECTS.items() if effect.base} == BASE
    assert {effect.slug for effect in CANDIDATES} >= CATALOGUE
    assert [entry["name"] for entry in list_effects()] == list(EFFECTS)


@each_effect
def test_head_says_what_it_does(effect: type[Effect]) -> None:
    head = inspect.cleandoc(module_of(effect).__doc__ or "")
    places = [head.find(f"\n{title}\n") for title in ("Sign", "Source", "Holds for", "Left out")]
    assert -1 not in places, "Sign, Source, Holds for, Left out"
    assert places == sorted(places)
    equations = [line for line in head[: places[0]].splitlines() if line.startswith("    ")]
    assert any("=" in line or "→" in line for line in equations), "an equation, indented"
    assert effect.summary() == head.split("\n\n")[0]
    assert inspect.getdoc(effect) != inspect.getdoc(Effect)


@each_effect
def test_names(effect: type[Effect]) -> None:
    assert Path(module_of(effect).__file__ or "").stem == effect.slug
    assert effect.__name__ == "".join(part.title() for part in effect.slug.split("_"))
    titles = [other.title for other in EFFECTS.values()]
    assert titles.count(effect.title) == 1


@each_effect
def test_formulas_know_nothing_but_their_declaration(effect: type[Effect]) -> None:
    allowed = {"planner.power.effect", "planner.power.kernel_math"}
    tree = ast.parse(inspect.getsource(module_of(effect)))
    for node in ast.walk(tree):
        assert not isinstance(node, ast.Import), "only from planner.power import"
        if isinstance(node, ast.ImportFrom):
            assert node.module in allowed


@each_effect
def test_units_are_si(effect: type[Effect]) -> None:
    for name, parameter in effect.parameters.items():
        factors = parameter.unit.replace("/", "·").replace("(", "").replace(")", "").split("·")
        assert {factor.rstrip("²³") for factor in factors} <= SYMBOLS, f"{name} {parameter.unit}"


@each_effect
def test_parameters_are_possible(effect: type[Effect]) -> None:
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        assert low < high, name
        assert low <= parameter.default <= high, name
        assert parameter.null is None or low <= parameter.null <= high, name
        assert all(low <= value <= high for value in parameter.grid), name
        assert not (parameter.grid and parameter.fitted), f"{name}: scanned or fitted, not both"
        assert parameter.doc.endswith("."), name
        assert parameter.spread > 0.0, name
        assert name not in INDEX, f"{name} is the name of a quantity"
    if not effect.base:
        assert any(p.null is not None and p.fitted for p in effect.parameters.values())


@each_effect
def test_every_hook_has_a_worked_example(effect: type[Effect]) -> None:
    assert {example.hook for example in effect.examples} == set(effect.hooks)
    for example in effect.examples:
        formula = effect.hooks[example.hook]
        assert set(example.given) == set(inspect.signature(formula).parameters)
        numbers = [value for value in example.given.values() if not math.isnan(value)]
        assert len(set(numbers)) == len(numbers), "equal numbers hide swapped arguments"
        assert formula(**example.given) == pytest.approx(example.result, rel=1e-6, abs=1e-12)


@each_candidate
def test_hooks_are_neutral_at_null(effect: type[Effect]) -> None:
    random = np.random.default_rng(7)
    for name, formula in effect.hooks.items():
        neutral = {"add": 0.0, "multiply": 1.0}[HOOKS[name].combine]
        for _ in range(20):
            given = {}
            for argument in inspect.signature(formula).parameters:
                parameter = effect.parameters.get(argument)
                value = random.uniform(0.1, 30.0)
                if parameter is not None:
                    value = parameter.default if parameter.null is None else parameter.null
                elif argument in INDEX and random.uniform() < 0.3:
                    default = QUANTITIES[INDEX[argument]].default
                    value = default if math.isnan(default) else value
                given[argument] = value
            assert np.all(np.array(formula(**given)) == neutral), (name, given)


# Everything below looks at one model in which all effects act at once.


@pytest.fixture(scope="module")
def everything() -> PowerModel:
    """All effects, each away from its null value."""
    vehicle = load_vehicle("minibalance")
    model = PowerModel.from_vehicle(vehicle, effects=list(EFFECTS), surfaces=("hard", "carpet"))
    values = model.parameters.copy()
    for place, (effect, name, parameter, element) in enumerate(model.slots):
        if values[place] == parameter.null or (effect.slug, name) in MORE:
            away = MORE.get((effect.slug, name), 0.0) + 0.05 * (element + 1)
            inside = parameter.bounds[0] <= away <= parameter.bounds[1] and away != parameter.null
            values[place] = away if inside else parameter.in_virtual_robot
    return model_of(model, values)


MORE = {
    ("regeneration_limit", "motor_share"): 0.55,
    ("regeneration_limit", "source_share"): 0.35,
    ("com_offset", "offset_x_squared"): -0.049,
    ("com_offset", "offset_y_squared"): -0.048,
    ("roller_drag", "roller_viscous"): 1.0,
}


def model_of(model: PowerModel, values: Array) -> PowerModel:
    """The same model with other parameters."""
    for place, value in enumerate(values):
        model = model.with_parameter(place, value)
    return model


@pytest.fixture(scope="module")
def rows() -> Array:
    """States in half of which the optional quantities are not known."""
    columns = random_columns(300, seed=8)
    unknown = np.arange(300) % 2 == 0
    for name in ("com_x", "com_y", "motor_temp", "ambient_temp", "battery_voltage"):
        columns[name] = np.where(unknown, np.nan, columns[name])
    columns["sensor_rate"] = np.where(unknown, np.nan, 25.0)
    # Some creep, so that what acts near standstill is seen as well.
    for name in ("vx", "vy", "wz"):
        columns[name] = np.where(np.arange(300) % 5 == 0, 0.02 * columns[name], columns[name])
    # A storm from behind, so that the source is given power; a stronger one would make the wheels
    # slide, and sliding wheels give nothing back.
    storm = np.arange(300) % 10 == 7
    for wind, speed in (("wind_x", "vx"), ("wind_y", "vy")):
        columns[wind] = np.where(storm, 15.0 * columns[speed], columns[wind])
    return rows_from(**columns)


def test_null_values_are_the_base_model(everything: PowerModel, rows: Array) -> None:
    base = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[])
    for place, (effect, name, _, _) in enumerate(base.slots):
        same = [s[:2] for s in everything.slots].index((effect, name))
        base = base.with_parameter(place, everything.parameters[same])
    without = everything.without_candidates()
    assert without.watts(rows) == pytest.approx(base.watts(rows), rel=1e-12)


@each_candidate
def test_null_values_switch_one_effect_off(
    effect: type[Effect], everything: PowerModel, rows: Array
) -> None:
    # Beside others that act, an effect at its null values leaves no trace of its shape parameters.
    off = everything
    shaped = []
    for place, (owner, _, parameter, _) in enumerate(everything.slots):
        if owner is effect and parameter.null is not None:
            off = off.with_parameter(place, parameter.null)
        elif owner is effect:
            shaped.append((place, parameter))
    other = off
    for place, parameter in shaped:
        other = other.with_parameter(place, 0.5 * sum(parameter.bounds))
    assert other.watts(rows) == pytest.approx(off.watts(rows), rel=1e-12)
    assert np.any(np.abs(everything.watts(rows) - off.watts(rows)) > 1e-6), "and on, it does act"


def test_power_is_finite_whatever_is_unknown(everything: PowerModel, rows: Array) -> None:
    unknown = rows.copy()
    for quantity in QUANTITIES:
        if math.isnan(quantity.default) or quantity.name.startswith("wind"):
            unknown[:, INDEX[quantity.name]] = np.nan
    assert np.all(np.isfinite(everything.watts(unknown)))
    assert np.all(np.isfinite(everything.watts(rows_from())))


@pytest.fixture(scope="module")
def jacobian(everything: PowerModel, rows: Array) -> Array:
    return everything.jacobian(rows)


def test_jacobian_against_central_differences(
    everything: PowerModel, rows: Array, jacobian: Array
) -> None:
    for place, (effect, name, _, _) in enumerate(everything.slots):
        value = everything.parameters[place]
        step = 1e-6 * abs(value)
        up = everything.with_parameter(place, value + step).watts(rows)
        down = everything.with_parameter(place, value - step).watts(rows)
        difference = (up - down) / (2.0 * step)
        # Rounding of a power of 100 W over the step, and the next order of the difference.
        rounding = 1e-13 / step
        limit = 1e-6 * np.abs(jacobian[:, place]).max() + rounding
        error = np.abs(jacobian[:, place] - difference)
        assert np.all(error <= limit), (effect.slug, name, error.max(), limit)


@each_effect
def test_jacobian_sees_every_effect(
    effect: type[Effect], everything: PowerModel, rows: Array, jacobian: Array
) -> None:
    # Another effect may hide one: where electronics take much, the source is given nothing back.
    alone = everything.without_candidates()
    own = [place for place, (owner, *_) in enumerate(everything.slots) if owner is effect]
    for place in own:
        alone = alone.with_parameter(place, everything.parameters[place])
    hidden = [place for place in own if not np.any(jacobian[:, place])]
    seen = alone.jacobian(rows) if hidden else jacobian
    for place in hidden:
        assert np.any(seen[:, place] != 0.0), everything.slots[place][1]


def test_jacobian_at_null_is_what_the_effect_starts_with(
    everything: PowerModel, rows: Array
) -> None:
    # The score test looks at the derivative there; parameters that are squares make it finite.
    without = everything.without_candidates()
    slopes = without.jacobian(rows)
    assert np.all(np.isfinite(slopes))
    for place, (effect, name, parameter, _) in enumerate(everything.slots):
        if parameter.null is None:
            continue
        inward = 1.0 if parameter.null < parameter.bounds[1] else -1.0
        step = inward * 1e-6 * min(1.0, abs(parameter.default) or 1.0)
        watts = without.with_parameter(place, parameter.null + step).watts(rows)
        difference = (watts - without.watts(rows)) / step
        limit = 1e-3 * np.abs(slopes[:, place]).max() + 1e-12 / abs(step)
        # Where a gear passes from driving to braking within the step, the difference is no slope.
        smooth = np.abs(slopes[:, place] - difference) <= limit
        assert smooth.mean() >= 0.98, (effect.slug, name)


@each_effect
def test_a_declared_loss_takes_power_where_it_acts(effect: type[Effect]) -> None:
    if not effect.loss:
        return
    random = np.random.default_rng(9)
    for name, formula in effect.hooks.items():
        for _ in range(200):
            given = {argument: random.uniform(-5.0, 5.0) for argument in arguments_of(formula)}
            for argument in {"load", "nominal_load", "gear_ratio", "speed", *POSITIVE} & {*given}:
                given[argument] = abs(given[argument]) + 0.1
            for own, parameter in effect.parameters.items():
                if own in given:
                    given[own] = parameter.in_virtual_robot
            speeds = [given.get(speed, 0.0) for speed in CONJUGATE.get(name, ())] or [1.0]
            if name == "slip":
                speeds = [given["axis_force"] * given["rim_speed"]]
            assert np.dot(speeds, np.atleast_1d(formula(**given))) >= 0.0, (name, given)


CONJUGATE = {
    "body_force": ("vx", "vy", "wz"),
    "axle_torque": ("wheel_speed",),
    "motor_torque": ("motor_speed",),
}
"""Speeds that a hook's force acts against; other hooks give watts, or an amount of at least 0."""
POSITIVE = (
    "active",
    "resistance_now",
    "torque_constant_now",
    "slope_rate",
    "sensor_rate",
    "electronics_watts",
    "battery_voltage",
    *("payload", "gravity_normal", "rolling_factor", "traction_factor"),
    *("odometer", "time_since_start"),
)


def arguments_of(formula: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(formula).parameters)


def test_effects_that_are_loss_alone_raise_the_power(everything: PowerModel, rows: Array) -> None:
    still = rows.copy()
    for name in ("wind_x", "wind_y"):
        still[:, INDEX[name]] = 0.0
    losses = {
        *("driver_loss", "sensor_rate", "converter_efficiency", "current_ripple"),
        *("wheel_preload", "battery_sag"),
    }
    assert all(EFFECTS[slug].loss for slug in losses)
    shares = everything.watts_by_effect(still)
    for slug in losses:
        assert shares[slug].min() >= -1e-9, slug
        assert shares[slug].max() > 0.0, slug


# The declaration itself refuses mistakes when it is imported.


NULL = Parameter(unit="W", default=1.0, null=0.0, bounds=(0.0, 2.0), doc="Any.")


@pytest.mark.parametrize(
    ("members", "words"),
    [
        ({"watts": staticmethod(lambda speed, more: 0.0)}, "no such hook"),
        ({"electronics": staticmethod(lambda spede, more: 0.0)}, "'spede' is neither"),
        ({"electronics": staticmethod(lambda current, more: 0.0)}, "'current' is neither"),
    ],
)
def test_mistakes_fail_at_import(members: dict[str, object], words: str) -> None:
    with pytest.raises(TypeError, match=words):
        type("Mistake", (Effect,), {"slug": "mistake", "more": NULL, **members})
    assert "mistake" not in all_effects()


def test_a_candidate_needs_a_null_value() -> None:
    some = Parameter(unit="W", default=1.0, bounds=(0.0, 2.0), doc="Any.")
    with pytest.raises(TypeError, match="null value"):
        type("Mistake", (Effect,), {"slug": "mistake", "more": some})


class Hum(Effect):
    """An effect whose parameters state their meaning in both forms."""

    slug = "hum"
    title = "hum"

    loud = Parameter(unit="W", default=1.0, null=0.0, bounds=(0.0, 2.0))
    """Power of
    the hum."""
    brief = Parameter(unit="W", default=1.0, bounds=(0.0, 2.0), doc="Given.")
    """Not read."""
    silent = Parameter(unit="W", default=1.0, bounds=(0.0, 2.0))

    @staticmethod
    def electronics(loud, brief, silent):  # type: ignore[no-untyped-def]
        """W."""
        return loud + brief + silent


def test_a_parameters_sentence_stands_below_it() -> None:
    docs = {name: parameter.doc for name, parameter in Hum.parameters.items()}
    assert docs == {"loud": "Power of the hum.", "brief": "Given.", "silent": ""}


def test_every_file_is_in_the_catalogue() -> None:
    files = {path.stem for path in Path(next(iter(effects_package.__path__))).glob("[a-z]*.py")}
    assert files == set(EFFECTS)
    order = [(effect.base, effect.stages()[0]) for effect in EFFECTS.values()]
    bases = [base for base, _ in order]
    assert bases == sorted(bases, reverse=True)
    stages = list(dict.fromkeys(hook.stage for hook in HOOKS.values()))
    for (_, one), (base, two) in itertools.pairwise(order):
        assert base or stages.index(one) <= stages.index(two) or one == order[7][1]


def test_unknown_effect_names_the_known_ones() -> None:
    with pytest.raises(Exception, match=r"no such effect.*air_drag"):
        find_effect("ether_drag")
