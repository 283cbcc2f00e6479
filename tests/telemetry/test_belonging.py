"""Runs, power and motion of a log that do not belong together are said, and never complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import compare, diagnose
from planner.quantities import INDEX
from planner.report.workbench_wording import how_far
from planner.telemetry.belonging import apart, beyond_motors
from planner.telemetry.prediction import predict
from tests.telemetry.rows import measured


def load_of_each_run(log, size):
    """W, (n,): what a load would add that no column tells."""
    runs = int(log.run.max()) + 1
    return size * np.linspace(-1.0, 1.0, runs)[np.random.default_rng(2).permutation(runs)][log.run]


def power_of_a_load(log, model, mass, runs):
    """W, (n,): what a load of so many kilograms adds in some runs."""
    rows = log.rows.copy()
    rows[:, INDEX["payload"]] += mass * np.isin(log.run, runs)
    return predict(model, replace(log, rows=rows)) - predict(model, log)


def test_noise_of_the_meter_is_no_difference_of_runs(motion, base):
    rng = np.random.default_rng(3)
    slow = np.convolve(rng.standard_normal(len(motion)), np.ones(10) / 3.0, "same")
    for noise in (rng.standard_normal(len(motion)), slow):
        assert apart(motion, noise, base) == ()


def test_runs_that_differ_as_a_whole_are_found(motion, base):
    noise = np.random.default_rng(4).standard_normal(len(motion))
    (said,) = apart(motion, noise + load_of_each_run(motion, 3.0), base)
    assert "whole runs differ" in said
    # An offset of a few hundredths of the power is what a weighed load is usually off by.
    assert apart(motion, 0.1 * (noise + load_of_each_run(motion, 3.0)), base) == ()


def test_a_load_is_found_that_draws_nothing_at_rest_and_gives_back_downhill(motion, base):
    """Half of what it draws has no mean in its run."""
    load = power_of_a_load(motion, base, 5.0, (2, 5, 9))
    noise = np.random.default_rng(4).standard_normal(len(motion))
    (said,) = apart(motion, load + noise, base)
    assert "whole runs differ" in said
    # What acts at the same motions in all runs alike is another mass of the data sheet.
    same = power_of_a_load(motion, base, 5.0, range(14))
    assert apart(motion, same + noise, base) == ()


def test_runs_at_rest_show_no_load(motion, base):
    rows = motion.rows.copy()
    rows[:, [INDEX[name] for name in ("vx", "vy", "wz", "ax", "ay", "yaw_acceleration")]] = 0.0
    noise = np.random.default_rng(4).standard_normal(len(motion))
    assert apart(replace(motion, rows=rows), noise, base) == ()


def test_a_log_whose_load_nobody_wrote_down_is_not_complete(motion, base):
    log = measured(motion, base, 0.02, seed=6, extra=load_of_each_run(motion, 4.0))
    found = diagnose(log, base)
    assert found.verdict != "complete"
    assert "from run to run" in found.sentence
    # What runs differ by is no noise: its floor is what was added.
    added = 0.02 * float(np.mean(np.abs(predict(base, motion))))
    assert found.baseline.noise_floor_w == pytest.approx(added, rel=0.25)
    assert "from run to run" in how_far(compare(log, base).to_json())


def test_a_power_that_does_not_follow_the_motion_is_not_complete(motion, base):
    power = np.random.default_rng(5).permutation(predict(base, motion))
    log = replace(motion, power=power)
    (said,) = apart(log, power - predict(base, motion), base)
    assert "how the power varies" in said
    found = diagnose(log, base)
    assert found.verdict != "complete"
    assert "how the power varies" in found.sentence


def test_a_power_that_stays_the_same_is_none_of_a_robot_that_drives(motion, base):
    watts = predict(base, motion)
    for scatter in (0.01, 0.0):
        power = watts.mean() + scatter * np.random.default_rng(6).standard_normal(len(motion))
        (said,) = apart(replace(motion, power=power), power - watts, base)
        assert "varies by" in said
        # A robot that stands needs such a power.
        assert apart(replace(motion, power=power), power - power.mean(), base) == ()
    found = diagnose(replace(motion, power=power), base)
    assert found.verdict == "not_identifiable"
    assert "varies by" in found.sentence
    assert "times the log's own noise" not in found.sentence


@pytest.mark.parametrize(("column", "factor"), [("vx", 3.6), ("wz", 57.3)])
def test_speeds_beyond_the_motors_are_in_another_unit(motion, base, column, factor):
    rows = motion.rows.copy()
    rows[:, INDEX[column]] *= factor
    (finding,) = beyond_motors(replace(motion, rows=rows), base)
    assert "another unit" in finding.sentence
    assert beyond_motors(motion, base) == ()


def test_a_power_beyond_the_motors_is_in_another_unit(motion, base):
    log = measured(motion, base, 0.02, seed=7)
    for factor, unit in ((1e3, "mW"), (1e-3, "kW")):
        (finding,) = beyond_motors(replace(log, power=factor * log.power), base)
        assert unit in finding.sentence
    assert beyond_motors(log, base) == ()


@pytest.mark.parametrize(
    ("factor", "unit", "rows"),
    [(1e-3, "kW", 440), pytest.param(1e3, "mW", 1540, marks=pytest.mark.nightly)],
)
def test_another_unit_is_said_and_nothing_is_claimed(motion, base, factor, unit, rows):
    log = measured(motion.take(slice(0, rows)), base, 0.02, seed=7)
    found = diagnose(replace(log, power=factor * log.power), base)
    said = found.sentence.split(". ")
    (place,) = [k for k, one in enumerate(said) if f"another unit, such as {unit}" in one]
    assert place <= 1
    assert found.verdict == "not_identifiable"
    assert not found.proposed
    assert not found.sensors


def test_a_log_too_short_to_show_an_effect_says_so(motion, base):
    """An effect that cannot be tested changes no verdict, so the sentence has to tell."""
    found = diagnose(measured(motion.take(slice(0, 12)), base, 0.02, seed=1), base)
    assert found.verdict == "complete"
    assert "Nothing is missing" not in found.sentence
    assert "too short or too uniform" in found.sentence
