"""Fit a model's parameters to a log: bounded, robust, with errors and what cannot be told.

    model = starting_model("minibalance", log)
    result = fit(log, model)
    result.model.parameters, result.model.stderr
    for parameter in result.parameters: print(parameter.name, parameter.value, parameter.note)

Gauss-Newton steps on whitened residuals that count at most 3.5 spreads (Huber's pseudo-values);
each step is a bounded linear least-squares problem (scipy.optimize.lsq_linear), so that no
parameter leaves its physical range. A wide prior around the starting value, ten times the spread
that its declaration states, keeps a parameter in place that the log says nothing about; such a
parameter is marked as not identifiable. Of the wheels' own factors only the differences act: their
sum is held at zero, so that the bounds are those of each wheel against the mean.

Standard errors come from the scatter of the score over blocks of rows (a sandwich), which allows
for noise that the whitening did not get right. Blocks of one run share the errors of what was
measured once before it, its load say; these are added run by run. What a parameter would change by
if rows in which friction changes side were averaged more finely is added as well.

Left out
    resistance and torque constant apart: with power alone only R/k_t² shows, and R stands for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from planner.power.model import PowerModel
from planner.power.vehicle import Vehicle, load_vehicle
from planner.telemetry.blocks import block_numbers
from planner.telemetry.interval import MANY_MOMENTS, interval_nodes
from planner.telemetry.log import Telemetry
from planner.telemetry.noise import CLIP, Noise, huber, noise_of
from planner.telemetry.sensitivity import doubt_of, mean_watts, predict, run_errors, sizes, tangent

Floats = NDArray[np.float64]

PRIOR_SPREADS = 10.0
"""Standard deviation of the prior, in multiples of the declared spread of a parameter."""
GAUGE = 1e3
"""One over the standard deviation that the sum of the wheels' own factors is held with."""
STEPS = 25
CLOSE = 0.01
"""Gain of log-likelihood, doubled, that a further step must promise."""
FOLDS = 5
AT_THE_END = "at the end of its physical range"
"""Note of a parameter that the log would move beyond its bounds."""


