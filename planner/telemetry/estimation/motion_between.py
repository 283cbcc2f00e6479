"""Whether the power of a log follows the motion between its rows.

    between = followed_between(source, model)     # the log read so, or None

What each reading of the motion can explain is compared by the likelihood of the power, beside the
likeliest of some meters. So a meter that is late, or averages, stands in nobody's way.
"""

from __future__ import annotations

import numpy as np

from planner.power.model import PowerModel
from planner.telemetry.estimation.meter_fit import is_likelier
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import LogSource


def followed_between(
    source: LogSource, model: PowerModel, *, settled: bool = False
) -> LogSource | None:
    """The log with its motion between rows, where the power follows that; None elsewhere.

    Args:
        source: the log as read.
        model: what is known of the power.
        settled: the model is taken as it is; otherwise it is fitted first.
    """
    between, usual = source.between_rows(), source.steady().sample
    if between is None:
        return None
    if not settled:
        model = fit(usual, model).model
    elif not np.isfinite(predict(model, usual)).all():
        return None
    likelier = is_likelier(between.sample, usual, model, free_places(model, usual))
    return between if likelier else None
