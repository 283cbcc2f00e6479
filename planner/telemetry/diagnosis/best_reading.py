"""Which reading of a log's motion predicts its power best: odometry and controller decide.

    source = best_reading(open_source("drive.csv"), start)

Where rows are short, changes of speed within some tenths of a second are noise of the odometry or
the robot's motion, and accelerations follow them. Held-out runs say which (LogSource.readings).
"""

from __future__ import annotations

import math

from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import heldout_residual, metered_base_fit, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import given_columns
from planner.telemetry.sampling import LogSource

CLEARLY_LESS = 0.98
"""Held-out error over that of the usual reading, below which another one is believed; smaller
differences are scatter between choices of the held-out runs."""


def best_reading(source: LogSource, start: PowerModel) -> LogSource:
    """The log in the reading whose held-out error is least.

    Args:
        source: the log as read.
        start: the model as stated.
    """
    usual, *others = source.readings()
    if not others:
        return usual
    log, base = metered_base_fit(usual.sample, start)
    best, least, meter = usual, CLEARLY_LESS * _error(log, base), log.meter
    for reading in others:
        # A smooth motion shows a meter best; it is the same whatever the reading.
        for known in ((meter,), None) if reading is others[0] else ((meter,),):
            log, base = metered_base_fit(reading.sample, start, known)
            error = _error(log, base)
            if error < least:
                best, least, meter = reading, error, log.meter
    return best


def _error(log: Telemetry, base: Fit) -> float:
    """W, on held-out runs: the geometric mean of two errors, that of the model as it can be adopted
    and that with usual errors of what is given, where these predict better.

    With usual errors alone, a reading could win whose model misses what they make good.
    """
    given = given_columns(log, base.model, base.watts)
    adopted, explained = (rms(heldout_residual(log, base, one)) for one in (None, given))
    return math.sqrt(adopted * min(adopted, explained))
