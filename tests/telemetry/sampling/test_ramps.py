"""Speeds of straight ramps: jumps of the acceleration stay sharp, noise averages out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.ramps import (
    LEAST_PIECE_ROWS,
    PIECE_GAIN,
    straight_pieces,
    with_ramps,
)
from planner.telemetry.sampling.smoothed_motion import with_smoothed_motion
from tests.telemetry.rows import plain_log

RATE = 50.0
"""Hz."""
NOISE = 0.004
"""m/s, of the odometry."""
TIME = np.arange(1000) / RATE
CORNERS = [0.0, 2.0, 4.0, 9.0, 10.5, 14.0, 20.0]
"""s; where a controller changes its acceleration."""


def fast(**columns: np.ndarray) -> Telemetry:
    """Two runs of 1000 rows at RATE, with some quantities."""
    log = plain_log([1000, 1000])
    rows = log.rows.copy()
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    return replace(log, rows=rows, time=np.tile(TIME, 2), interval=np.full(2000, 1.0 / RATE))


def column(log: Telemetry, name: str) -> np.ndarray:
    return log.rows[:, INDEX[name]]


def trapezoids() -> np.ndarray:
    """(1000,) m/s with six accelerations."""
    return np.interp(TIME, CORNERS, [0.1, 0.1, 0.7, 0.7, 0.3, 0.3, 0.9])


def driven(seed: int = 1) -> tuple[Telemetry, Telemetry]:
    """Ramps in both axes as they are, and as odometry with noise sees them."""
    vx = np.tile(trapezoids(), 2)
    clean = fast(vx=vx, vy=0.5 * vx)
    noise = NOISE * np.random.default_rng(seed).standard_normal((3, 2000))
    return clean, fast(vx=vx + noise[0], vy=0.5 * vx + noise[1], wz=noise[2])


def accelerations_of(vx: np.ndarray) -> np.ndarray:
    """Of the row before, and of the row after: at a corner either is right."""
    slopes = np.diff(vx) * RATE
    return np.stack([np.append(slopes[:1], slopes), np.append(slopes, slopes[-1:])])


def test_accelerations_jump_where_a_parabola_blurs_them():
    _, seen = driven()
    true = np.tile(accelerations_of(trapezoids()), 2)
    errors = {}
    for name, read in (
        ("ramps", with_ramps(seen, seen)),
        ("parabolas", with_smoothed_motion(seen, 0.2)),
    ):
        off = np.abs(column(read, "ax") - true).min(axis=0)
        errors[name] = float(np.sqrt(np.mean(off**2)))
    assert errors["ramps"] < 0.1 * errors["parabolas"]


def test_noise_averages_over_whole_pieces():
    clean, seen = driven()
    read = with_ramps(seen, seen)
    for name in ("vx", "vy", "wz"):
        assert (column(read, name) - column(clean, name)).std() < 0.35 * NOISE


def test_noise_alone_begins_hardly_a_piece():
    pieces = 0
    for seed in range(5):
        noise = NOISE * np.random.default_rng(seed).standard_normal((3, 2000))
        still = fast(vx=0.5 + noise[0], vy=noise[1], wz=noise[2])
        slopes = column(with_ramps(still, still), "yaw_acceleration")
        pieces += int((np.diff(slopes) != 0.0).sum())
    # Two runs of each log have one border each, as pieces are at most so long, and one between.
    assert pieces <= 5 * 3 + 5


def test_lines_meet_within_a_run_and_not_between_runs():
    _, seen = driven()
    read = with_ramps(seen, seen)
    vx, ax = column(read, "vx"), column(read, "ax")
    turning = column(read, "wz") * column(read, "vy")
    rate = ax + turning
    steps = np.diff(vx[:1000])
    low = np.minimum(rate[:999], rate[1:1000]) / RATE - 1e-9
    high = np.maximum(rate[:999], rate[1:1000]) / RATE + 1e-9
    assert np.all((steps >= low) & (steps <= high))
    jump = np.repeat([0.3, 0.8], 1000)
    assert np.allclose(column(with_ramps(fast(vx=jump), fast(vx=jump)), "vx"), jump)


def test_accelerations_are_those_of_a_turning_body():
    vx = np.tile(trapezoids(), 2)
    log = fast(vx=vx, wz=np.full(2000, 0.5))
    read = with_ramps(log, log)
    assert np.allclose(column(read, "ay"), 0.5 * column(read, "vx"), atol=1e-6)
    # Measured ones are at their mean over a piece, without the turning.
    noise = 0.1 * np.random.default_rng(5).standard_normal(2000)
    seen = fast(vx=vx, wz=np.full(2000, 0.5), ay=0.2 + 0.5 * vx + noise)
    read = with_ramps(replace(seen, present=seen.present | {"ay"}), seen)
    rest = column(read, "ay") - 0.5 * column(read, "vx")
    assert rest.mean() == pytest.approx(0.2, abs=0.01)
    assert rest.std() < 0.2 * 0.1


@pytest.mark.parametrize("rate", [50.0, 10.0])
def test_a_change_from_one_row_to_the_next_stays_one(rate):
    vx = np.tile(np.where(TIME < 8.0, 0.3, 0.8), 2)
    noise = NOISE * np.random.default_rng(3).standard_normal((3, 2000))
    seen = fast(vx=vx + noise[0], vy=noise[1], wz=noise[2])
    seen = replace(
        seen, time=np.tile(np.arange(1000) / rate, 2), interval=np.full(2000, 1.0 / rate)
    )
    read = with_ramps(seen, seen)
    assert np.abs(column(read, "vx") - vx).max() < 4.0 * NOISE
    change = column(read, "ax")[np.flatnonzero(np.diff(vx[:1000]))[0] + 1]
    assert change == pytest.approx(0.5 * rate, rel=0.05)


def test_steps_of_coarse_encoders_are_no_ramps():
    vx = np.tile(np.interp(TIME, [0.0, 10.0, 20.0], [0.1, 0.6, 0.1]), 2)
    step = 0.01
    read = with_ramps(*2 * [fast(vx=step * np.round(vx / step))])
    bends = np.diff(column(read, "ax")[:1000]) != 0.0
    assert bends.sum() <= 3  # one is true, and a piece has at most 500 rows
    assert np.abs(column(read, "vx") - vx).max() < 0.5 * step


def test_speeds_that_step_without_noise_keep_their_steps():
    vy = np.tile(np.where(TIME % 4.0 < 2.0, 0.0, 0.3), 2)
    read = with_ramps(*2 * [fast(vx=np.full(2000, 0.5), vy=vy)])
    assert np.abs(column(read, "vy") - vy).max() < 0.001


def test_every_run_has_its_own_noise():
    vx = np.tile(trapezoids(), 2)
    size = np.repeat([0.5 * NOISE, 5.0 * NOISE], 1000)
    log = fast(vx=vx + size * np.random.default_rng(4).standard_normal(2000))
    both = with_ramps(log, log)
    for run in (slice(0, 1000), slice(1000, 2000)):
        alone = log.take(run)
        assert np.allclose(with_ramps(alone, alone).rows, both.rows[run], equal_nan=True)


def test_long_runs_and_rows_that_arrive_in_bursts_are_divided():
    steps = np.tile([0.02, 0.02, 0.02, 0.02, 0.048, 1e-5, 1e-5, 0.02, 0.02, 0.02], 1200)
    time = np.cumsum(steps)
    log = plain_log([len(time)])
    rows = log.rows.copy()
    rows[:, INDEX["vx"]] = np.interp(time, [0.0, 200.0], [0.1, 0.9])
    rows[:, INDEX["vx"]] += NOISE * np.random.default_rng(6).standard_normal(len(time))
    log = replace(log, rows=rows, time=time, interval=steps)
    vx = column(with_ramps(log, log), "vx")
    assert np.abs(vx - np.interp(time, [0.0, 200.0], [0.1, 0.9])).max() < 2.0 * NOISE


def test_rows_at_rest_and_all_but_the_motion_are_as_elsewhere():
    vx = np.tile(np.clip(TIME - 8.0, 0.0, 0.5), 2)
    seen = fast(vx=vx + NOISE * (vx > 0.0) * np.random.default_rng(2).standard_normal(2000))
    elsewhere = fast(vx=np.full(2000, 7.0), gravity_x=np.full(2000, 0.3))
    read = with_ramps(seen, elsewhere)
    still = vx == 0.0
    assert np.all(column(read, "vx")[still] == 7.0)
    assert np.all(column(read, "gravity_x") == 0.3)
    assert column(read, "vx")[~still] == pytest.approx(vx[~still], abs=NOISE)
    short = plain_log([2 * LEAST_PIECE_ROWS - 1] * 20)
    np.testing.assert_array_equal(with_ramps(short, short).rows, short.rows)


def test_the_division_is_the_best_of_all():
    """Against every division by plain dynamic programming, which leaves none out."""
    rng = np.random.default_rng(8)
    for _ in range(60):
        count = int(rng.integers(6, 40))
        time = np.cumsum(rng.uniform(0.005, 0.04, count))
        bends = np.sort(rng.uniform(0.0, time[-1], 3))
        values = np.interp(time, bends, 30.0 * rng.standard_normal(3))[:, None] * [1.0, -0.5, 0.0]
        values += rng.standard_normal(values.shape) * rng.choice([1.0, 4.0])

        def misfit(first: int, end: int, time=time, values=values) -> float:
            lines = np.vander(time[first:end] - time[first], 2)
            left = values[first:end] - lines @ np.linalg.lstsq(lines, values[first:end])[0]
            return float(np.sum(left**2))

        least = np.full(count + 1, np.inf)
        least[0] = 0.0
        for end in range(LEAST_PIECE_ROWS, count + 1):
            for first in range(end - LEAST_PIECE_ROWS + 1):
                least[end] = min(least[end], least[first] + misfit(first, end) + PIECE_GAIN)
        begins = straight_pieces(time, np.ascontiguousarray(values))
        ends = [*begins[1:], count]
        cost = sum(misfit(a, b) + PIECE_GAIN for a, b in zip(begins, ends, strict=True))
        assert cost == pytest.approx(least[count], rel=1e-9)
