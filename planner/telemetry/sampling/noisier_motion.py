"""A log with as much noise of its motion again: what noise does to an answer, it then does twice.

    noisier = with_more_noise(log, np.random.default_rng(0))
    noise_of_motion(log)["vx"]            # m/s

Speeds, tilts and measured accelerations scatter from row to row. A model that is driven by them
predicts a power that scatters, and an effect or a formula may lower the error by taking that back.
Nobody can take the noise out of a log, but more can be added. What a claim explains by noise then
grows in proportion to the noise's variance; what is in the robot does not
(planner.telemetry.diagnosis.reconcile). How far its parameters move is in their standard errors.

The noise of a channel is the scatter of its third differences, in which a smooth motion cancels:
of white noise they have √20 times the standard deviation. Half of the rows may move as they like.

Left out
    rows that are exactly at rest, which encoders know for certain; noise that is not white.
Source
    simulation extrapolation: Cook & Stefanski, "Simulation-extrapolation estimation in parametric
    measurement error models", Journal of the American Statistical Association 89(428), 1994.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import deviation
from planner.telemetry.sampling.accelerations import RATES, SPEEDS, moving, slopes_of

DIFFERENCES = 3
"""Order of the differences that noise is seen in: those of a parabola vanish."""
THIRD_DIFFERENCE = np.sqrt(20.0)
"""Standard deviation of white noise's third differences over its own: √(1 + 9 + 9 + 1)."""
_TILTS = ("gravity_x", "gravity_y")


def noise_of_motion(log: Telemetry) -> dict[str, float]:
    """Standard deviation of the white noise of every measured channel of the motion, SI units."""
    driven = moving(log)
    measured = [*SPEEDS, *(name for name in RATES if name in log.present), *_TILTS]
    found = {}
    for name in measured:
        values, seen = log.rows[:, INDEX[name]], []
        for start, stop in log.segments():
            if stop - start > DIFFERENCES:
                drive = np.lib.stride_tricks.sliding_window_view(
                    driven[start:stop], DIFFERENCES + 1
                )
                seen.append(np.diff(values[start:stop], DIFFERENCES)[drive.all(axis=1)])
        scatter = np.concatenate([np.empty(0), *seen])
        found[name] = deviation(scatter) / float(THIRD_DIFFERENCE) if len(scatter) else 0.0
    return found


def with_more_noise(log: Telemetry, rng: np.random.Generator) -> Telemetry:
    """The log with white noise added to its motion, as large as the noise it has.

    Args:
        log: the rows as read, neither smoothed nor averaged.
        rng: of the noise.

    Returns:
        A log with the same rows. Accelerations that were not measured are slopes of the speeds.
    """
    driven, before = moving(log), log.rows
    rows = before.copy()
    for name, size in noise_of_motion(log).items():
        rows[driven, INDEX[name]] += size * rng.standard_normal(int(driven.sum()))
    turned, was = _turning(rows), _turning(before)
    speeds = np.array([INDEX[name] for name in SPEEDS])
    slopes = slopes_of(log, rows[:, speeds] - before[:, speeds])
    for place, rate in enumerate(RATES):
        if rate not in log.present:
            rows[:, INDEX[rate]] += turned[place] - was[place]
            rows[:, INDEX[rate]] += slopes[:, place]
    return replace(log, rows=rows)


def _turning(rows: Array) -> tuple[Array, Array, Array]:
    """What turning of the frame adds to ax, ay and the yaw acceleration, (n,) each."""
    vx, vy, wz = rows[:, [INDEX[name] for name in SPEEDS]].T
    return -wz * vy, wz * vx, np.zeros(len(rows))
