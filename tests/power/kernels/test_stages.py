"""The stages run as plain Python: the compiled kernels give the same figures, bit for bit."""

from __future__ import annotations

import ast
import inspect
from dataclasses import replace

import numpy as np
import pytest

from planner.power.account import ACCOUNT_LENGTH, PerWheel
from planner.power.catalogue import all_effects
from planner.power.effect import HOOKS
from planner.power.kernels import stages
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.kernels.plain_hooks import plain_power
from tests.power.states import Array, random_columns

ROWS = 12


def states() -> Array:
    columns = random_columns(ROWS, seed=41)
    unknown = np.arange(ROWS) % 3 == 0
    for name in ("com_x", "com_y", "motor_temp", "battery_voltage"):
        columns[name] = np.where(unknown, np.nan, columns[name])
    for name in ("vx", "vy", "wz"):
        columns[name][1] = 0.0
    return rows_from(**columns)


def assert_same(model: PowerModel) -> None:
    """The compiled account of every row is the one that the plain function writes."""
    for row in states():
        account, per_wheel = np.empty(ACCOUNT_LENGTH), np.empty((len(model.wheels), len(PerWheel)))
        watts = model.kernel(row, model.parameters, model.body, model.wheels, account, per_wheel)
        plain = plain_power(model, row)
        assert watts == plain[0]
        np.testing.assert_array_equal(account, plain[1])
        np.testing.assert_array_equal(per_wheel, plain[2])


@pytest.fixture(scope="module")
def catalogue() -> PowerModel:
    """The whole catalogue, with every parameter away from its null value."""
    model = PowerModel.from_vehicle(
        load_vehicle("minibalance"), effects=list(all_effects()), surfaces=("hard", "carpet")
    )
    values = model.parameters.copy()
    for place, (_, _, parameter, element) in enumerate(model.slots):
        if parameter.null is not None and parameter.default == parameter.null:
            values[place] = np.clip(parameter.null + 0.02 * (element + 1), *parameter.bounds)
    return replace(model, parameters=values)


def test_all_effects_at_once(catalogue: PowerModel) -> None:
    assert_same(catalogue)


@pytest.mark.parametrize("slug", [s for s, e in all_effects().items() if not e.base])
def test_one_effect(slug: str, catalogue: PowerModel) -> None:
    null = catalogue.without_candidates().parameters
    mine = [owner.slug == slug for owner, _, _, _ in catalogue.slots]
    assert_same(replace(catalogue, parameters=np.where(mine, catalogue.parameters, null)))


@pytest.mark.parametrize(("vehicle", "kind"), [("minibalance", "printed/A"), ("robotino", "sound")])
def test_other_wheels_and_the_printed_motors(vehicle: str, kind: str) -> None:
    assert_same(PowerModel.from_vehicle(load_vehicle(vehicle), effects=[], kind=kind))


def test_every_hook_is_called() -> None:
    """But for the side of an unknown centre, which runs the stages several times."""
    strings = {
        node.value
        for node in ast.walk(ast.parse(inspect.getsource(stages.power)))
        if isinstance(node, ast.Constant)
    }
    assert set(HOOKS) - strings == {"centre_spread"}


def test_formulas_read_what_the_stages_have_computed() -> None:
    names = {
        node.id
        for node in ast.walk(ast.parse(inspect.getsource(stages.power)))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    assert {name for hook in HOOKS.values() for name in hook.reads} <= names