@dataclass(frozen=True)
class FittedParameter:
    """One number of a fitted model."""

    effect: str
    name: str
    element: int
    value: float
    stderr: float
    unit: str
    identifiable: bool
    note: str


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes:
        model: with the fitted parameters and their standard errors.
        places: numbers of the parameters that were free.
        start: (p,) of these, where the fit began: the middle of the prior.
        covariance: (p, p) of the free parameters.
        watts, residual: (n,) W of the fitted model, and measured less modelled.
        spread: (n,) W, standard deviation of single rows.
        noise: what was taken for noise.
        rmse_w: root mean square of the residual, W.
        parameters: the free ones with remarks.
    """

    model: PowerModel
    places: tuple[int, ...]
    start: Floats
    covariance: Floats
    watts: Floats
    residual: Floats
    spread: Floats
    noise: Noise
    rmse_w: float
    parameters: tuple[FittedParameter, ...]


def starting_model(given: PowerModel | Vehicle | str | Path) -> PowerModel:
    """The model that a comparison starts from: a vehicle's base model, or a model as it is.

    Raises:
        VehicleError: no such vehicle, or its file cannot be used.
    """
    if isinstance(given, PowerModel):
        return given
    vehicle = given if isinstance(given, Vehicle) else load_vehicle(str(given))
    return PowerModel.from_vehicle(vehicle, effects=())


def free_places(model: PowerModel, log: Telemetry) -> tuple[int, ...]:
    """Numbers of the parameters that a fit to this log may change.

    Where every row has a label of the ground, the commonest one keeps its factor: the drag
    coefficients are those of that ground, otherwise both could change against each other. The
    scanned shape of an effect is free where the effect acts.
    """
    labelled = log.rows_for(model.surfaces)[:, _SURFACE] if model.surfaces else np.array([-1.0])
    reference = -1
    if np.all(labelled >= 0):
        reference = int(np.argmax(np.bincount(labelled.astype(int))))
    acting = {
        effect.slug
        for (effect, _, parameter, _), value in zip(model.slots, model.parameters, strict=True)
        if parameter.null is not None and value != parameter.null
    }
    places = []
    for place, (effect, _, parameter, element) in enumerate(model.slots):
        shaping = bool(parameter.grid) and effect.slug in acting
        reference_ground = parameter.per == "surface" and element == reference
        if (parameter.fitted or shaping) and not reference_ground:
            places.append(place)
    return tuple(places)


def fit(
    log: Telemetry,
    model: PowerModel,
    *,
    free: Sequence[int] | None = None,
    noise: Noise | None = None,
) -> Fit:
    """Fit the free parameters of a model to the measured power.

    Args:
        log: the rows; a sample of a long log (planner.telemetry.sample).
        model: where the fit starts, and the middle of the prior.
        free: numbers of the parameters to change; None takes all that may be fitted.
        noise: what the measurement scatters by; None estimates it from the residual.
    """
    rows = log.rows_for(model.surfaces)
    nodes, doubt = interval_nodes(rows, log.interval, model), doubt_of(model, rows)
    places = free_places(model, log) if free is None else tuple(free)
    index = np.array(places, int)
    low, high = _bounds(model, index)
    prior, gauge = _prior_weights(model, index), _gauge(model, index)
    start = model.parameters[index].copy()
    value = start.copy()
    current = model
    watts, columns = tangent(current, nodes, places)
    for round_number in range(2 if noise is None else 1):
        scatter = noise or noise_of(log, log.power - watts, watts, doubt, columns)
        # Held while the fit runs: a model that says more power must not earn a larger spread.
        spread = scatter.spread(watts, doubt)
        # A first fit only has to show the noise.
        close = CLOSE if round_number or noise is not None else 10.0
        best, stride, settled = np.inf, 1.0, value
        step = np.zeros(len(index))
        for _ in range(STEPS):
            residual = log.power - watts
            # Far from the solution most rows are "outliers"; the limit then follows the residual.
            far = max(1.0, float(np.median(np.abs(residual) / spread)) / 0.6745)
            clipped = _clipped(residual, far * spread)
            everything = np.column_stack([columns, clipped, residual])
            white = scatter.whiten(log, watts, spread, everything)
            # Squares of clipped residuals would not show that large ones have become smaller.
            cost = float(huber(white[:, -1]).sum() + (((value - start) * prior) ** 2).sum())
            cost += float(value @ gauge @ value)
            white = white[:, :-1]
            if cost > best + close and stride > 1e-2:
                # The step went too far: kinks of friction and gears make the power non-linear.
                stride *= 0.5
                value = value - stride * step
            else:
                best, stride, settled = cost, 1.0, value
                gram, score = white[:, :-1].T @ white[:, :-1], white[:, :-1].T @ white[:, -1]
                held = prior**2 * (value - start) + gauge @ value
                full = gram + gauge + np.diag(prior**2)
                step = bounded_step(full, score - held, low - value, high - value)
                value = np.clip(value + step, low, high)  # rounding may end beyond a bound
            current = _with(model, index, value)
            watts, columns = tangent(current, nodes, places)
            if stride == 1.0 and float(step @ gram @ step) < close:
                break
        else:
            value = settled  # the last step was not looked at
            current = _with(model, index, value)
            watts, columns = tangent(current, nodes, places)
    scatter = noise or noise_of(log, log.power - watts, watts, doubt, columns)
    given = run_errors(current, nodes, watts, log.present)
    finely = interval_nodes(rows, log.interval, current, MANY_MOMENTS)
    given = np.column_stack([mean_watts(current, finely) - watts, given])
    return _finished(
        log, current, index, start, prior, gauge, watts, columns, scatter, doubt, given
    )


def prior_of(model: PowerModel, places: Sequence[int]) -> tuple[Floats, Floats, Floats]:
    """What is known of some parameters without any log.

    Returns:
        (p, p) inverse covariance of the prior, and (p,) lowest and (p,) highest possible values.
    """
    index = np.array(places, int)
    low, high = _bounds(model, index)
    return np.diag(_prior_weights(model, index) ** 2) + _gauge(model, index), low, high


_SURFACE = 15


def _with(model: PowerModel, index: NDArray[np.int64], value: Floats) -> PowerModel:
    values = model.parameters.copy()
    values[index] = value
    return replace(model, parameters=values)


def _bounds(model: PowerModel, index: NDArray[np.int64]) -> tuple[Floats, Floats]:
    bounds = np.array([model.slots[place][2].bounds for place in index], float).reshape(-1, 2)
    for k, place in enumerate(index):
        if grid := model.slots[place][2].grid:
            # A shape is looked for where its grid says that physics has it, not beyond.
            given = model.parameters[place]
            bounds[k] = min(grid[0], given), max(grid[-1], given)
    return bounds[:, 0], bounds[:, 1]


def _prior_weights(model: PowerModel, index: NDArray[np.int64]) -> Floats:
    """One over the prior's standard deviation of every free parameter."""
    size = sizes(model)[index]
    spread = np.array([model.slots[place][2].spread for place in index])
    return 1.0 / np.maximum(PRIOR_SPREADS * spread * size, 1e-300)


