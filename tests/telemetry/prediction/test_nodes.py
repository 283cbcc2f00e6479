"""A row of a log is a mean over its interval: the moments that stand for it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.rows import rows_from
from planner.quantities import INDEX
from planner.telemetry.prediction.nodes import MOMENTS, interval_nodes
from planner.telemetry.prediction.sensitivity import predict
from tests.power.states import random_columns
from tests.telemetry.rows import base_model

ROWS = rows_from(**random_columns(400, seed=5))


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
    by_nodes = predict(base, interval_nodes(rows, np.full(len(rows), interval), base))
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
