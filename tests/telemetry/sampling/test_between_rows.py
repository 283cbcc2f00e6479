"""Between two rows the speed changes evenly: its acceleration is their difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.between_rows import with_averaged_motion, with_motion_between
from tests.telemetry.rows import STEP, plain_log

RATE, TURN = 0.3, 0.4


@pytest.fixture
def speeding():
    """Two runs, each at an even rate of change of all three speeds as they are read."""
    log = plain_log([12, 9])
    rows = log.rows.copy()
    for name, start, rate in (("vx", 0.1, RATE), ("vy", -0.2, 0.1), ("wz", 0.0, TURN)):
        rows[:, INDEX[name]] = start + rate * log.time
    return replace(log, rows=rows)


def values(log, name):
    return log.rows[:, INDEX[name]]


def test_an_even_change_is_exact(speeding):
    log = with_motion_between(speeding)
    inside = np.setdiff1d(np.arange(len(log)), [11, 20])
    at = speeding.time[inside] + 0.5 * STEP
    assert values(log, "vx")[inside] == pytest.approx(0.1 + RATE * at)
    assert values(log, "wz")[inside] == pytest.approx(TURN * at)
    assert values(log, "yaw_acceleration")[inside] == pytest.approx(TURN)
    # A body that turns feels the turning of its speeds, too.
    felt = RATE - TURN * at * (-0.2 + 0.1 * at)
    assert values(log, "ax")[inside] == pytest.approx(felt)


def test_the_last_row_of_a_run_stays(speeding):
    log = with_motion_between(speeding)
    assert np.array_equal(log.rows[[11, 20]], speeding.rows[[11, 20]], equal_nan=True)
    assert np.array_equal(log.power, speeding.power)


def test_what_was_measured_is_the_mean_of_both_rows(speeding):
    rows = speeding.rows.copy()
    rows[:, INDEX["ax"]] = np.arange(len(rows)) ** 2
    log = replace(speeding, rows=rows, present=speeding.present | {"ax"})
    assert values(with_motion_between(log), "ax")[3] == pytest.approx(0.5 * (9 + 16))


def test_short_rows_have_no_motion_between_them(speeding):
    short = replace(speeding, time=speeding.time / 20, interval=speeding.interval / 20)
    assert not any(motion.reading.ahead for motion in open_source(short).motions())
    between, *_ = open_source(speeding).motions()
    assert between.reading.ahead
    assert between.content != open_source(speeding).steady().content


def test_an_average_over_neighbours_leaves_an_even_change(speeding):
    log = with_averaged_motion(speeding)
    assert values(log, "vx") == pytest.approx(values(speeding, "vx"))
    assert np.array_equal(log.rows[[0, 11]], speeding.rows[[0, 11]], equal_nan=True)
    shaken = speeding.rows.copy()
    shaken[5, INDEX["vx"]] += 0.4
    mean = values(with_averaged_motion(replace(speeding, rows=shaken)), "vx")
    assert mean[4:7] - values(speeding, "vx")[4:7] == pytest.approx([0.1, 0.2, 0.1])
