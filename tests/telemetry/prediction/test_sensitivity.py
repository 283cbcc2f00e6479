"""Derivatives of a model's power along a log, and rows that stand for an interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.rows import rows_from
from planner.telemetry.prediction.nodes import interval_nodes
from planner.telemetry.prediction.sensitivity import (
    UNSURE_RIM_SPEED,
    differences,
    input_uncertainty,
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


def test_reduced_power_is_the_full_model_bit_by_bit(model):
    np.testing.assert_array_equal(predict(model, steady_nodes(model, ROWS)), model.watts(ROWS))


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
    watts = predict(model, steady_nodes(model, many))
    np.testing.assert_array_equal(watts, np.tile(model.watts(ROWS), 25))


def test_prediction_of_a_log_conserves_its_order(motion, base):
    whole = predict(base, motion)
    some = np.array([5, 700, 11, 1200])
    np.testing.assert_array_equal(predict(base, motion.take(some)), whole[some])


def test_only_rows_with_a_slow_wheel_are_doubtful():
    base = base_model()
    rows = rows_from(
        vx=[0.0, 0.3, 0.3, UNSURE_RIM_SPEED / 2.0],
        vy=[0.0, 0.0, 0.3, 0.0],
        gravity_x=[1.0, 1.0, 0.0, 1.0],
    )
    input_error = input_uncertainty(base, rows)
    # Straight on the diagonal two of four wheels stand.
    assert np.all(input_error[[0, 2, 3]] > 0.0)
    assert input_error[1] == 0.0
