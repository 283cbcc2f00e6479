"""Fits give back the parameters that made the power, keep to bounds, and say what they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.vehicle import load_vehicle
from planner.quantities import INDEX
from planner.telemetry.fit import fit, starting_model
from planner.telemetry.heldout import fold_numbers, heldout_rmse, rms
from planner.telemetry.sensitivity import predict
from tests.power.states import changed
from tests.telemetry.rows import measured, plain_log

TRUTH = {
    "electronics__power": 6.1,
    "inertia__yaw_inertia": 1.2,
    "wheel_rolling__rolling": 0.041,
    "roller_drag__roller": 0.038,
    "roller_drag__roller_viscous": 0.01,
    "gear_loss__efficiency": 0.77,
    "copper_loss__resistance": 4.4,
    "coulomb_drag__coulomb_torque": 0.0036,
}


@pytest.fixture(scope="module")
def robot(base):
    """A robot of the same kind with other parameters."""
    return changed(base, **TRUTH)


@pytest.fixture(scope="module")
def noisy(motion, robot, base):
    """A log with 2 % of noise, and the fit to it."""
    log = measured(motion, robot, 0.02, seed=5)
    return log, fit(log, base)


def by_name(found):
    return {f"{p.effect}__{p.name}": p for p in found.parameters}


def refitted_without_each_fold(log, model, **how):
    """(n,) W, measured less predicted by a fit that has not seen the fold."""
    number, _ = fold_numbers(log)
    left = np.empty(len(log))
    for fold in np.unique(number):
        out = number == fold
        found = fit(log.take(~out), model, **how)
        left[out] = log.power[out] - predict(found.model, log.take(out))
    return left


def test_exact_power_gives_the_parameters_back(motion, robot, base):
    found = fit(replace(motion, power=predict(robot, motion)), base)
    assert found.rmse_w < 1e-4
    fitted = by_name(found)
    assert set(TRUTH) <= set(fitted)
    for name, value in TRUTH.items():
        assert fitted[name].value == pytest.approx(value, rel=1e-3), name
        assert fitted[name].identifiable, name


def test_noisy_power_gives_them_back_within_their_errors(noisy):
    log, found = noisy
    fitted = by_name(found)
    for name, value in TRUTH.items():
        assert abs(fitted[name].value - value) < 4.0 * fitted[name].stderr, name
        # The error that is claimed is no excuse either.
        usual = max(abs(value), 0.02)
        assert fitted[name].stderr < usual, name
    assert found.residual == pytest.approx(log.power - predict(found.model, log))
    assert found.rmse_w == pytest.approx(found.noise.floor_w, rel=0.1)


def test_errors_of_parameters_are_the_scatter_over_repetitions(motion, robot, base):
    names = ("electronics__power", "wheel_rolling__rolling", "copper_loss__resistance")
    values, errors = [], []
    for seed in range(16):
        fitted = by_name(fit(measured(motion, robot, 0.02, seed=100 + seed), base))
        values.append([fitted[name].value for name in names])
        errors.append([fitted[name].stderr for name in names])
    ratio = np.std(values, axis=0, ddof=1) / np.mean(errors, axis=0)
    # The standard deviation of 16 draws is known to 18 %.
    assert np.all((ratio > 0.5) & (ratio < 1.6)), ratio


def test_outliers_do_not_move_the_fit(noisy, base):
    log, clean = noisy
    random = np.random.default_rng(8)
    hit = random.random(len(log)) < 0.05
    size = random.choice([-1.0, 1.0], len(log)) * random.uniform(10.0, 40.0, len(log))
    dirty = fit(replace(log, power=log.power + hit * size), base)
    before, after = by_name(clean), by_name(dirty)
    for name in TRUTH:
        moved = abs(after[name].value - before[name].value)
        assert moved < 2.0 * before[name].stderr, name


def test_parameters_stay_in_their_physical_range(motion, base):
    # Rollers that give energy do not exist; what would need them ends at the bound.
    pushed = changed(base, roller_drag__roller=-0.01)
    found = fit(measured(motion, pushed, 0.02, seed=2), base)
    for parameter, (_, _, declared, _) in zip(
        found.parameters, [base.slots[place] for place in found.places], strict=True
    ):
        low, high = declared.bounds
        assert low <= parameter.value <= high, parameter.name
    roller = by_name(found)["roller_drag__roller"]
    assert roller.value == 0.0
    assert "physical range" in roller.note


def test_what_a_log_does_not_show_is_marked(base, robot):
    # Straight ahead at constant speeds on level ground: no inertia, and a gear that only drives.
    log = plain_log([80] * 8)
    rows = log.rows.copy()
    rows[:, INDEX["vx"]] = np.random.default_rng(3).uniform(0.1, 0.8, len(log))
    found = fit(measured(replace(log, rows=rows), robot, 0.01, seed=4), base)
    fitted = by_name(found)
    for name in ("inertia__yaw_inertia", "inertia__wheel_inertia"):
        assert not fitted[name].identifiable, name
        assert fitted[name].note
        place = next(k for k, s in enumerate(base.slots) if f"{s[0].slug}__{s[1]}" == name)
        assert fitted[name].value == pytest.approx(base.parameters[place], rel=1e-6)
    assert fitted["electronics__power"].identifiable
    # What the parameters do together is known all the same.
    assert found.rmse_w < 1.1 * found.noise.floor_w


def test_only_free_parameters_change(noisy, base):
    log, _ = noisy
    found = fit(log, base, free=[0])
    assert found.places == (0,)
    np.testing.assert_array_equal(found.model.parameters[1:], base.parameters[1:])
    assert found.model.parameters[0] != base.parameters[0]


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


def test_useless_parameters_cost_heldout_error(motion, base, robot):
    # Few rows: what a fit with many parameters gains on them it loses on others.
    log = measured(motion.take(np.arange(0, len(motion), 11)), robot, 0.3, seed=6)
    few, many = fit(log, base, free=[0, 4]), fit(log, base)
    assert many.rmse_w < few.rmse_w
    assert heldout_rmse(log, many) - many.rmse_w > heldout_rmse(log, few) - few.rmse_w


def test_folds_keep_runs_together():
    number, by_run = fold_numbers(plain_log([7, 30, 2, 9, 9, 40, 1]))
    log = plain_log([7, 30, 2, 9, 9, 40, 1])
    assert by_run
    assert set(number) == set(range(5))
    for run in range(7):
        assert len(set(number[log.run == run])) == 1
    number, by_run = fold_numbers(plain_log([200, 100]))
    assert not by_run
    assert set(number) == set(range(5))


def test_a_comparison_starts_from_a_vehicle_or_a_model(base, robot):
    assert starting_model(robot) is robot
    for given in ("minibalance", load_vehicle("minibalance")):
        start = starting_model(given)
        assert all(effect.base for effect in start.effects)
        np.testing.assert_array_equal(start.parameters, base.parameters)
