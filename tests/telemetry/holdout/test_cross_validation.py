"""Errors on runs left out, by one step, are those of fits to what each fold leaves."""

from __future__ import annotations

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.holdout.heldout import fold_numbers, heldout_rmse, rms
from planner.telemetry.prediction import predict
from tests.power.states import changed
from tests.telemetry.rows import measured, plain_log


def refitted_without_each_fold(log, model, **how):
    """(n,) W, measured less predicted by a fit that has not seen the fold."""
    number = fold_numbers(log)
    left = np.empty(len(log))
    for fold in np.unique(number):
        out = number == fold
        found = fit(log.take(~out), model, **how)
        left[out] = log.power[out] - predict(found.model, log.take(out))
    return left


def test_heldout_error_is_that_of_refitting(noisy, base):
    log, found = noisy
    refitted = rms(refitted_without_each_fold(log, base, noise=found.noise))
    assert heldout_rmse(log, found) == pytest.approx(refitted, rel=0.02)
    assert refitted > found.rmse_w


def test_what_next_to_no_row_tells_does_not_move_the_runs_left_out(base):
    # Straight ahead the rollers stand. One row, driven askew, shows their drag; a second one, in
    # another run, would say it with a thousandth of the leverage and all of its noise.
    rows = np.tile(plain_log([1]).rows, (400, 1))
    rows[:, INDEX["vx"]] = np.random.default_rng(3).uniform(0.1, 0.8, 400)
    rows[37, INDEX["vy"]] = 0.02
    rows[237, INDEX["vy"]] = 1e-5
    log = measured(plain_log([40] * 10, rows), base, 0.01, seed=4)
    log.power[237] += 0.3
    found = fit(log, base)
    assert heldout_rmse(log, found) < 1.2 * rms(refitted_without_each_fold(log, base))
    assert heldout_rmse(log, found) < 1.5 * found.rmse_w


@pytest.mark.parametrize("begun", [0.0, 20.0])
def test_a_part_that_is_not_there_costs_what_refitting_costs(begun, motion, base):
    # Begun large and found near nothing, it was pulled back as if it were known to be large.
    model = changed(base, roller_drag__roller_viscous=begun)
    log = measured(motion, base, 0.3, seed=7)
    found = fit(log, model)
    refitted = rms(refitted_without_each_fold(log, model, noise=found.noise))
    assert heldout_rmse(log, found) == pytest.approx(refitted, rel=0.02)


def test_useless_parameters_cost_heldout_error(motion, base, robot):
    # Few rows: what a fit with many parameters gains on them it loses on others.
    log = measured(motion.take(np.arange(0, len(motion), 11)), robot, 0.3, seed=6)
    few, many = fit(log, base, free=[0, 4]), fit(log, base)
    assert many.rmse_w < few.rmse_w
    assert heldout_rmse(log, many) - many.rmse_w > heldout_rmse(log, few) - few.rmse_w


def test_folds_keep_runs_together():
    log = plain_log([7, 30, 2, 9, 9, 40, 1])
    number = fold_numbers(log)
    assert set(number) == set(range(5))
    for run in range(7):
        assert len(set(number[log.run == run])) == 1
    number = fold_numbers(plain_log([200, 100]))
    assert set(number) == set(range(5))
