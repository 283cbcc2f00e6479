"""Cross-validated error of a fit, on held-out runs.

    base = base_fit(log, model)                          # a fit that held-out runs do not refute
    heldout_rmse(log, fitted)                            # of a fitted model
    supports(log, heldout_residual(log, one), heldout_residual(log, other), one.spread)

A fold is a fifth of the runs. Its parameters are those of one Gauss-Newton step from the fit to all
runs towards the fit without the fold, with the same bounds and a prior at least as wide. A
parameter that only the fold determines stays where it is. That is as good as refitting when folds
change them little (tests/telemetry/holdout/test_cross_validation.py compares it with such fits).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner.arrays import Array, Integers
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit, RefusedFit, bounded_step, fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted, huber
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import predict

FOLDS = 5
"""Parts of the log, of which each is held out in turn."""
LEAST_RUNS = 4
"""Runs from which on whole runs are held out; with fewer, stretches of rows."""
STRETCH, MOST_STRETCHES = 20.0, 20
"""s of a stretch that takes the place of a run, at least, where a log is long enough for one in
each fold; and the number of stretches, at most."""
FEW_RUNS = 10
"""Runs below which halves of runs say whether a gain is there everywhere. A gain in one run alone
still is no support: both its halves have it, and those of all other runs do not."""
CLAIMED_RATIO = 0.98
"""Held-out error of a fit over that of the vehicle as stated, above which the fit is refused.
Smaller differences are scatter between choices of the held-out runs."""
ASKED_Z = 3.0
"""Standard errors by which the residual asks for a part that a vehicle does not state, beyond what
its narrow prior lets a fit give it, from which a fit with a wide one is tried."""
PART = 0.1
"""Share of the mean power that such a part then begins at, which makes its prior wide in any unit.
"""
LEAST_FALL, LEAST_FORMULA_FALL = 0.016, 0.05
"""Share of the held-out error that an effect or a sensor's error must take off, and that a formula
must take off the best answer without it: a formula chooses its shape as well, and 5 % is what a
third of the noise floor adds."""
LEAST_LOSS_FALL = 0.05
"""Share of the held-out loss, each row counted by how sure it is, that will do instead: a few rows
near rest may outweigh all others in the squares."""
MOST_GIVEN = 2.5
"""Standard deviations that data sheet and sensors may be off by, at most: an error of more is
something that is missing."""
MOST_RISE = 0.02
"""Share by which the held-out error may rise then."""
LEAST_Z, LEAST_FORMULA_Z = 1.64, 2.33
"""Standard errors over runs of what an effect, and a formula, takes off: 5 % and 1 %, one side."""
KEPT_ERRORS = 4
"""Fits whose errors are kept: those of the last few are asked for again, to choose among them."""


def base_fit(log: Telemetry, start: PowerModel, *, evenly: bool = False) -> Fit:
    """The model fitted to a log, or as stated where that predicts held-out runs better.

    A log whose power is delayed or filtered can bend a fit far away from the robot. Runs that it
    has not seen show that. The model as stated has seen none. They also say whether the robot has
    a part of the base model that the vehicle does not state.

    Args:
        log: the rows.
        start: the model as stated; where the fit starts.
        evenly: all rows weigh the same, as in ``fit``.

    Returns:
        The fit. With ``refused`` set, it is ``start`` with no parameter freed.
    """
    fitted = fit(log, start, evenly=evenly)
    error, stated = heldout_rmse(log, fitted), rms(log.power - predict(start, log))
    for opened in _with_parts(log, start, fitted):
        other = fit(log, opened, evenly=evenly)
        if (less := heldout_rmse(log, other)) < CLAIMED_RATIO * error:
            fitted, error = other, less
    if CLAIMED_RATIO * error <= stated:
        return fitted
    return replace(fit(log, start, free=()), refused=RefusedFit(error, stated))


def _with_parts(log: Telemetry, start: PowerModel, fitted: Fit) -> Iterator[PowerModel]:
    """The start, each time with one part that it states as none and that the residual asks for.

    Nothing says how large such a part may be, whatever its unit: it begins at PART of the power.
    """
    watts, columns = fitted.watts, fitted.columns
    white = fitted.whitened(log, columns)
    for k, place in enumerate(fitted.places):
        if not _stated_as_none(start, place):
            continue
        others = np.delete(white[:, :-1], k, axis=1)
        clear = white[:, k] - others @ np.linalg.lstsq(others, white[:, k], rcond=None)[0]
        if clear @ white[:, -1] > ASKED_Z * float(np.linalg.norm(clear)):
            size = PART * float(np.abs(watts).mean()) / float(np.abs(columns[:, k]).mean())
            values = start.parameters.copy()
            values[place] = np.clip(size, *start.slots[place][2].bounds)
            yield replace(start, parameters=values)


def _stated_as_none(model: PowerModel, place: int) -> bool:
    """Whether a parameter is 0, as its declaration has it: the vehicle does not state it."""
    effect, _, parameter, _ = model.slots[place]
    return effect.base and parameter.default == 0.0 == model.parameters[place]


def _shapes(model: PowerModel, place: int) -> bool:
    """Whether a parameter says where or how wide an effect acts, and not how strongly.

    Every fold keeps it: fitted to fewer runs, a narrow shape moves far, and what is adopted is the
    one of all runs.
    """
    effect, _, parameter, _ = model.slots[place]
    return not effect.base and parameter.null is None


def fold_numbers(log: Telemetry) -> Integers:
    """(n,) fold of every row: by run, or by stretches of rows when there are too few runs."""
    runs, rank = np.unique(log.run, return_inverse=True)
    if len(runs) >= LEAST_RUNS:
        return rank % min(FOLDS, len(runs))
    return stretch_numbers(log) % FOLDS


def stretch_numbers(log: Telemetry) -> Integers:
    """(n,) number of the stretch of rows that takes the place of a run."""
    count = int(np.clip(log.interval.sum() / STRETCH, FOLDS, MOST_STRETCHES))
    return np.arange(len(log)) * count // max(len(log), 1)


@lru_cache(maxsize=KEPT_ERRORS)
def heldout_rmse(log: Telemetry, fitted: Fit) -> float:
    """W, cross-validated by run, of a model that was fitted to this log."""
    return rms(heldout_residual(log, fitted))


def rms(residual: Array) -> float:
    """Root mean square of residuals (n,) W."""
    return float(np.sqrt(np.mean(residual**2)))


def supports(
    log: Telemetry,
    before: Array,
    after: Array,
    spread: Array,
    *,
    formula: bool = False,
    chosen: bool = False,
    grown: float = 1.0,
) -> bool:
    """Whether held-out runs support a claim: an effect, an error of a sensor, a formula.

    The error must fall by a fair share, and it must fall in most runs. Of a robot about to turn
    round on a slope, a millimetre per second decides whether friction helps or hinders, and with it
    several watts. A few such rows can outweigh all others in a mean of squares. So the loss is
    asked, too, to which every row adds as much as it is sure. A formula has no such way out.

    Args:
        log: the rows.
        before, after: (n,) W, held-out residuals of the best answer without the claim, and with it.
        spread: (n,) W, standard deviation of single rows.
        formula: the claim is a formula.
        chosen: nothing asks for a claim, so that it is one of many that chance may favour.
        grown: factor on the residual with the claim where the fall's size is asked for: a part of
            the fall may be no merit of the claim.
    """
    one, other = counted(before, spread), counted(after, spread)
    claimed = (one - other) / spread
    ratio = grown * rms(other) / max(rms(one), 1e-300)
    if formula:
        falls = rms(after) <= rms(before) and ratio <= 1.0 - LEAST_FORMULA_FALL
        return falls and _z_by_run(log, one**2, other**2, claimed) >= LEAST_FORMULA_Z
    surer, sure = huber(before / spread), huber(after / spread)
    share = 1.0 - float(huber(grown * after / spread).mean() / max(surer.mean(), 1e-300))
    # What helps unsure rows alone is no effect.
    falls = ratio <= 1.0 - LEAST_FALL and share >= LEAST_FALL
    least_z = LEAST_FORMULA_Z if chosen else LEAST_Z
    if falls and _z_by_run(log, one**2, other**2, claimed) >= least_z:
        return True
    return (
        ratio <= 1.0 + MOST_RISE
        and share >= LEAST_LOSS_FALL
        and _z_by_run(log, surer, sure, claimed) >= least_z
    )


def _z_by_run(log: Telemetry, before: Array, after: Array, claimed: Array) -> float:
    """Standard errors, over held-out parts, by which a loss (n,) per row falls.

    Of every part the share counts that it falls by: a run of hard driving has most of the loss, and
    says no more about whether the gain is there everywhere. Where a claim changes little, it gains
    little: of a rope that pulls to one side, runs the other way show nothing. So what a part should
    gain is half the same for all and half goes with what the claim changes there. How far a part is
    from what other runs let expect is its error; so one run alone supports no claim.

    Args:
        log: the rows.
        before, after: (n,) losses.
        claimed: (n,) what the claim changes, over the spread of the row.
    """
    part, run = _parts(log)
    rows = np.bincount(part, minlength=len(run))
    one, other, changed = (
        np.maximum(np.bincount(part, values, len(run)), 1e-300)
        for values in (before, after, claimed**2)
    )
    fall = rows * np.log(one / other)
    expected = np.log1p(changed / np.maximum(rows, 1))
    expected = rows * (expected + np.average(expected, weights=rows))
    falls, due = (np.bincount(run, values) for values in (fall, expected))
    elsewhere = (falls.sum() - falls) / np.maximum(due.sum() - due, 1e-300)
    scatter = float(np.linalg.norm(fall - elsewhere[run] * expected))
    return float(fall.sum()) / max(scatter, 1e-300)  # all parts may gain exactly the same


def _parts(log: Telemetry) -> tuple[Integers, Integers]:
    """(n,) number of the part of a log, and (parts,) number of the run that each part is of.

    Parts are runs, halves of few runs, and of fewer stretches, each for itself.
    """
    _, first, run, rows = np.unique(
        log.run, return_index=True, return_inverse=True, return_counts=True
    )
    if len(rows) < LEAST_RUNS:
        part = stretch_numbers(log)
    elif len(rows) < FEW_RUNS:
        part = 2 * run + (np.arange(len(run)) - first[run] >= 0.5 * rows[run])
        return part, np.arange(2 * len(rows)) // 2
    else:
        part = run
    return part, np.arange(part.max() + 1)


def heldout_residual(log: Telemetry, fitted: Fit, given: Array | None = None) -> Array:
    """(n,) W, measured less modelled, of every row by the fit without its fold.

    Args:
        log: the rows.
        fitted: the fit to all of them.
        given: (n, k) W per standard deviation, usual errors of data sheet and sensors, which may
            then explain what they can; None takes what is given for exact.
    """
    model = fitted.model
    at = [k for k, place in enumerate(fitted.places) if not _shapes(model, place)]
    moved, columns = [fitted.places[k] for k in at], fitted.columns[:, at]
    count = len(moved)
    if given is not None:
        columns = np.column_stack([columns, given])
    white = fitted.whitened(log, columns)
    known = Prior.of(model, moved)
    # A part that began large and is not there was fitted with a wide prior, and keeps it.
    wide = np.minimum(known.weights, Prior.of(fitted.begun, moved).weights)
    known = replace(known, weights=wide)
    value = model.parameters[moved]
    free = columns.shape[1] - count
    # Usual errors are slow: rows that correlate say less of them than so many independent ones.
    prior = fitted.noise.redundancy * np.eye(count + free)
    prior[:count, :count] = known.precision
    low = np.concatenate([known.low - value, np.full(free, -MOST_GIVEN)])
    high = np.concatenate([known.high - value, np.full(free, MOST_GIVEN)])
    away = np.concatenate([value - fitted.start[at], np.zeros(free)])
    folds = fold_numbers(log)
    left = np.empty(len(log))
    all_rows = white.T @ white
    for fold in np.unique(folds):
        held = folds == fold
        others = all_rows - white[held].T @ white[held]
        score = others[:-1, -1] - prior @ away
        step = bounded_step(others[:-1, :-1] + prior, score, low, high)
        left[held] = fitted.residual[held] - columns[held] @ step
    return left
