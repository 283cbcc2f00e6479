"""Stretches of consecutive rows of a log."""

from __future__ import annotations

from dataclasses import replace

from tests.telemetry.rows import STEP, plain_log


def test_a_gap_in_time_starts_a_stretch_of_its_own():
    log = plain_log([10, 5])
    time = log.time.copy()
    time[6:10] += 20.0 * STEP
    assert replace(log, time=time).segments() == [(0, 6), (6, 10), (10, 15)]
    assert log.run_pieces() == [(0, 10), (10, 15)]
