"""Whether the power of a log follows another motion than that of its rows.

    other = followed_motion(source, model)     # the log read so, or None

The motion of a row may belong half a row earlier or later than its power, or be late by a filter of
the odometry. What each such motion can explain is compared by the likelihood of the power, beside
the likeliest of some meters. So a meter that is late, or averages, stands in nobody's place. A
motion must also lead what averaging the rows' own motion brings: that would be less noise.
"""

from __future__ import annotations

import numpy as np

from planner.power.model import PowerModel
from planner.telemetry.estimation.meter_fit import LEAST_GAIN, likelihoods
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import LogSource


def followed_motion(
    source: LogSource, model: PowerModel, *, settled: bool = False
) -> LogSource | None:
    """The log with the motion that its power follows clearly more than that of its rows.

    Args:
        source: the log as read.
        model: what is known of the power.
        settled: the model is taken as it is; otherwise it is fitted first.

    Returns:
        The log in that reading; None where there is none.
    """
    usual, motions = source.steady().sample, source.motions()
    if not motions:
        return None
    if not settled:
        model = fit(usual, model).model
    elif not np.isfinite(predict(model, usual)).all():
        return None
    plain = [usual, *source.averaged()]
    samples = [*plain, *(motion.sample for motion in motions)]
    found = likelihoods(samples, model, free_places(model, usual))
    best = int(np.argmax(found))
    if best < len(plain) or found[best] < max(found[: len(plain)]) + LEAST_GAIN:
        return None
    return motions[best - len(plain)]
