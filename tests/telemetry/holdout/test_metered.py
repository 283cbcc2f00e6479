"""Meter and parameters are fitted together; a log without a meter has the fit without one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.holdout import (
    base_fit,
    heldout_residual,
    metered,
    metered_base_fit,
    rms,
)
from planner.telemetry.logs import Meter
from planner.telemetry.prediction import Readings, predict


def shown_by(meter, log, robot):
    settled = replace(log, power=predict(robot, log), meter=meter)
    scatter = 0.1 * np.random.default_rng(4).standard_normal(len(log))
    return replace(log, power=predict(robot, settled) + scatter, meter=None)


def test_parameters_behind_a_filter_are_those_without_it(motion, robot, base):
    _, plain = metered_base_fit(shown_by(None, motion, robot), base)
    log, found = metered_base_fit(shown_by(Meter(0.6), motion, robot), base)
    assert log.meter is not None
    assert abs(log.meter.time_constant_s - 0.6) < 0.09
    for one, other in zip(found.parameters, plain.parameters, strict=True):
        assert abs(one.value - other.value) < 4.0 * np.hypot(one.stderr, other.stderr)
    assert found.rmse_w == pytest.approx(0.1, rel=0.2)


def test_without_a_meter_the_fit_is_the_one_without(motion, robot, base):
    log = shown_by(None, motion, robot)
    metered, found = metered_base_fit(log, base)
    assert metered.meter is None
    np.testing.assert_array_equal(found.model.parameters, base_fit(log, base).model.parameters)


def test_quiet_rows_do_not_decide_what_a_model_misses(motion, robot, base):
    """Air drag is missing, and the meter is quiet where the robot hardly moves."""
    log = motion
    speed = np.hypot(log.rows[:, INDEX["vx"]], log.rows[:, INDEX["vy"]])
    rng = np.random.default_rng(5)
    scatter = (0.01 + 0.2 * speed) * rng.standard_normal(len(log))
    log = replace(log, power=predict(robot, log) + 12.0 * speed**3 + scatter)
    whitened, (_, found) = base_fit(log, base), metered_base_fit(log, base, (None,))
    assert found.noise.even_w > 0.0
    missed = rms(heldout_residual(log, found))
    assert missed < 0.95 * rms(heldout_residual(log, whitened))


def test_no_time_constant_is_longer_than_any_that_is_believed(motion, robot, base):
    """A power in kW is predicted better by every longer filter, without an end."""
    log, _ = metered_base_fit(replace(motion, power=predict(robot, motion) / 1000.0), base)
    assert log.meter is None or log.meter.time_constant_s <= Meter.LONGEST_LAG


def test_a_constant_power_shows_no_meter(motion, base):
    log, _ = metered_base_fit(replace(motion, power=np.full(len(motion), 5.3)), base)
    assert log.meter is None


def test_a_missing_effect_makes_no_filter_longer(motion, robot, base, monkeypatch):
    """What works in turns is blurred by a filter that is far too long: unseen runs are then
    predicted better without it, though not beside a plain shape."""
    meter = Meter(0.6)
    turning = np.abs(motion.rows[:, INDEX["wz"]])[:, None]
    extra = Readings.as_shown(replace(motion, meter=meter), 4.0 * turning / np.std(turning))
    log = shown_by(meter, motion, robot)
    log = replace(log, power=log.power + extra[:, 0])
    each = [metered_base_fit(log, base, (known,)) for known in (meter, Meter(2.4))]
    assert metered.overall_error(*each[1]) < metered.overall_error(*each[0])
    monkeypatch.setattr(metered, "TIME_CONSTANT_STEPS", (4.0,))
    found, _ = metered.predicting_best(base, *each[0])
    assert found.meter == meter


def test_a_held_reading_may_be_of_the_row_before(motion, robot, base):
    """Between two rows the power jumps: the likelihood may have a peak at either of them."""
    row = float(np.median(motion.interval))
    late, early = (
        Meter(delay_s=lag, sampling="held", period_s=3.0 * row) for lag in (0.9 * row, 0.0)
    )
    log = shown_by(late, motion, robot)
    at_first = metered_base_fit(log, base, (early,))
    moved, found = metered.predicting_best(base, *at_first)
    assert moved.meter.delay_s == pytest.approx(row)
    assert metered.overall_error(moved, found) < 0.7 * metered.overall_error(*at_first)
    # One that is right stays.
    right = metered_base_fit(log, base, (late,))
    assert metered.predicting_best(base, *right)[0].meter == late


@pytest.mark.parametrize("rows", [4.0, pytest.param(2.0, marks=pytest.mark.nightly)])
def test_an_even_mean_is_no_filter_and_a_filter_no_even_mean(motion, robot, base, rows):
    window = Meter(rows * float(motion.interval[0]), sampling="window")
    log, _ = metered_base_fit(shown_by(window, motion, robot), base)
    assert log.meter.sampling == "window"
    assert log.meter.time_constant_s == pytest.approx(window.time_constant_s, rel=0.1)
    assert "averages evenly" in log.meter.sentence
    behind, _ = metered_base_fit(shown_by(Meter(0.5 * rows), motion, robot), base)
    assert behind.meter.sampling != "window"


def test_where_rows_and_new_runs_disagree_a_time_constant_is_less_sure(motion, robot, base):
    """What rows are likeliest by is moved on purpose: half of the way is an error, too."""
    log, _ = metered_base_fit(shown_by(Meter(0.6), motion, robot), base)
    wrong = replace(log, meter=replace(log.meter, time_constant_s=0.3))
    fit = metered_base_fit(wrong, base, (wrong.meter,))
    moved, _ = metered.predicting_best(base, *fit)
    assert moved.meter.time_constant_s > 0.5
    assert moved.meter.time_constant_stderr_s > 0.5 * (moved.meter.time_constant_s - 0.3)
