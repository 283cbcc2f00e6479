"""Kernels for blocks of rows: the same power and the same limits as the model's own, row by row."""

from __future__ import annotations

import ast
import textwrap
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner.power.account import ACCOUNT, LIMITS
from planner.power.catalogue import all_effects
from planner.power.formulas import custom_effect
from planner.power.kernels.row_blocks import BLOCK, in_blocks
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.telemetry.prediction import Nodes, secants
from tests.power.states import Array, random_columns

ROWS = 4 * BLOCK + 17  # the last block is not full


def in_lean_blocks(model: PowerModel, rows: Array) -> Array:
    """(n,) W by the lean kernel."""
    found = np.full(len(rows), np.nan)
    watts = np.empty(BLOCK)
    for start in range(0, len(rows), BLOCK):
        part = rows[start : start + BLOCK]
        columns = np.full((rows.shape[1], BLOCK), np.nan)
        columns[:, : len(part)] = part.T
        model.power_kernel(
            columns.ravel(), len(part), model.parameters, model.body, model.wheels, watts
        )
        found[start : start + len(part)] = watts[: len(part)]
    return found


def with_limits(model: PowerModel, rows: Array) -> Array:
    """(n, 1 + limits) W and what limits are set for, by the kernel that writes both."""
    width = 1 + len(LIMITS)
    found = np.full((len(rows), width), np.nan)
    written = np.empty((width, BLOCK))
    for start in range(0, len(rows), BLOCK):
        part = rows[start : start + BLOCK]
        columns = np.full((rows.shape[1], BLOCK), np.nan)
        columns[:, : len(part)] = part.T
        model.limits_kernel(
            columns.ravel(), len(part), model.parameters, model.body, model.wheels, written.ravel()
        )
        found[start : start + len(part)] = written[:, : len(part)].T
    return found


def assert_same(model: PowerModel, rows: Array) -> None:
    """Both kernels for blocks agree with the one for a row, bit by bit."""
    accounts, _ = model.evaluate(rows)
    np.testing.assert_array_equal(in_lean_blocks(model, rows), accounts[:, 0])
    np.testing.assert_array_equal(model.watts_in_blocks(rows), accounts[:, 0])
    columns = [0, *(ACCOUNT.index(name) for name in LIMITS)]
    np.testing.assert_array_equal(with_limits(model, rows), accounts[:, columns])
    assert np.all(np.isfinite(accounts[:, columns]))


def states(**more: Any) -> Array:
    columns = random_columns(ROWS, seed=21) | more
    unknown = np.arange(ROWS) % 3 == 0
    for name in ("com_x", "com_y", "motor_temp", "ambient_temp", "battery_voltage"):
        columns[name] = np.where(unknown, np.nan, columns[name])
    slow = np.where(np.arange(ROWS) % 5 == 0, 0.01, 1.0)  # friction and holding near rest
    for name in ("vx", "vy", "wz"):
        columns[name] = slow * columns[name]
    return rows_from(**columns)


def away(model: PowerModel, slug: str | None = None) -> PowerModel:
    """The model with all effects, or this one beside the base, away from their null values."""
    values = model.without_candidates().parameters.copy()
    for place, (effect, _, parameter, element) in enumerate(model.slots):
        if parameter.null is not None and slug in (None, effect.slug):
            low, high = parameter.bounds
            given = parameter.default
            if given == parameter.null:
                given = parameter.null + 0.02 * (element + 1)
            values[place] = np.clip(given, low, high)
    return replace(model, parameters=values)


@pytest.fixture(scope="module")
def catalogue() -> PowerModel:
    """The whole catalogue; one compiled kernel serves all tests."""
    return PowerModel.from_vehicle(
        load_vehicle("minibalance"), effects=list(all_effects()), surfaces=("hard", "carpet")
    )


@pytest.mark.parametrize("slug", [s for s, e in all_effects().items() if not e.base])
def test_one_effect_gives_the_same_bits(slug: str, catalogue: PowerModel) -> None:
    # Where no centre of mass is known a row asks for four sides; others of its block do not.
    model, rows = away(catalogue, slug), states()
    expected = model.watts(rows)
    assert np.any(expected != catalogue.without_candidates().watts(rows)), "nothing is tested"
    assert_same(model, rows)


def test_everything_at_once(catalogue: PowerModel) -> None:
    model, rows = away(catalogue), states()
    assert_same(model, rows)


@pytest.mark.parametrize(
    ("vehicle", "kind"),
    [
        ("minibalance", "sound"),
        ("robotino", "sound"),
        # Each kind compiles a kernel of its own; with either wheels one is enough.
        ("minibalance", "printed/A"),
        ("robotino", "printed/B"),
    ],
)
def test_other_wheels_and_the_printed_motors(vehicle: str, kind: str) -> None:
    model = PowerModel.from_vehicle(load_vehicle(vehicle), effects=[], kind=kind)
    assert_same(model, states())


