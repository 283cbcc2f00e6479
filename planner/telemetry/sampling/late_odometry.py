"""Motion as it was before a filter of odometry or of a tilt sensor made it late.

    log = with_undone_lag(log, 0.2)      # speeds 0.2 s of a first-order filter earlier
    log = with_earlier_tilt(log, 0.1)    # pitch and roll 0.1 s earlier

Fused odometry, such as that of a Kalman filter, follows the motion with a delay. A power that leads
its motion is no meter's doing, and what it needs at every change of speed looks like an effect of
the acceleration. A first-order filter says that its output changes by the difference between what
is and what it shows, over its time constant. So the motion is what it shows, and the time constant
times the change of that.

The power says whether it is so (planner.telemetry.estimation.moment_of_motion).

Pitch and roll of an inertial sensor come from a filter of their own. Between rows of a bumpy ground
undoing it would be noise; what it does most is a delay.

A gyroscope drifts, so such a filter lets its angles follow an accelerometer over its time constant
(complementary filter). An accelerometer feels speeding up as it feels a slope: the nose seems to
rise. What stands in the angles is then the acceleration behind a first-order filter, over g.

    log = with_tilt_freed(log, 1.0)      # pitch and roll without the acceleration of 1 s

The change of a speed is the mean of what was felt between two rows, also where rows are long or
missing. An accelerometer's rows say less: they are moments, and have a bias. A filter that was
switched on begins with the angles that the accelerometer then shows.

Left out
    accelerations that were measured, which no odometry delays.
Source
    Mahony, Hamel & Pflimlin, "Nonlinear complementary filters on the special orthogonal group",
    IEEE Transactions on Automatic Control 53(5), 2008: acceleration is what they disregard.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from planner.compiled_code import njit
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of
from planner.telemetry.sampling.steady_drive import at_steady_speeds

_ATTITUDE = "gravity_x", "gravity_y", "gravity_normal"
BEGINNING = 0.2
"""s of a run that say what was felt before it; odometry shows no acceleration in less."""
_READ_AS = {"pitch", "roll", "gravity_x", "gravity_y"}
"""Columns that pitch and roll act by, and are logged in."""


def with_undone_lag(log: Telemetry, lag: float) -> Telemetry:
    """The log with the motion that a filter shows as it does.

    Args:
        log: the rows; their runs and times say which of them follow each other.
        lag: s, time constant of the filter.

    Returns:
        A log with the same rows; speeds, and accelerations that were not measured, differ.
    """
    rows = log.rows.copy()
    speeds = np.array([INDEX[name] for name in SPEEDS])
    slopes = slopes_of(log, rows[:, speeds])
    rows[:, speeds] += lag * slopes
    slopes += lag * slopes_of(log, slopes)
    put_accelerations(log, rows, np.arange(len(log)), slopes)
    return replace(log, rows=rows)


def has_tilt(log: Telemetry) -> bool:
    """Whether pitch or roll were measured, and change."""
    columns = [INDEX[name] for name in _ATTITUDE]
    return bool(_READ_AS & log.present and np.any(log.rows[:, columns] != log.rows[:1, columns]))


def with_earlier_tilt(log: Telemetry, lag: float) -> Telemetry:
    """The log with pitch and roll as they would be without a filter that makes them late.

    Args:
        log: the rows; without a tilt sensor they stay as they are.
        lag: s, time constant of the filter.
    """
    rows = log.rows.copy()
    for name in _ATTITUDE if has_tilt(log) else ():
        column = rows[:, INDEX[name]]
        for start, stop in log.segments():
            time = log.time[start:stop]
            column[start:stop] = np.interp(time + lag, time, column[start:stop])
    return replace(log, rows=rows)


def with_tilt_freed(log: Telemetry, time_constant: float, *, rested: bool = False) -> Telemetry:
    """The log with pitch and roll without what a complementary filter made of accelerations.

    Args:
        log: the rows.
        time_constant: s, of the filter.
        rested: whether the robot kept its speed before each run. Otherwise the filter began with
            the acceleration of the first BEGINNING.
    """
    rows, steady = log.rows.copy(), at_steady_speeds(log).rows
    speeds, turning = steady[:, [INDEX[name] for name in SPEEDS[:2]]], steady[:, [INDEX["wz"]]]
    turned = turning * speeds[:, ::-1] * (-1.0, 1.0)
    into = [INDEX["gravity_x"], INDEX["gravity_y"]]
    for start, stop in log.run_pieces():
        part, time = slice(start, stop), log.time[start:stop]
        if stop - start > 1:
            step = np.diff(time)[:, None]
            felt = np.diff(speeds[part], axis=0) / step
            felt += 0.5 * (turned[start : stop - 1] + turned[start + 1 : stop])
            first = 0.5 * (time[1:] + time[:-1]) < time[0] + BEGINNING
            first[0] = True  # a gap, where the run begins with one
            begin = 0.0 * felt[0] if rested else np.average(felt[first], 0, step[first, 0])
            rows[part, into] += _followed(felt, np.exp(-step / time_constant), begin)
    return replace(log, rows=rows)


@njit(cache=True, nogil=True)
def _followed(felt: Any, keep: Any, begin: Any) -> Any:
    """(n + 1, 2) a first-order filter's values, from ``begin`` (2,) on, of means (n, 2) between.

    It keeps the share ``keep`` (n, 1) of its value from row to row.
    """
    values = np.empty((felt.shape[0] + 1, felt.shape[1]))
    values[0] = begin
    for k in range(felt.shape[0]):
        values[k + 1] = felt[k] + keep[k] * (values[k] - felt[k])
    return values
