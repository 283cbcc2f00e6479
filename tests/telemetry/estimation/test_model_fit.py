"""Fits give back the parameters that made the power, keep to bounds, and say what they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.prediction import predict
from tests.power.states import changed
from tests.telemetry.rows import TRUTH, measured, plain_log


def by_name(found):
    return {f"{p.effect}__{p.name}": p for p in found.parameters}


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


def test_an_effect_that_is_not_there_is_no_warning(motion, base):
    """Viscous drag that would have to give energy ends where it is absent."""
    model = PowerModel.from_vehicle(base.vehicle, effects=("viscous_drag",))
    pushed = changed(model, viscous_drag__viscous_torque=-2e-6)
    drag = by_name(fit(measured(motion, pushed, 0.02, seed=2), model))
    assert drag["viscous_drag__viscous_torque"].value == 0.0
    assert drag["viscous_drag__viscous_torque"].note == ""


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
