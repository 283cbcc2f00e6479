"""The base fit of a log together with the meter that its power was read from.

    log, base = metered_base_fit(log, start)     # log.meter is None where it shows none

The meter and the parameters are fitted in turn, each with the other free to first order, until the
meter stays. Plain shapes over the axes of motion may take what they can beside the model, so that a
missing effect is no meter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit, with_meter
from planner.telemetry.holdout.heldout import (
    CLAIMED_RATIO,
    KEPT_ERRORS,
    base_fit,
    heldout_residual,
    heldout_rmse,
    rms,
    supports,
)
from planner.telemetry.logs import Meter, Telemetry, same_meter
from planner.telemetry.noise import strongest_columns
from planner.telemetry.other_terms import Dictionary, given_columns
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import Nodes, Readings, tangent

EVENLY = Meter(sampling="window")
"""Asks for an even mean in the place of a filter."""
MOST_ROUNDS = 3
"""Rounds of fitting the meter and the parameters."""
TIME_CONSTANT_STEPS = (1.15, 1.05)
"""Factors by which the time constant is moved to where held-out runs are predicted best."""
ENOUGH_FALL = 0.05
"""Share of the held-out error that makes another time constant believed without more ado."""


def metered_base_fit(
    log: Telemetry, start: PowerModel, known: tuple[Meter | None] | None = None
) -> tuple[Telemetry, Fit]:
    """The base model fitted to a log, and the log with its meter.

    Args:
        log: the rows.
        start: the model as stated; where the fit starts.
        known: the meter where it is known; otherwise it is estimated anew.
    """
    if known is not None:
        log = replace(log, meter=known[0])
        return log, _evenly_if_better(log, start, base_fit(log, start))
    log = replace(log, meter=None)
    plain = base_fit(log, start)
    metered = meter_beside(log, start)
    if metered.meter is None:
        metered = meter_beside(log, plain.model)
    found = log, plain
    error = heldout_rmse(log, plain)
    filtering = metered.meter is not None and metered.meter.time_constant_s > 0.0
    for _ in range(MOST_ROUNDS):
        if metered.meter is None:
            break
        fitted = base_fit(metered, start)
        better = heldout_rmse(metered, fitted)
        if better >= error:
            break
        found, error = (metered, fitted), better
        metered = meter_beside(log, fitted.model)
        if same_meter(metered.meter, found[0].meter):
            break
    if filtering:
        # Noise of the speeds looks like a filter, and hides at what moment the power is read.
        metered = meter_beside(log, found[1].model, filtering=False)
        if metered.meter is not None:
            fitted = base_fit(metered, start)
            found = (metered, fitted) if heldout_rmse(metered, fitted) < error else found
    log, whitened = found
    found = predicting_best(start, log, _evenly_if_better(log, start, whitened))
    if filtering:
        # Errors of the motion ask for an even mean as well, but then new runs do not.
        metered = meter_beside(replace(log, meter=EVENLY), found[1].model)
        if metered.meter is not None:
            even = metered_base_fit(log, start, (metered.meter,))
            lacking = _lacking(*found)
            errors = [_error_beside(*each, lacking) for each in (even, found)]
            better = heldout_rmse(*even) < heldout_rmse(*found)
            found = even if better and errors[0] < CLAIMED_RATIO * errors[1] else found
    return found


def predicting_best(start: PowerModel, log: Telemetry, fitted: Fit) -> tuple[Telemetry, Fit]:
    """The log and its fit with the meter near the likeliest one that predicts best.

    The likelihood of rows follows errors of the inputs: a filter that is a little too long or too
    short may take some of them away. On held-out runs that helps less. They must support the change
    as they must support a claim, or be predicted better by ENOUGH_FALL, however few they are. What
    the model lacks can be blurred by a filter that is too long, so that they must also be predicted
    better beside plain shapes.
    """
    meter = log.meter
    if meter is None or not (moves := _moves(log, meter)):
        return log, fitted
    likeliest, usual = meter.time_constant_s, meter.time_constant_shift_s
    first = error = overall_error(log, fitted)
    before, best = heldout_residual(log, fitted), (log, fitted)
    for factor, later in moves:
        # A power that hardly follows the motion is predicted better by every longer filter.
        while factor * meter.time_constant_s <= Meter.LONGEST_LAG:
            tau = factor * meter.time_constant_s
            # Rows and new runs disagree: each may be wrong by half of that.
            shift = math.hypot(usual, 0.5 * (tau - likeliest))
            tried = replace(meter, time_constant_s=tau, time_constant_shift_s=shift)
            tried = tried.with_number("delay_s", meter.delay_s + later)
            found = metered_base_fit(log, start, (tried,))
            if (less := overall_error(*found)) >= error:
                break
            best, error, meter = found, less, tried
            if later:
                break
    much = error <= (1.0 - ENOUGH_FALL) * first
    if not (much or supports(log, before, heldout_residual(*best), fitted.spread)):
        return log, fitted
    lacking = _lacking(log, fitted)
    beside = [_error_beside(*found, lacking) for found in (best, (log, fitted))]
    return best if beside[0] < beside[1] else (log, fitted)


def _moves(log: Telemetry, meter: Meter) -> list[tuple[float, float]]:
    """Factors on the time constant, and s that the delay grows by, to try in turn.

    A reading that is held belongs to a moment between two rows. Where the power jumps from one to
    the next, either row fits better than all between them, so that the likelihood has two peaks.
    """
    row = float(np.median(log.interval))
    rows = [(1.0, row)] if meter.sampling == "held" else []
    if rows and meter.delay_s >= 0.5 * row:  # none foresees the power
        rows.append((1.0, -row))
    filters = [(factor, 0.0) for step in TIME_CONSTANT_STEPS for factor in (step, 1.0 / step)]
    return rows + filters if meter.time_constant_s > 0.0 else rows


def _lacking(log: Telemetry, fitted: Fit) -> Array:
    """(n, k) plain shapes that explain most of what a fit leaves, at the supply.

    Their size is that of the residual: a missing effect may be as large.
    """
    columns = Dictionary.of(log).gradual.columns(log.rows)
    shown = Readings.as_shown(log, columns)
    chosen = strongest_columns(fitted.residual, fitted.columns, shown)
    sizes = np.sqrt(np.mean(shown[:, chosen] ** 2, axis=0))
    return np.asarray(columns[:, chosen] * rms(fitted.residual) / sizes)


def _error_beside(log: Telemetry, fitted: Fit, lacking: Array) -> float:
    """W, held-out error of a fit beside columns (n, k) W at the supply."""
    return rms(heldout_residual(log, fitted, Readings.as_shown(log, lacking)))


def overall_error(log: Telemetry, fitted: Fit) -> float:
    """W, on held-out runs: the geometric mean of two errors, that of the model as it can be adopted
    and that with usual errors of what is given, where these predict better.

    With usual errors alone, a reading could win whose model misses what they make good.
    """
    return math.sqrt(heldout_rmse(log, fitted) * _least_error(log, fitted))


def _evenly_if_better(log: Telemetry, start: PowerModel, whitened: Fit) -> Fit:
    """The fit to evenly weighted rows instead of a whitened one, where it predicts runs better.

    Correlation and uneven scatter are noise of the meter, which whitening is for, or come from
    errors of the inputs and from what the model misses, which it makes worse. Held-out runs say
    which. Usual errors of data sheet and sensors may explain what they can: they are slow, and a
    whitened fit finds too little of them.
    """
    evenly = base_fit(log, start, evenly=True)
    better = _least_error(log, evenly) < CLAIMED_RATIO * _least_error(log, whitened)
    if whitened.refused is not None:
        # A log that bent one fit must clearly speak for the other.
        better &= heldout_rmse(log, evenly) < CLAIMED_RATIO * whitened.refused.stated_rmse_w
    return evenly if better and evenly.refused is None else whitened


@lru_cache(maxsize=KEPT_ERRORS)
def _least_error(log: Telemetry, fitted: Fit) -> float:
    """W, held-out error of a fit, with usual errors of what was given where that is less."""
    given = given_columns(log, fitted.model, fitted.watts)
    return min(heldout_rmse(log, fitted), rms(heldout_residual(log, fitted, given)))


def meter_beside(
    log: Telemetry,
    model: PowerModel,
    places: Sequence[int] | None = None,
    *,
    filtering: bool = True,
    dictionary: Dictionary | None = None,
) -> Telemetry:
    """The log with the meter that it shows beside a model and plain shapes.

    Args:
        log: the rows; as for ``with_meter``.
        model: what is known of the power.
        places: numbers of its free parameters; None takes all that may be fitted.
        filtering: as for ``with_meter``.
        dictionary: the plain shapes; None takes those that change gradually.
    """
    plain = replace(log, meter=None)
    places = free_places(model, plain) if places is None else places
    watts, own = tangent(model, Nodes.of(plain, model), places)
    shapes = (dictionary or Dictionary.of(plain).gradual).columns(log.rows)
    chosen = strongest_columns(log.power - watts, own, shapes)
    return with_meter(log, model, places, shapes[:, chosen], filtering=filtering)
