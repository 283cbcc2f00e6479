"""Rows of a slow meter's readings: found by their period where noise makes all rows differ."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from planner.telemetry.prediction.held_readings import held_rows, is_rounded, periods_of

ROW = 0.5  # s, of the rows of ``motion``


def held(log, period: float, phases, noise: float, seed: int = 4):
    """A power that wanders, read every ``period`` s; noise comes after that. And the readings."""
    rng = np.random.default_rng(seed)
    power, number = np.empty(len(log)), np.empty(len(log))
    for k, (start, stop) in enumerate(log.run_pieces()):
        time = log.time[start:stop]
        number[start:stop] = np.floor((time - phases[k % len(phases)]) / period + 1e-6)
        fine = np.cumsum(rng.standard_normal(10 * (stop - start) + 100)) * 3.0
        begun = number[start:stop] - number[start]
        power[start:stop] = fine[(begun * period / ROW * 10.0).astype(int)]
    watts = 30.0 + power + noise * rng.standard_normal(len(log))
    number += 1000.0 * log.run
    return replace(log, power=watts), number


@pytest.mark.parametrize(
    ("rows", "phases"),
    [*product([2.0, 3.0, 5.0, 2.6], [(0.1,), (0.1, 0.4, 0.9)]), (10.0, (0.1,))],
)
def test_a_period_is_found_behind_noise(motion, rows, phases):
    """The changes are twenty times the noise's; runs may have phases of their own."""
    log, number = held(motion, rows * ROW, phases, noise=1.0)
    periods = periods_of(log)
    near = [p for p in periods if abs(p / (rows * ROW) - 1.0) < 2e-3]
    assert near
    found = held_rows(log, near[0])
    first = np.flatnonzero(np.diff(number, prepend=-1.0))
    expected = np.maximum.accumulate(np.isin(np.arange(len(log)), first) * np.arange(len(log)))
    assert np.mean(found == expected) > 0.95


def test_a_meter_as_fast_as_the_log_has_no_period(motion):
    rng = np.random.default_rng(7)
    for noise in (0.1, 3.0):
        scatter = noise * rng.standard_normal(len(motion))
        log = replace(motion, power=np.cumsum(rng.standard_normal(len(motion))) + scatter)
        assert periods_of(log) == ()


def test_equal_readings_of_rounding_are_told_from_held_ones(motion):
    """A slow power written to 1 W repeats itself, and so does one that is held for five rows."""
    slow = 30.0 + 5.0 * np.sin(motion.time / 20.0)
    rounded = replace(motion, power=np.round(slow))
    repeated, _ = held(motion, 5.0 * ROW, (0.0,), noise=0.0)
    assert is_rounded(rounded)
    assert not is_rounded(replace(repeated, power=np.round(repeated.power, 2)))
    assert is_rounded(replace(motion, power=np.full(len(motion), 7.0)))


def test_rows_and_logs_too_short_for_a_period(motion):
    for rows in (0, 1, 5, 19):
        log = motion.take(slice(0, rows))
        assert periods_of(log) == ()
        assert held_rows(log, 1.0).shape == (rows,)


def test_a_gap_of_years_in_a_run_takes_no_memory(motion):
    """What comes after it is left out: the period is found from the rows before."""
    log, _ = held(motion, 3.0 * ROW, (0.1,), noise=1.0)
    runs = log.run_pieces()
    later = [stop - 2 for start, stop in runs if stop - start > 20]
    time = log.time.copy()
    for row, (_, stop) in zip(later, runs, strict=False):
        time[row:stop] += 1e8
    found = periods_of(replace(log, time=time))
    assert any(abs(p / (3.0 * ROW) - 1.0) < 2e-3 for p in found)
