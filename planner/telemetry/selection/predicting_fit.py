"""Fits of a model with effects added, as they predict runs that they were not fitted to.

    fitted = predicting_fit(model, log, additions, noise=examination.noise, within=library.model)

Noise was estimated beside a model that lacks the effect, and takes a part of it for its own. What
lasts for three runs of sixteen is then slow noise or lies far out, and a fit finds too little of
it. Another effect seems to explain the rest. So rows also weigh evenly, as in a base fit, where
that predicts new runs better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import heldout_residual, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise
from planner.telemetry.terms import Addition, fit_with

EVENLY_BETTER = 0.98
"""Held-out error with even weights over that with the noise's, below which they are taken. Smaller
differences are scatter between choices of the held-out runs."""


def predicting_fit(
    model: PowerModel,
    log: Telemetry,
    additions: Sequence[Addition],
    *,
    noise: Noise,
    within: PowerModel | None = None,
    unsure: Array | None = None,
) -> Fit:
    """The better of two fits; arguments as for ``fit_with``."""
    fitted = fit_with(model, log, additions, noise=noise, within=within, unsure=unsure)
    if noise.even_w:
        return fitted
    # A fit says itself how much its even rows weigh.
    evenly = replace(noise, even_w=noise.floor_w)
    other = fit_with(model, log, additions, noise=evenly, within=within, unsure=unsure)
    errors = [rms(heldout_residual(log, each)) for each in (other, fitted)]
    return other if errors[0] < EVENLY_BETTER * errors[1] else fitted
