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

Left out
    accelerations that were measured, which no odometry delays.
Source
    Mahony, Hamel & Pflimlin, "Nonlinear complementary filters on the special orthogonal group",
    IEEE Transactions on Automatic Control 53(5), 2008: acceleration is what they disregard.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of

_ATTITUDE = "gravity_x", "gravity_y", "gravity_normal"
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


def with_tilt_freed(log: Telemetry, time_constant: float) -> Telemetry:
    """The log with pitch and roll without what a complementary filter made of accelerations.

    Args:
        log: the rows. Before each stretch of them the robot is taken to keep its speed.
        time_constant: s, of the filter.
    """
    rows = log.rows.copy()
    for start, stop in log.segments():
        interval = float(np.median(log.interval[start:stop]))
        keep = np.exp(-interval / time_constant)
        for gravity, rate in (("gravity_x", "ax"), ("gravity_y", "ay")):
            felt = lfilter([1.0 - keep], [1.0, -keep], rows[start:stop, INDEX[rate]])
            rows[start:stop, INDEX[gravity]] += felt
    return replace(log, rows=rows)
