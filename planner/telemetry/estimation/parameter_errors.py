"""Standard errors of fitted parameters, and intervals by profile likelihood.

    covariance, known = covariance_of(problem, white)
    run_errors(model, nodes, watts, log.present)      # by what is measured once a run
    stderr = profiled(problem, found, noise, spread, white, covariance, number)

Standard errors come from a jackknife over clusters of rows, which allows for noise that the
whitening left correlated. Clusters of one run share the errors of quantities that are measured once
before it, for example its load; these are added run by run. The change of a parameter under finer
averages of rows in which friction changes side is added too.

A standard error describes the likelihood near its maximum. Where an effect has a shape of its own,
its size and shape may trade against each other along a curve, and the fit stays good much farther
out. So an effect's parameters get profile-likelihood intervals (Bates and Watts, Nonlinear
regression analysis, 1988): each is held at the ends of its interval while all others are fitted
again, and the interval grows until the fit has become as much worse as it should.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation.gauss_newton import Problem, Solution, with_values
from planner.telemetry.noise import Noise
from planner.telemetry.prediction import Nodes, predict
from planner.telemetry.sampling import cluster_numbers

INTERVAL_Z = 1.96
"""Standard errors to the end of a 95 % interval."""
NEAR_ENOUGH = 0.9
"""Share of the expected rise of the cost that ends the search for an interval's end."""
MOST_GROWTH = 2.0
"""Factor by which one trial may lengthen an interval."""
LEAST_STEP_SHARE = 0.5
"""Least share of the distance between a too short and a too long step that the next one takes."""
MOST_TRIALS = 6
"""Fits to find one end of an interval."""
RUN_ERRORS = {"payload": 0.02, "com_x": 0.002, "com_y": 0.002, "ambient_temp": 0.5}
"""kg, m, m and °C: usual errors of what is weighed or measured once before a run."""
LEAST_COST_GAIN = 0.1
"""As gauss_newton.LEAST_STEP_GAIN, for fits of which only the cost counts."""


def run_errors(model: PowerModel, nodes: Nodes, watts: Array, known: Collection[str]) -> Array:
    """What an error of a quantity that is measured once a run does to the power of its rows.

    Args:
        model: the model.
        nodes: the rows of a log.
        watts: (n,) W, what the model says for them.
        known: quantities that the log has.

    Returns:
        (n, k) W, one column for each quantity of RUN_ERRORS that is known and acts, by its usual
        error.
    """
    columns = []
    for name, error in RUN_ERRORS.items():
        if name in known:
            rows = nodes.rows.copy()
            rows[:, INDEX[name]] += error
            column = predict(model, nodes._replace(rows=rows)) - watts
            if np.any(column):
                columns.append(column)
    return np.column_stack(columns) if columns else np.empty((len(watts), 0))


def covariance_of(
    problem: Problem, white: Array, unsure: int = 0, redundancy: float = 1.0
) -> tuple[Array, Mask]:
    """Sandwich covariance, and which parameters the log determines better than the prior.

    What the rows tell scatters together within blocks, and may within whole runs: the wider of the
    two counts. Of the blocks each is left out in turn, because a few of them may tell most of a
    parameter and then show little of their own error; of the runs, which one alone may tell all
    of it, the sums count, with the correction for few of them (Cameron and Miller, A practitioner's
    guide to cluster-robust inference, 2015: CR3 and CR1).
    ``white`` is whitened: the free parameters' columns, the clipped residual, what a finer average
    within rows would change, what errors that last for a run do, and last the ``unsure`` columns of
    errors that last for the whole log. Of these the rows say what they can, fewer of them by
    ``redundancy`` (Noise.redundancy): a fit that leaves them out is off by what is likely of them.
    """
    log, prior = problem.log, problem.prior.weights
    count = len(prior)
    own, scores = white[:, :count], white[:, :count] * white[:, count : count + 1]
    full = own.T @ own + problem.prior.precision
    inverse = inverse_of(full)
    _, run = np.unique(log.run, return_inverse=True)
    runs = _sums_by(run, scores)
    # Columns whose outer products add up: rounding then leaves no variance below zero.
    lasting = [np.diag(prior), (own.T @ white[:, count + 1])[:, None]]
    white, always = np.split(white, [white.shape[1] - unsure], axis=1)
    shared = own.T @ always
    clear = always - own @ (inverse @ shared)
    unlikely = redundancy * np.eye(unsure) + clear.T @ clear
    found = np.linalg.solve(unlikely, clear.T @ white[:, count])
    each = np.linalg.solve(np.linalg.cholesky(unlikely), shared.T).T
    lasting += [math.sqrt(redundancy) * each, (shared @ found)[:, None]]
    lasting += [_sums_by(run, own * column[:, None]).T for column in white[:, count + 2 :].T]
    moved = inverse @ np.concatenate(lasting, axis=1)
    left_out = without_each(full, own, scores, cluster_numbers(log))
    covariance = left_out.T @ left_out * ((len(left_out) - 1) / len(left_out)) + moved @ moved.T
    if len(runs) > 1:
        by_run = inverse @ runs.T * math.sqrt(len(runs) / (len(runs) - 1))
        of_runs = (by_run**2).sum(axis=1) + (moved**2).sum(axis=1)
        wider = np.sqrt(np.maximum(of_runs / np.maximum(np.diag(covariance), 1e-300), 1.0))
        covariance *= np.outer(wider, wider)
    plain = np.diag(inverse)
    # Where the data halve the prior's variance they are what the value rests on.
    known = plain * prior**2 < 0.5
    return np.asarray(covariance), np.asarray(known)