def _gauge(model: PowerModel, index: NDArray[np.int64]) -> Floats:
    """(p, p) weights that hold the sum of the wheels' own factors at zero: it changes nothing."""
    groups: dict[tuple[str, str], list[int]] = {}
    for k, place in enumerate(index):
        effect, name, parameter, _ = model.slots[place]
        if parameter.per == "wheel":
            groups.setdefault((effect.slug, name), []).append(k)
    gauge = np.zeros((len(index), len(index)))
    for group in groups.values():
        if len(group) == model.vehicle.layout.wheel_count:
            gauge[np.ix_(group, group)] = GAUGE**2
    return gauge


def _clipped(residual: Floats, spread: Floats) -> Floats:
    return np.clip(residual, -CLIP * spread, CLIP * spread)


def bounded_step(full: Floats, right: Floats, low: Floats, high: Floats) -> Floats:
    """The step (p,) from low to high that ``full`` (p, p) and the score ``right`` (p,) ask for."""
    scale = 1.0 / np.sqrt(np.diag(full))
    factor = np.linalg.cholesky(full * np.outer(scale, scale) + 1e-10 * np.eye(len(full)))
    target = np.linalg.solve(factor, right * scale)
    if np.all(low < high):
        found = lsq_linear(
            factor.T, target, bounds=(low / scale, high / scale), method="bvls", tol=1e-12
        )
        return np.asarray(found.x * scale)
    return np.asarray(np.clip(np.linalg.solve(factor.T, target) * scale, low, high))


def _finished(
    log: Telemetry,
    model: PowerModel,
    index: NDArray[np.int64],
    start: Floats,
    prior: Floats,
    gauge: Floats,
    watts: Floats,
    columns: Floats,
    noise: Noise,
    doubt: Floats,
    given: Floats,
) -> Fit:
    residual = log.power - watts
    spread = noise.spread(watts, doubt)
    given[:, 0] = _clipped(given[:, 0], spread)
    everything = np.column_stack([columns, _clipped(residual, spread), given])
    white = noise.whiten(log, watts, spread, everything)
    covariance, known = _covariance(log, white, prior, gauge)
    stderr = np.full(len(model.parameters), np.nan) if model.stderr is None else model.stderr.copy()
    stderr[index] = np.sqrt(np.diag(covariance))
    fitted = []
    low, high = _bounds(model, index)
    for k, place in enumerate(index):
        effect, name, parameter, element = model.slots[place]
        value = float(model.parameters[place])
        note = ""
        if not known[k]:
            note = "this log says too little about it; it stays near its starting value"
        elif value <= low[k] or value >= high[k]:
            note = AT_THE_END
        fitted.append(
            FittedParameter(
                effect.slug,
                name,
                element,
                value,
                float(stderr[place]),
                parameter.unit,
                bool(known[k]),
                note,
            )
        )
    return Fit(
        # What was known of the energy belonged to the values that the fit started from.
        replace(model, stderr=stderr, covariance=None, energy_error=None),
        tuple(index.tolist()),
        start,
        covariance,
        watts,
        residual,
        spread,
        noise,
        float(np.sqrt(np.mean(residual**2))),
        tuple(fitted),
    )


