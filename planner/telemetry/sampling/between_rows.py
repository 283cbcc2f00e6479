"""Motion between two rows: what it was in the middle of the time from each row to the next.

    log = with_motion_between(log)       # the same rows, each with the motion before the next one

Motion and power of a row need not belong to one moment: a speed may be the mean of a row, and the
power be read at its end. And where rows are long, the power of a row is not that of its motion: a
speed with a bend in the middle of the row has two accelerations. Between two rows the speed is
taken to change evenly. Its acceleration is then the difference of two rows, in place of a
difference over the rows on either side. A meter says which mean of such powers a reading shows: it
is late by half a row where motion and power belong to the same row.

The power says whether it is so (planner.telemetry.estimation.moment_of_motion).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import RATES, SPEEDS, put_accelerations

_OTHERS = ("gravity_x", "gravity_y", "gravity_normal", "slope_rate", "wind_x", "wind_y")


def with_motion_between(log: Telemetry) -> Telemetry:
    """The log with its motion half a row later.

    Args:
        log: the rows; their runs and times say which of them follow each other.

    Returns:
        A log with the same rows. Accelerations that were not measured are differences of the
        speeds. The last row of a stretch stays as it is.
    """
    ends = [stop - 1 for _, stop in log.segments()]
    here = np.setdiff1d(np.arange(len(log)), ends)
    one, other = log.rows[here], log.rows[here + 1]
    places = np.array([INDEX[name] for name in (*SPEEDS, *RATES, *_OTHERS)])
    rows = log.rows.copy()
    rows[np.ix_(here, places)] = 0.5 * (one + other)[:, places]
    speeds = np.array([INDEX[name] for name in SPEEDS])
    slopes = (other - one)[:, speeds] / (log.time[here + 1] - log.time[here])[:, None]
    put_accelerations(log, rows, here, slopes)
    return replace(log, rows=rows, ahead=True)


def with_averaged_motion(log: Telemetry) -> Telemetry:
    """The log with the motion of each row averaged over both moments beside it.

    What this does for a prediction as well was noise of the motion, which averaging lowers.
    """
    ends = np.array(log.segments(), np.int64).reshape(-1, 2)
    inside = np.setdiff1d(np.arange(len(log)), [ends[:, 0], ends[:, 1] - 1])
    between, rows = with_motion_between(log).rows, log.rows.copy()
    places = np.array([INDEX[name] for name in (*SPEEDS, *RATES, *_OTHERS)])
    mean = 0.5 * (between[inside - 1] + between[inside])
    rows[np.ix_(inside, places)] = mean[:, places]
    return replace(log, rows=rows)
