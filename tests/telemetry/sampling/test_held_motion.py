"""Speeds and angles that a recorder held stand between their updates; set-points stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of
from planner.telemetry.sampling.held_motion import (
    ATTITUDE,
    holds_of,
    with_motion_between_updates,
)
from tests.telemetry.rows import STEP, plain_log

HELD = 4
SHORT = 0.1
"""s, the longest row of which four are no set-point."""


def swinging(columns, noise=0.0):
    """Two runs of a motion that swings within seconds, the accelerations as they follow."""
    log = plain_log([420, 300])
    time = log.time * SHORT / STEP
    log = replace(log, time=time, interval=np.full(len(log), SHORT))
    rows, rng = log.rows.copy(), np.random.default_rng(3)
    for number, name in enumerate(columns):
        rows[:, INDEX[name]] = np.sin((0.7 + 0.3 * number) * time)
        rows[:, INDEX[name]] += noise * rng.standard_normal(len(log))
    return accelerated(replace(log, rows=rows))


def accelerated(log):
    """Accelerations, and changes of the slope, as they follow."""
    rows = log.rows.copy()
    x, y, normal = (rows[:, INDEX[name]] for name in ATTITUDE)
    slope = np.arctan2(np.hypot(x, y), normal)
    rows[:, INDEX["slope_rate"]] = np.abs(slopes_of(log, slope[:, None])[:, 0])
    speeds = rows[:, [INDEX[name] for name in SPEEDS]]
    put_accelerations(log, rows, np.arange(len(log)), slopes_of(log, speeds))
    return replace(log, rows=rows)


def held(log, columns, rows=HELD):
    at = np.concatenate(
        [start + np.arange(stop - start) // rows * rows for start, stop in log.segments()]
    )
    values = log.rows.copy()
    places = [INDEX[name] for name in columns]
    values[:, places] = values[at][:, places]
    return accelerated(replace(log, rows=values))


def between(log):
    return with_motion_between_updates(log, holds_of(log))


def off(log, true, name):
    return float(np.abs(log.rows[:, INDEX[name]] - true.rows[:, INDEX[name]]).mean())


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_speeds_and_accelerations_are_nearer_to_the_truth(noise):
    true = swinging(SPEEDS)
    late = held(swinging(SPEEDS, noise), SPEEDS)
    found = between(late)
    for name in (*SPEEDS, "ax", "ay", "yaw_acceleration"):
        assert off(found, true, name) < 0.2 * off(late, true, name)
    assert found.time is late.time


def test_held_angles_are_taken_between_their_updates_and_speeds_stay():
    true = swinging((*SPEEDS, *ATTITUDE[:2]))
    late = held(true, ATTITUDE)
    found = between(late)
    for name in (*ATTITUDE[:2], "slope_rate"):
        assert off(found, true, name) < 0.1 * off(late, true, name)
    for name in (*SPEEDS, "ax"):
        assert off(found, true, name) < 1e-12


def test_updates_that_come_a_row_early_or_late_are_seen():
    true = swinging(SPEEDS)
    at = np.minimum(np.arange(0, len(true), 5) + np.random.default_rng(2).integers(0, 2, 144), 719)
    source = at[np.searchsorted(at, np.arange(len(true)), side="right") - 1]
    rows = true.rows.copy()
    places = [INDEX[name] for name in SPEEDS]
    rows[:, places] = rows[source][:, places]
    late = accelerated(replace(true, rows=rows))
    found = between(late)
    assert off(found, true, "ax") < 0.2 * off(late, true, "ax")


def test_runs_and_gaps_part_updates():
    true = swinging(SPEEDS).take(np.r_[0:200, 260:720])
    late = held(true, SPEEDS)
    found = between(late)
    for start, stop in true.segments():
        assert np.abs(found.rows[stop - HELD : stop] - late.rows[stop - HELD : stop])[
            :, INDEX["vx"]
        ].max() == pytest.approx(0.0, abs=1e-12)
        assert found.rows[start, INDEX["vx"]] == late.rows[start, INDEX["vx"]]


def test_a_stand_stays_a_stand():
    true = swinging(SPEEDS)
    rows = true.rows.copy()
    rows[100:160, [INDEX[name] for name in SPEEDS]] = 0.0
    found = between(held(accelerated(replace(true, rows=rows)), SPEEDS))
    assert np.all(found.rows[112:152, INDEX["vx"]] == 0.0)


@pytest.mark.parametrize("rows", [1, 8])
def test_rows_with_values_of_their_own_and_slow_set_points_stay(rows):
    assert holds_of(held(swinging(SPEEDS), SPEEDS, rows)) == (0.0, 0.0)


def test_set_points_of_an_operator_stay():
    true = swinging(SPEEDS)
    begins = np.sort(np.random.default_rng(5).choice(720, 240, replace=False))
    source = begins[np.maximum(np.searchsorted(begins, np.arange(720), side="right") - 1, 0)]
    assert holds_of(replace(true, rows=true.rows[source])) == (0.0, 0.0)


def test_coarse_values_of_a_slow_motion_stay():
    true = swinging(SPEEDS)
    rows = true.rows.copy()
    rows[:, INDEX["vx"]] = np.round(rows[:, INDEX["vx"]], 1)
    rows[:, [INDEX["vy"], INDEX["wz"]]] = 0.0
    assert holds_of(replace(true, rows=rows)) == (0.0, 0.0)


@pytest.mark.parametrize("count", [400, 401, 403])
def test_two_rows_and_a_half_for_each_update_are_seen(count):
    true = swinging(SPEEDS).take(slice(0, count))
    first = np.ceil(np.floor(np.arange(count) / 2.5) * 2.5).astype(int)
    rows = true.rows.copy()
    places = [INDEX[name] for name in SPEEDS]
    rows[:, places] = rows[first][:, places]
    late = accelerated(replace(true, rows=rows))
    assert 2.0 <= holds_of(late)[0] <= 3.0
    assert off(between(late), true, "ax") < 0.3 * off(late, true, "ax")


def test_unknown_angles_and_stretches_of_two_updates():
    true = swinging((*SPEEDS, *ATTITUDE[:2]))
    late = held(held(true, ATTITUDE), SPEEDS)
    rows = late.rows.copy()
    rows[40, INDEX["gravity_x"]] = np.nan
    kept = np.r_[0:200, 208:214, 260:720]
    odd = replace(late, rows=rows).take(kept)
    assert holds_of(odd)[1] == 0.0
    found = with_motion_between_updates(odd, (4.0, 4.0))
    assert np.isfinite(found.rows[:, [INDEX[name] for name in SPEEDS]]).all()
    assert off(found, true.take(kept), "vx") < 0.2 * off(odd, true.take(kept), "vx")


def test_no_speed_swings_to_the_other_side():
    true = swinging(SPEEDS)
    rows = true.rows.copy()
    rows[:, INDEX["vx"]] = np.maximum(rows[:, INDEX["vx"]], 0.0)
    found = between(held(accelerated(replace(true, rows=rows)), SPEEDS))
    assert found.rows[:, INDEX["vx"]].min() == 0.0