def without_each(full: Array, own: Array, scores: Array, number: Integers) -> Array:
    """(blocks, p) change of the parameters when each block in turn is left out, to first order.

    ``full`` is (p, p), of all rows and the prior; ``own`` (n, p) whitened derivatives.
    """
    scale = 1.0 / np.sqrt(np.diag(full))
    whole = full * np.outer(scale, scale)
    found = []
    for block in np.split(own * scale, np.flatnonzero(np.diff(number)) + 1):
        found.append(whole - block.T @ block)
    sums = _sums_by(number, scores) * scale
    rest = np.stack(found) + 1e-12 * np.eye(len(full))
    return np.asarray(np.linalg.solve(rest, -sums[:, :, None])[:, :, 0] * scale)


def _sums_by(number: Integers, values: Array) -> Array:
    sums = np.zeros((int(number.max()) + 1, values.shape[1]))
    np.add.at(sums, number, values)
    return sums


def profiled(
    problem: Problem,
    found: Solution,
    noise: Noise,
    spread: Array,
    white: Array,
    covariance: Array,
    number: int,
) -> float:
    """Standard error of a free parameter whose interval was tried out at both ends.

    Args:
        problem, found: the fit.
        noise: what the measurement scatters by.
        spread: (n,) W of single rows.
        white: (n, p …) whitened derivatives by the free parameters, as for ``covariance_of``.
        covariance: (p, p) of the free parameters.
        number: which of them.

    Returns:
        Half the length of the longer side's interval over 1.96; never less than the covariance
        says.
    """
    count = len(problem.index)
    inverse = inverse_of(white[:, :count].T @ white[:, :count] + problem.prior.precision)
    stderr = float(np.sqrt(covariance[number, number]))
    # What the rows scatter by beyond what the whitening says makes every rise count less.
    expected = covariance[number, number] / inverse[number, number]
    along = inverse[:, number] / inverse[number, number]
    lowest = problem.cost_of(found.model, found.watts, noise, spread)
    value = found.model.parameters[problem.index]

    def rise(step: float, others: bool) -> float:
        """Root of the cost above the lowest with the parameter held, in standard errors.

        ``others`` are fitted anew, or go where a straight line leads them.
        """
        held = problem.holding(number, value[number] + step)
        if others:
            model = held.solve(
                held.at(found.model, value + step * along), noise, spread, LEAST_COST_GAIN
            ).model
        else:
            free = np.clip(value + step * along, held.prior.low, held.prior.high)
            model = with_values(found.model, problem.index, free)
        cost = problem.cost_of(model, predict(model, problem.nodes), noise, spread)
        return float(np.sqrt(max(cost - lowest, 0.0) / expected))

    longest = stderr
    for room in (
        problem.prior.low[number] - value[number],
        problem.prior.high[number] - value[number],
    ):
        longest = max(longest, abs(end_of_interval(rise, stderr, room)) / INTERVAL_Z)
    return longest


def end_of_interval(rise: Callable[[float, bool], float], stderr: float, room: float) -> float:
    """Step to where the fit is as much worse as at 1.96 standard errors, or to the bound.

    ``room`` is the step to the bound.
    """
    step = float(np.copysign(min(INTERVAL_Z * stderr, abs(room)), room))
    if abs(step) < INTERVAL_Z * stderr:
        return step
    if NEAR_ENOUGH < rise(step, False) / INTERVAL_Z < 1.0 / NEAR_ENOUGH:
        return step
    near = far = (0.0, 0.0)  # step and rise; ``far`` once the end lies before it
    for _ in range(MOST_TRIALS):
        risen = rise(step, True)
        if risen < NEAR_ENOUGH * INTERVAL_Z:
            near = step, risen
        elif not near[0] or risen < INTERVAL_Z / NEAR_ENOUGH:
            return step
        else:
            far = step, risen
        if far[0]:
            share = (INTERVAL_Z - near[1]) / (far[1] - near[1])
            step = near[0] + (far[0] - near[0]) * max(share, LEAST_STEP_SHARE)
        elif step == room:
            return room
        else:
            factor = min(MOST_GROWTH, max(INTERVAL_Z / max(risen, 1e-9), 1.1))
            step = float(np.copysign(min(abs(step) * factor, abs(room)), room))
    return step


def inverse_of(matrix: Array, smallest: float = 1e-14) -> Array:
    """Inverse of a positive definite (p, p) matrix whose rows have units of very different sizes.

    Directions in which the scaled matrix is less than ``smallest`` of its largest get no inverse.
    """
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inner = np.linalg.pinv(matrix * np.outer(scale, scale), rcond=smallest, hermitian=True)
    return np.asarray(inner * np.outer(scale, scale))
