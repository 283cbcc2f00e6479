"""Rows that arrive in bunches stand where they were measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.sampling.even_clock import with_even_clock
from tests.hidden_effects.laboratory.instruments import arrivals
from tests.telemetry.rows import STEP, plain_log

RATE = 0.3


def bunched(time: np.ndarray, seed: int) -> np.ndarray:
    """Moments of arrival of samples."""
    return arrivals(np.random.default_rng(seed), time)


@pytest.fixture
def speeding():
    """Two runs that speed up evenly, the first of which loses 20 rows."""
    log = plain_log([420, 300]).take(np.r_[0:200, 220:720])
    rows = log.rows.copy()
    rows[:, INDEX["vx"]] = RATE * log.time
    return replace(log, rows=rows)


def arrived(log, seed=1):
    times = [bunched(log.time[start:stop], seed) for start, stop in log.run_pieces()]
    return replace(log, time=np.concatenate(times))


def test_bunches_are_taken_apart(speeding):
    late = arrived(speeding)
    assert late.has_uneven_clock()
    even = with_even_clock(late)
    inside = np.abs(np.diff(even.time) - np.diff(speeding.time)) < 0.01 * STEP
    assert inside.mean() > 0.98
    assert np.median(even.rows[:, INDEX["ax"]]) == pytest.approx(RATE, rel=1e-3)
    assert even.rows[100:150, INDEX["ax"]] == pytest.approx(RATE, rel=1e-2)


def test_lost_rows_stay_lost(speeding):
    even = with_even_clock(arrived(speeding))
    assert even.time[200] - even.time[199] == pytest.approx(21 * STEP, rel=0.01)
    assert even.interval == pytest.approx(STEP, rel=0.5)
    assert len(even.segments()) == 3


def test_an_even_clock_is_one(speeding):
    assert not speeding.has_uneven_clock()
    assert with_even_clock(speeding).time == pytest.approx(speeding.time)


def test_measured_accelerations_and_short_runs_stay(speeding):
    measured = replace(arrived(speeding), present=speeding.present | {"ax"})
    assert np.all(with_even_clock(measured).rows[:, INDEX["ax"]] == 0.0)
    short = plain_log([12, 9])
    assert with_even_clock(short) is None
    assert not short.has_uneven_clock()
