"""How a log's motion is read: as logged, steady, smoothed, in ramps, of another moment.

    for reading in readings_for(log):
        rows = reading.of(log)                    # the same rows, their motion read so

Odometry scatters, its filters are late, and controllers answer to bumps. Which reading is the
robot's motion, held-out runs decide (planner.telemetry.diagnosis.best_reading).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.between_rows import with_averaged_motion, with_motion_between
from planner.telemetry.sampling.late_odometry import with_undone_lag
from planner.telemetry.sampling.ramps import with_ramps
from planner.telemetry.sampling.smoothed_motion import (
    LEAST_NEIGHBOURS,
    can_be_smoothed,
    with_smoothed_motion,
)
from planner.telemetry.sampling.steady_drive import LEAST_SEGMENT_ROWS, at_steady_speeds

STEADY_TIME = 0.2
"""s; a drive that a robot keeps up, where rows are short: motors need a tenth to change a speed."""
SAME_ROW = 0.1
"""Share by which rows of one length may differ."""
NOISE_MEMORY = 0.2
"""s; noise that an odometry's filter makes last is gone by then: twice a usual time constant."""
HALF_WIDTHS = (0.2, 0.1)
"""s on either side that a motion is smoothed over."""
LONGEST_HALF_WIDTH = 1.0
"""s on either side, at most, where rows are longer: a robot reaches its speed in about this time.
"""
LAGS = (0.1, 0.2)
"""s of filters of the odometry that are tried; a meter's delay takes what is between them."""


@dataclass(frozen=True)
class MotionReading:
    """One way to read the motion; the default is that of the rows as logged.

    Attributes:
        steady_rows: least rows of the steady drives whose speeds are at their means; 0 where all
            are as read.
        half_width: s on either side of a row that its motion is smoothed over; 0 for none.
        apart: rows from which on the noise of the speeds is independent; 1 where it is white.
        ramps: whether speeds are those of straight ramps; tilts are smoothed beside them.
        ahead: whether the motion is that between each row and the next.
        lag: s of a filter of the odometry that is undone; 0 for none.
    """

    steady_rows: int = 0
    half_width: float = 0.0
    apart: int = 1
    ramps: bool = False
    ahead: bool = False
    lag: float = 0.0

    def of(self, log: Telemetry) -> Telemetry:
        """Rows as they were opened in this reading."""
        read = with_smoothed_motion(log, self.half_width) if self.half_width else log
        read = with_ramps(log, read) if self.ramps else read
        read = with_undone_lag(read, self.lag) if self.lag else read
        if self.steady_rows:
            read = at_steady_speeds(log, self.steady_rows, read, self.apart)
        return with_motion_between(read) if self.ahead else read

    @property
    def is_unusual(self) -> bool:
        """Whether small changes of speed are motion, or noise, where the usual reading differs."""
        return (self.steady_rows, self.half_width, self.ramps) != (LEAST_SEGMENT_ROWS, 0.0, False)


AS_LOGGED = MotionReading()
USUAL = MotionReading(LEAST_SEGMENT_ROWS)
"""The speeds of steady drives at their means."""


def readings_for(log: Telemetry) -> tuple[MotionReading, ...]:
    """That at steady speeds first; where rows are short also others.

    Four short rows may be steady by chance while a robot changes its speed: so there are also
    speeds as read, and longer steady drives. What is seen from row to row may be noise: so there
    is also a motion in ramps, and a smoothed one. It is smoothed over HALF_WIDTHS, or over a few
    rows where these are longer: encoders that are read a little early or late scatter at any rate.
    A filter of the odometry makes noise last, which looks like a swing: so there are steady drives
    whose speeds scatter only after NOISE_MEMORY. Which reading is the robot's motion depends on
    how its odometry scatters and how its controller works.
    """
    interval = float(np.median(log.interval)) if len(log) else STEADY_TIME
    rows = max(round(STEADY_TIME / max(interval, 1e-9)), LEAST_SEGMENT_ROWS)
    smooth = [width for width in HALF_WIDTHS if can_be_smoothed(log, width)]
    wider = (LEAST_NEIGHBOURS + 0.5) * interval  # half a row more, as rows are uneven
    if not smooth and wider <= LONGEST_HALF_WIDTH and can_be_smoothed(log, wider):
        smooth = [wider]
    readings = [USUAL]
    for steady in (rows, 0):
        readings += [MotionReading(steady, width, ramps=True) for width in smooth[:1]]
        readings += [MotionReading(steady, width) for width in smooth]
    if rows > LEAST_SEGMENT_ROWS:
        readings += [AS_LOGGED, MotionReading(rows)]
    apart = round(NOISE_MEMORY / max(interval, 1e-9))
    if apart > 1:
        readings.append(MotionReading(apart * LEAST_SEGMENT_ROWS, apart=apart))
    return tuple(readings)


def motions_for(log: Telemetry) -> tuple[MotionReading, ...]:
    """Motions that a power may follow: not that of its rows, or before a filter.

    Half a row matters where rows are long. Where they are short, a change of speed is taken from
    the smoothed motion.
    """
    if _has_long_rows(log):
        # A filter that is shorter than half a row leaves no trace between rows.
        lags = [lag for lag in LAGS if lag >= 0.5 * float(np.median(log.interval))]
        return replace(USUAL, ahead=True), *(replace(USUAL, lag=lag) for lag in lags)
    if not can_be_smoothed(log, HALF_WIDTHS[0]):
        return ()
    return tuple(replace(USUAL, half_width=HALF_WIDTHS[0], lag=lag) for lag in LAGS)


def averaged_for(log: Telemetry) -> tuple[Telemetry, ...]:
    """The rows with their motion averaged over neighbours, as little as ``motions_for``."""
    some = []
    if _has_long_rows(log):
        some.append(with_averaged_motion(USUAL.of(log)))
    if can_be_smoothed(log, HALF_WIDTHS[0]):
        some.append(replace(USUAL, half_width=HALF_WIDTHS[0]).of(log))
    return tuple(some)


def _has_long_rows(log: Telemetry) -> bool:
    """Whether even the fewest rows of a steady drive last as long as one does."""
    least = STEADY_TIME / LEAST_SEGMENT_ROWS * (1.0 - SAME_ROW)
    return bool(len(log) and np.median(log.interval) >= least)
