"""Cross-validated error of a fit, on held-out runs.

    base = base_fit(log, model)                          # a fit that held-out runs do not refute
    heldout_rmse(log, fitted)                            # of a fitted model
    falls(heldout_residual(log, one), heldout_residual(log, other), one.spread)

A fold is a fifth of the runs. Its parameters are those of one Gauss-Newton step from the fit to all
runs towards the fit without the fold, with the same bounds and the same prior: a parameter that
only the fold determines stays where it is. That is as good as refitting when folds change them
little (tests/telemetry/holdout/test_cross_validation.py compares it with such fits).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array, Integers
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit, RefusedFit, bounded_step, fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped, huber
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import Nodes, predict, tangent

FOLDS = 5
"""Parts of the log, of which each is held out in turn."""
LEAST_RUNS = 4
"""Runs from which on whole runs are held out; with fewer, stretches of rows."""
FALLEN_RATIO = 0.999
"""Held-out error after over before, below which it has fallen."""
CLAIMED_RATIO = 0.98
"""Held-out error over that of a simpler answer, from which a formula, or the stated vehicle against
its fit, is claimed. Smaller gains are scatter between choices of the held-out runs."""
DEVIANCE_RATIO, GREAT_DEVIANCE_RATIO = 0.99, 0.9
"""Held-out deviance after over before, below which it has fallen: where the error rises little, and
in any case."""
MOST_RISE_RATIO = 1.25
"""Held-out error after over before, up to which it has risen little."""


def base_fit(log: Telemetry, start: PowerModel) -> Fit:
    """The model fitted to a log, or as stated where that predicts held-out runs better.

    A log whose power is delayed or filtered can bend a fit far away from the robot. Runs that it
    has not seen show that. The model as stated has seen none.

    Args:
        log: the rows.
        start: the model as stated; where the fit starts.

    Returns:
        The fit. With ``refused`` set, it is ``start`` with no parameter freed.
    """
    fitted = fit(log, start)
    error, stated = heldout_rmse(log, fitted), rms(log.power - predict(start, log))
    if CLAIMED_RATIO * error <= stated:
        return fitted
    return replace(fit(log, start, free=()), refused=RefusedFit(error, stated))


def fold_numbers(log: Telemetry) -> Integers:
    """(n,) fold of every row: by run, or by stretches of rows when there are too few runs."""
    runs, rank = np.unique(log.run, return_inverse=True)
    if len(runs) >= LEAST_RUNS:
        return rank % min(FOLDS, len(runs))
    stretch = np.arange(len(log)) * (4 * FOLDS) // max(len(log), 1)
    return stretch % FOLDS


def heldout_rmse(log: Telemetry, fitted: Fit) -> float:
    """W, cross-validated by run, of a model that was fitted to this log."""
    return rms(heldout_residual(log, fitted))


def rms(residual: Array) -> float:
    """Root mean square of residuals (n,) W."""
    return float(np.sqrt(np.mean(residual**2)))


def deviance(residual: Array, spread: Array) -> float:
    """Mean loss per row, each row counted by how sure it is and none beyond a few spreads."""
    return float(np.mean(huber(residual / spread)))


def falls(before: Array, after: Array, spread: Array, *, beside: Array | None = None) -> bool:
    """Whether held-out residuals (n,) W have become smaller.

    With ``beside``, (n,) W of a simpler answer, they must also be clearly smaller than those.

    Of a robot about to turn round on a slope, a millimetre per second decides whether friction
    helps or hinders, and with it several watts. A few such rows can outweigh all others in a mean
    of squares, and with the true stiction they scatter more, not less. So the deviance is asked
    too, to which every row adds as much as it is sure.
    """
    if beside is not None and not rms(after) <= CLAIMED_RATIO * rms(beside):
        return False
    if rms(after) < FALLEN_RATIO * rms(before):
        return True
    share = deviance(after, spread) / max(deviance(before, spread), 1e-300)
    return share < GREAT_DEVIANCE_RATIO or (
        share < DEVIANCE_RATIO and rms(after) < MOST_RISE_RATIO * rms(before)
    )


def heldout_residual(log: Telemetry, fitted: Fit) -> Array:
    """(n,) W, measured less modelled, of every row by the fit without its fold."""
    model = fitted.model
    nodes = Nodes.of(log, model)
    _, columns = tangent(model, nodes, fitted.places)
    residual = clipped(fitted.residual, fitted.spread)
    white = fitted.noise.whiten(
        log, fitted.watts, fitted.spread, np.column_stack([columns, residual])
    )
    known = Prior.of(model, fitted.places)
    prior, low, high = known.precision, known.low, known.high
    value = model.parameters[list(fitted.places)]
    folds = fold_numbers(log)
    left = np.empty(len(log))
    for fold in np.unique(folds):
        held = folds == fold
        own = white[~held, :-1]
        score = own.T @ white[~held, -1] - prior @ (value - fitted.start)
        step = bounded_step(own.T @ own + prior, score, low - value, high - value)
        left[held] = fitted.residual[held] - columns[held] @ step
    return left
