"""Readings of a motion: which there are, and that each changes the motion alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.motion_reading import AS_LOGGED, USUAL, readings_for
from tests.telemetry.rows import plain_log


@pytest.mark.parametrize(("interval", "rows"), [(0.5, [4]), (0.1, [4, 8]), (0.02, [4, 0, 10, 40])])
def test_short_rows_are_read_in_several_ways(interval, rows):
    """Four rows are a drive that lasts, or shorter than a motor needs to change a speed.

    Where noise lasts for some rows, a drive is steady for as many times four.
    """
    log = replace(plain_log([30, 30]), interval=np.full(60, interval))
    readings = open_source(log).readings()
    assert [one.reading.steady_rows for one in readings] == rows


def test_short_rows_are_read_in_ramps_and_smoothed_too():
    log = plain_log([200, 200])
    log = replace(log, time=np.tile(np.arange(200) / 50.0, 2), interval=np.full(400, 0.02))
    rows = log.rows.copy()
    rows[:, INDEX["vx"]] = 0.5 + 0.004 * np.random.default_rng(1).standard_normal(400)
    log = replace(log, rows=rows)
    readings = readings_for(log)
    assert readings[0] == USUAL
    assert not USUAL.is_unusual
    assert all(one.is_unusual for one in readings[1:])
    assert AS_LOGGED in readings
    assert len(set(readings)) == len(readings)
    for ramps, widths in ((True, [0.2]), (False, [0.1, 0.2])):
        kinds = [one for one in readings if one.ramps == ramps and one.half_width]
        found = sorted((one.steady_rows, one.half_width) for one in kinds)
        assert found == [(rows, width) for rows in (0, 10) for width in widths]
    moved = [INDEX[name] for name in ("vx", "vy", "wz", "ax", "ay", "yaw_acceleration")]
    others = np.setdiff1d(np.arange(rows.shape[1]), moved)
    for reading in readings:
        read = reading.of(log)
        np.testing.assert_allclose(read.rows[:, others], rows[:, others], atol=1e-12)
        assert read.rows[:, INDEX["vx"]].mean() == pytest.approx(0.5, abs=0.001)