def _covariance(
    log: Telemetry, white: Floats, prior: Floats, gauge: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Sandwich covariance, and which parameters the log tells more about than the prior did.

    What the rows tell scatters together within blocks, and may within whole runs: the wider of the
    two counts, with the correction for few clusters (Cameron and Miller, A practitioner's guide to
    cluster-robust inference, 2015).
    ``white`` is whitened: the free parameters' columns, the clipped residual, what a finer average
    within rows would change, and what errors that last for a run do.
    """
    count = len(prior)
    own, scores = white[:, :count], white[:, :count] * white[:, count : count + 1]
    blocks = _sums_by(block_numbers(log), scores)
    gram = own.T @ own
    inverse = np.linalg.pinv(gram + gauge + np.diag(prior**2), rcond=1e-14, hermitian=True)
    _, run = np.unique(log.run, return_inverse=True)
    runs = _sums_by(run, scores)
    lasting = np.diag(prior**2)
    averaged = own.T @ white[:, count + 1]
    lasting += np.outer(averaged, averaged)
    for column in white[:, count + 2 :].T:
        by_run = _sums_by(run, own * column[:, None])
        lasting += by_run.T @ by_run
    middle = blocks.T @ blocks * (len(blocks) / max(len(blocks) - count, 1)) + lasting
    covariance = inverse @ np.maximum(middle, middle.T) @ inverse
    if len(runs) > 1:
        middle = runs.T @ runs * (len(runs) / (len(runs) - 1)) + lasting
        of_runs = np.diag(inverse @ middle @ inverse)
        wider = np.sqrt(np.maximum(of_runs / np.maximum(np.diag(covariance), 1e-300), 1.0))
        covariance *= np.outer(wider, wider)
    plain = np.diag(inverse)
    # Where the data halve the prior's variance they are what the value rests on.
    known = plain * prior**2 < 0.5
    return np.asarray(covariance), np.asarray(known)


def _sums_by(number: NDArray[np.int64], values: Floats) -> Floats:
    sums = np.zeros((int(number.max()) + 1, values.shape[1]))
    np.add.at(sums, number, values)
    return sums


@dataclass(frozen=True)
class CrossValidation:
    """Error on rows that a fit has not seen, held out by run.

    Attributes:
        prediction: (n,) W of every row by the fit without its fold.
        heldout_rmse_w: over all rows, W.
        rmse_by_fold: W.
        by_run: True when folds are whole runs; False when the log has too few of them.
    """

    prediction: Floats
    heldout_rmse_w: float
    rmse_by_fold: tuple[float, ...]
    by_run: bool


def fold_numbers(log: Telemetry, folds: int = FOLDS) -> tuple[NDArray[np.int64], bool]:
    """(n,) fold of every row: by run, or by stretches of rows when there are too few runs."""
    runs = len(np.unique(log.run))
    if runs >= 4:
        rank = np.searchsorted(np.unique(log.run), log.run)
        return rank % min(folds, runs), True
    stretch = np.arange(len(log)) * (4 * folds) // max(len(log), 1)
    return stretch % folds, False


def cross_validate(
    log: Telemetry,
    model: PowerModel,
    folds: int = FOLDS,
    *,
    free: Sequence[int] | None = None,
    noise: Noise | None = None,
) -> CrossValidation:
    """Fit without each fold in turn and predict it; arguments as ``fit``."""
    number, by_run = fold_numbers(log, folds)
    prediction = np.empty(len(log))
    errors = []
    for fold in np.unique(number):
        out = number == fold
        fitted = fit(log.take(~out), model, free=free, noise=noise)
        prediction[out] = predict(fitted.model, log.take(out))
        errors.append(float(np.sqrt(np.mean((log.power[out] - prediction[out]) ** 2))))
    rmse = float(np.sqrt(np.mean((log.power - prediction) ** 2)))
    return CrossValidation(prediction, rmse, tuple(errors), by_run)