def test_an_effect_written_by_the_user() -> None:
    kinds = {
        "push": {"unit": "W", "bounds": [-50, 50], "null": 0},
        "usual": {"unit": "m/s", "bounds": [0.1, 2], "default": 0.6},
    }
    formula = "push*(tanh(30*vx/usual) + bump(heading, 1, 0.5) + hinge(vy/usual)**1.5)"
    push = custom_effect("push", formula, "W", kinds)
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[push])
    rows = states()
    model = replace(model, parameters=np.where(model.parameters == 0.0, 3.0, model.parameters))
    assert_same(model, rows)
    assert np.ptp(model.watts(rows) - model.without_candidates().watts(rows)) > 3.0


def test_rows_behind_the_last_one_stay(catalogue: PowerModel) -> None:
    watts = np.full(BLOCK, -1.0)
    columns = np.zeros((states().shape[1], BLOCK))
    columns[:, :5] = states()[:5].T
    catalogue.power_kernel(
        columns.ravel(), 5, catalogue.parameters, catalogue.body, catalogue.wheels, watts
    )
    assert np.all(watts[5:] == -1.0)
    assert np.all(watts[:5] > 0.0)


def test_rows_of_a_log_get_the_mean_of_their_moments(catalogue: PowerModel) -> None:
    """Some rows at three moments, others at one; enough that threads share them."""
    number = np.random.default_rng(4).choice([1, 3], 900)
    first = np.concatenate([[0], np.cumsum(number)])
    rows = np.resize(states(), (first[-1], states().shape[1]))
    weight = np.random.default_rng(5).uniform(0.1, 1.0, first[-1])
    model, other = away(catalogue, "air_drag"), away(catalogue)
    variants, steps = other.parameters[None], np.ones(1)
    watts, _, columns = secants(model, Nodes(rows, first, weight), (), variants, steps)
    alone, changed = model.watts(rows), other.watts(rows)
    expected = np.add.reduceat(weight * alone, first[:-1])
    np.testing.assert_allclose(watts, expected, rtol=1e-13)
    np.testing.assert_allclose(
        columns[:, 0],
        np.add.reduceat(weight * (changed - alone), first[:-1]),
        rtol=1e-11,
        atol=1e-11,
    )
    nothing = Nodes(rows[:0], np.zeros(1, np.int64), weight[:0])
    assert secants(model, nothing, (), variants, steps)[2].shape == (0, 1)


@pytest.mark.parametrize(
    "lines",
    [
        ["y = 0.0", "if row[2] > 1.0:", "    y = 5.0", "return y + 0.0 * row[2]"],
        ["y = row[1]", "if row[2] > 1.0:", "    y += 1.0", "return y"],
        [
            "y = row[1]",
            "if parameters[0] > 1.0:",
            "    y += 1.0",
            "else:",
            "    y = 2.0",
            "return y",
        ],
        ["y = row[1]", "for i in range(int(y)):", "    y += 1.0", "return y"],
        ["return parameters[0]"],
        ["y = row[1]"],
    ],
)
def test_what_cannot_be_rewritten_is_refused(lines: list[str]) -> None:
    with pytest.raises(ValueError, match=r"depends on|no branch|must return"):
        in_blocks(ast.parse("\n".join(lines)).body)


def test_what_does_not_depend_on_the_row_stays_outside_the_loops() -> None:
    lines = [
        "acts = parameters[1] != 0.0",
        "x = row[2]",
        "total = 0.0",
        "for i in range(2):",
        "    if acts:",
        "        total += wheels[i, 0] * x",
        "return total",
    ]
    text = "\n".join(in_blocks(ast.parse("\n".join(lines)).body))
    assert text.index("for i in range(2)") < text.index("if acts:")
    inside = text.split("if acts:")[1]
    assert inside.index("wheels[i, 0]") < inside.index("for k in range(count)")
    namespace: dict[str, Any] = {"np": np}
    head = "def evaluate(columns, count, parameters, wheels, found):\n"
    exec(head + textwrap.indent(text, "    "), namespace)
    columns = np.arange(10.0 * BLOCK)
    watts = np.zeros(BLOCK)
    namespace["evaluate"](columns, 3, np.array([0.0, 1.0]), np.array([[2.0], [3.0]]), watts)
    np.testing.assert_array_equal(watts[:4], [*(5.0 * columns[2 * BLOCK : 2 * BLOCK + 3]), 0.0])
