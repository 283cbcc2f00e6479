"""Accelerations that follow from changes of the speeds, as a body that turns feels them.

slopes = slopes_of(log, log.rows[:, speeds])
put_accelerations(log, rows, where, slopes)     # into rows; measured ones stay
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.quantities import INDEX
from planner.telemetry.logs import Finding, Telemetry

SPEEDS = ("vx", "vy", "wz")
RATES = ("ax", "ay", "yaw_acceleration")


def moving(log: Telemetry) -> Mask:
    """(n,) whether a row is not exactly at rest."""
    return np.asarray(np.any(log.rows[:, [INDEX[name] for name in SPEEDS]] != 0.0, axis=1))


def slopes_of(log: Telemetry, values: Array) -> Array:
    """(n, m) change per second of values (n, m), over the rows on either side."""
    slopes = np.zeros_like(values)
    for start, stop in log.segments():
        if stop - start > 1:
            slopes[start:stop] = np.gradient(values[start:stop], log.time[start:stop], axis=0)
    return slopes


def put_accelerations(log: Telemetry, rows: Array, where: Integers, slopes: Array) -> None:
    """Set the accelerations that a log did not measure.

    Args:
        log: says which ones were measured.
        rows: (n, ROW_LENGTH) with the speeds; changed.
        where: (k,) numbers of the rows to change.
        slopes: (k, 3) changes of SPEEDS per second, without the turning of the frame.
    """
    felt = felt_by_a_turning_body(rows[where], slopes)
    for name, values in zip(RATES, felt.T, strict=True):
        if name not in log.present:
            rows[where, INDEX[name]] = values


def felt_by_a_turning_body(rows: Array, slopes: Array) -> Array:
    """(k, 3) RATES in m/s² and rad/s² that follow from (k, ROW_LENGTH) speeds and their slopes."""
    vx, vy, wz = (rows[:, INDEX[name]] for name in SPEEDS)
    return slopes + np.stack([-wz * vy, wz * vx, np.zeros(len(rows))], axis=1)


def findings_of_accelerations(log: Telemetry) -> list[Finding]:
    """What is odd about measured accelerations beside the changes of the speeds."""
    slopes = slopes_of(log, log.rows[:, [INDEX[name] for name in SPEEDS]])
    return log.odd_accelerations(felt_by_a_turning_body(log.rows, slopes)[:, :2])
