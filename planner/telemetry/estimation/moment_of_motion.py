"""Whether the power of a log follows another motion than that of its rows.

    followed_motions(source, model)     # the log read so, the likeliest first

The motion of a row may belong half a row earlier or later than its power, or be late by a filter of
the odometry. What each such motion can explain is compared by the likelihood of the power, beside
the likeliest of some meters. So a meter that is late, or averages, stands in nobody's place. A
motion must also lead what averaging the rows' own motion brings: that would be less noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.power.model import PowerModel
from planner.telemetry.estimation.meter_fit import LEAST_GAIN, likelihoods
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import LogSource


def followed_motions(
    source: LogSource,
    model: PowerModel,
    motions: Sequence[LogSource] | None = None,
    *,
    settled: bool = False,
) -> list[LogSource]:
    """The log with motions that its power follows clearly more than that of its rows.

    Args:
        source: the log as read.
        model: what is known of the power.
        motions: the log with these; None takes those of ``source.motions``.
        settled: the model is taken as it is; otherwise it is fitted first.

    Returns:
        The log in these readings, the likeliest first.
    """
    usual, motions = source.steady().sample, source.motions() if motions is None else motions
    if not motions:
        return []
    if not settled:
        model = fit(usual, model).model
    elif not np.isfinite(predict(model, usual)).all():
        return []
    plain = [usual, *source.averaged()]
    samples = [*plain, *(motion.sample for motion in motions)]
    found = likelihoods(samples, model, free_places(model, usual))
    least = max(found[: len(plain)]) + LEAST_GAIN
    by_motion = zip(found[len(plain) :], range(len(motions)), strict=True)
    return [motions[k] for lead, k in sorted(by_motion, reverse=True) if lead > least]
