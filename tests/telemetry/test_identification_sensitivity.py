"""Derivatives of a model's power along a log, and rows that stand for an interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import rows_from
from planner.quantities import INDEX
from planner.telemetry.interval import MOMENTS, interval_nodes
from planner.telemetry.sensitivity import (
    SLOW,
    differences,
    doubt_of,
    mean_watts,
    predict,
    tangent,
)
from tests.power.states import model_with, random_columns
from tests.telemetry.rows import base_model

ROWS = rows_from(**random_columns(400, seed=5))


def steady_nodes(model, rows):
    """Every row by itself."""
    return interval_nodes(rows, np.zeros(len(rows)), model)


@pytest.fixture(scope="module", params=["base", "catalogue"])
def model(request):
    """The base model, and one that has the catalogue with some of it switched on."""
    if request.param == "base":
        return base_model()
    return model_with("air_drag", "yaw_scrub", "wheel_preload", air_drag__drag_area=0.3)


def test_lean_power_is_the_full_model_bit_by_bit(model):
    np.testing.assert_array_equal(mean_watts(model, steady_nodes(model, ROWS)), model.watts(ROWS))


def test_tangent_is_the_complex_derivative(model):
    # At kinks (a gear that passes from driving to braking) there is no derivative to agree on.
    exact = model.jacobian(ROWS)
    _, found = tangent(model, steady_nodes(model, ROWS), range(len(model.parameters)))
    for place, (effect, name, _, _) in enumerate(model.slots):
        error = np.abs(found[:, place] - exact[:, place])
        # Rounding of some 100 W over a step of 1e-6 of the parameter.
        limit = 1e-4 * np.abs(exact[:, place]).max() + 1e-7 / max(
            abs(model.parameters[place]), 1e-6
        )
        assert np.mean(error <= limit) >= 0.99, (effect.slug, name)


def test_tangent_steps_inwards_at_a_bound(model):
    place = next(k for k, s in enumerate(model.slots) if s[1] == "efficiency")
    top = model.slots[place][2].bounds[1]
    at_bound = model.with_parameter(place, top)
    _, found = tangent(at_bound, steady_nodes(model, ROWS), [place])
    inside = model.with_parameter(place, top - 1e-4)
    secant = (at_bound.watts(ROWS) - inside.watts(ROWS)) / 1e-4
    assert found[:, 0] == pytest.approx(secant, rel=1e-2, abs=1e-3 * np.abs(secant).max())


def test_difference_of_a_whole_variant_is_the_difference_of_two_models(model):
    other = model.parameters * 1.01
    watts, columns = differences(model, steady_nodes(model, ROWS), other[None])
    there = replace(model, parameters=other).watts(ROWS)
    assert columns[:, 0] == pytest.approx(there - watts, rel=1e-9, abs=1e-10)


def test_many_rows_in_threads_are_as_few_rows(model):
    many = np.tile(ROWS, (25, 1))  # several pieces of work
    watts = mean_watts(model, steady_nodes(model, many))
    np.testing.assert_array_equal(watts, np.tile(model.watts(ROWS), 25))


# A row of a log is a mean over its interval.


def through_rest(count: int, seed: int):
    """Rows whose forward speed crosses zero within half a second."""
    random = np.random.default_rng(seed)
    change = random.uniform(0.05, 0.4, count) * random.choice([-1.0, 1.0], count)
    return rows_from(
        vx=random.uniform(-0.4, 0.4, count) * change,
        ax=change / 0.5,
        gravity_x=random.uniform(-1.0, 1.0, count),
    )


def test_shares_of_a_row_add_up_to_one():
    base = base_model()
    rows = np.concatenate([through_rest(50, 1), ROWS])
    nodes = interval_nodes(rows, np.full(len(rows), 0.5), base)
    assert nodes.first[0] == 0
    assert nodes.first[-1] == len(nodes.rows) == len(nodes.weight)
    assert np.all(np.diff(nodes.first) >= 1)
    assert np.add.reduceat(nodes.weight, nodes.first[:-1]) == pytest.approx(1.0, abs=1e-12)
    # Gauss and Legendre's three nodes integrate every polynomial up to the fifth degree.
    first, last = nodes.first[:2]
    assert last - first == MOMENTS
    change = rows[0, INDEX["ax"]] * 0.5
    place = (nodes.rows[first:last, INDEX["vx"]] - rows[0, INDEX["vx"]]) / change
    for power, mean in enumerate([1.0, 0.0, 1.0 / 12.0, 0.0, 1.0 / 80.0, 0.0]):
        assert nodes.weight[first:last] @ place**power == pytest.approx(mean, abs=1e-12)


def test_rows_in_steady_motion_are_taken_as_they_are():
    rows = rows_from(vx=[0.3, 0.5], ax=[0.0, 0.05])
    nodes = interval_nodes(rows, np.full(2, 0.5), base_model())
    np.testing.assert_array_equal(nodes.rows, rows)


def test_power_through_rest_is_nearer_to_the_integral_than_at_the_mean_speed():
    base = base_model()
    rows, interval = through_rest(200, 2), 0.5
    moments = (np.arange(400) + 0.5) / 400 - 0.5
    fine = np.repeat(rows, len(moments), axis=0)
    fine[:, INDEX["vx"]] += np.tile(moments, len(rows)) * interval * fine[:, INDEX["ax"]]
    reference = base.watts(fine).reshape(len(rows), -1).mean(axis=1)
    by_nodes = mean_watts(base, interval_nodes(rows, np.full(len(rows), interval), base))
    by_mean = base.watts(rows)

    def rms(error):
        return float(np.sqrt(np.mean(error**2)))

    assert rms(by_nodes - reference) < 0.5 * rms(by_mean - reference)
    assert np.mean(np.abs(by_nodes - reference) <= np.abs(by_mean - reference)) > 0.75


def test_velocity_turns_with_the_frame():
    # Constant velocity in the world while the body turns left: in the body it turns right.
    wz, interval = 1.5, 1.0
    rows = rows_from(vx=0.02, vy=0.3, wz=wz)
    nodes = interval_nodes(rows, np.array([interval]), base_model())
    assert len(nodes.rows) == 3
    change = (nodes.rows[2, :] - nodes.rows[0, :]) / (np.sqrt(0.6) * interval)
    assert change[INDEX["vx"]] == pytest.approx(wz * 0.3)
    assert change[INDEX["vy"]] == pytest.approx(-wz * 0.02)


def test_prediction_of_a_log_conserves_its_order(motion, base):
    whole = predict(base, motion)
    some = np.array([5, 700, 11, 1200])
    np.testing.assert_array_equal(predict(base, motion.take(some)), whole[some])


def test_only_rows_with_a_slow_wheel_are_doubtful():
    base = base_model()
    rows = rows_from(
        vx=[0.0, 0.3, 0.3, SLOW / 2.0], vy=[0.0, 0.0, 0.3, 0.0], gravity_x=[1.0, 1.0, 0.0, 1.0]
    )
    doubt = doubt_of(base, rows)
    # Straight on the diagonal two of four wheels stand.
    assert np.all(doubt[[0, 2, 3]] > 0.0)
    assert doubt[1] == 0.0
