"""Motion as it was before a filter of the odometry made it late.

    log = with_undone_lag(log, 0.2)      # speeds 0.2 s of a first-order filter earlier

Fused odometry, such as that of a Kalman filter, follows the motion with a delay. A power that leads
its motion is no meter's doing, and what it needs at every change of speed looks like an effect of
the acceleration. A first-order filter says that its output changes by the difference between what
is and what it shows, over its time constant. So the motion is what it shows, and the time constant
times the change of that.

The power says whether it is so (planner.telemetry.estimation.moment_of_motion).

Left out
    accelerations that were measured, which no odometry delays; tilts, which another filter may.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of


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
