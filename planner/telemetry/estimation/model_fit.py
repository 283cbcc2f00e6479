"""Fit a model's parameters to a log: bounded, robust, with errors and identifiability.

    model = starting_model("minibalance")       # planner.telemetry.starting_model
    result = fit(log, model)
    result.model.parameters, result.model.stderr
    for parameter in result.parameters: print(parameter.name, parameter.value, parameter.note)

The values are those of gauss_newton: residuals are whitened and count
at most 3.5 spreads, no parameter leaves its physical range, and one that the log says nothing about
stays where it starts and is marked as not identifiable. ``evenly`` weights all rows alike.

Standard errors are those of parameter_errors.

Left out
    resistance and torque constant apart: with power alone only R/k_t² shows, and R stands for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.estimation.gauss_newton import LEAST_STEP_GAIN, Problem, Solution, problem_of
from planner.telemetry.estimation.parameter_errors import covariance_of, profiled, run_errors
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import LEAST_SPREAD, Noise, clipped, deviation, noise_of
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import (
    Nodes,
    input_uncertainty,
    meter_columns,
    predict,
    tangent,
)

FIRST_STEP_GAIN = 10.0
"""Twice the log-likelihood that a step of the first fit must promise, see LEAST_STEP_GAIN."""


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

    AT_THE_END: ClassVar[str] = "at the end of its physical range"
    """Note of a parameter that the log would move beyond its bounds."""

    @property
    def at_the_end(self) -> bool:
        """Whether the log would move it beyond its bounds."""
        return self.note == self.AT_THE_END


@dataclass(frozen=True)
class RefusedFit:
    """A fit that held-out runs refute: the model as stated predicts them better.

    Attributes:
        heldout_rmse_w: of the fit, W, on runs that it has not seen.
        stated_rmse_w: of the model as stated, W, on all runs.
    """

    heldout_rmse_w: float
    stated_rmse_w: float

    @property
    def sentence(self) -> str:
        """What was refused, and why."""
        return (
            "The fit to this log is not used: it misses held-out runs by "
            f"{self.heldout_rmse_w:.3g} W, the model as stated by {self.stated_rmse_w:.3g} W."
        )

    def to_json(self) -> dict[str, Any]:
        """The entry ``refused_fit`` of a comparison and of a diagnosis."""
        return {**asdict(self), "sentence": self.sentence}


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted model.

    Attributes:
        model: with the fitted parameters and their standard errors.
        places: numbers of the parameters that were free.
        start: (p,) of these, where the fit began: the middle of the prior.
        covariance: (p, p) of the free parameters.
        watts, residual: (n,) W of the fitted model, and measured less modelled.
        columns: (n, p) W per unit, derivatives of the watts by the free parameters.
        spread: (n,) W, standard deviation of single rows.
        noise: what was taken for noise.
        rmse_w: root mean square of the residual, W.
        parameters: the free ones with remarks.
        refused: None; where this is the model as stated because its fit was refused, both errors.
    """

    model: PowerModel
    places: tuple[int, ...]
    start: Array
    covariance: Array
    watts: Array
    residual: Array
    columns: Array
    spread: Array
    noise: Noise
    rmse_w: float
    parameters: tuple[FittedParameter, ...]
    refused: RefusedFit | None = None

    @property
    def begun(self) -> PowerModel:
        """The model where the fit began: as stated, with the parts that were opened for it."""
        values = self.model.parameters.copy()
        values[list(self.places)] = self.start
        return replace(self.model, parameters=values)

    def unsure_by(self, others: Sequence[Fit]) -> Fit:
        """The fit with standard errors that include how far it is from others on average.

        Args:
            others: of the same parameters, to the same log with more errors of one kind.
        """
        index = list(self.places)
        moved = np.mean([other.model.parameters[index] for other in others], axis=0)
        shift = moved - self.model.parameters[index]
        assert self.model.stderr is not None  # every fit has standard errors
        stderr = self.model.stderr.copy()
        stderr[index] = np.hypot(stderr[index], shift)
        return replace(
            self,
            model=replace(self.model, stderr=stderr),
            covariance=self.covariance + np.outer(shift, shift),
            parameters=tuple(
                replace(one, stderr=float(stderr[place]))
                for one, place in zip(self.parameters, index, strict=True)
            ),
        )

    def whitened(self, log: Telemetry, columns: Array) -> Array:
        """(n, k + 1) columns (n, k) W and the clipped residual, as the fit weighted the rows."""
        counts = self.noise.spread_for_fits(self.spread)
        both = np.column_stack([columns, clipped(self.residual, counts)])
        return self.noise.for_fits().whiten(log, self.watts, counts, both)


def fit(
    log: Telemetry,
    model: PowerModel,
    *,
    free: Sequence[int] | None = None,
    noise: Noise | None = None,
    tried: Sequence[int] = (),
    evenly: bool = False,
    unsure: Array | None = None,
) -> Fit:
    """Fit the free parameters of a model to the measured power.

    Args:
        log: the rows; a sample of a long log (planner.telemetry.sampling.sample).
        model: where the fit starts, and the middle of the prior.
        free: numbers of the parameters to change; None takes all that may be fitted.
        noise: what the measurement scatters by; None estimates it from the residual.
        tried: numbers of the free parameters whose intervals are tried out at both ends.
        evenly: all rows weigh the same (Noise.even_w), where the noise is estimated.
        unsure: (n, k) W per standard deviation, what usual errors of data sheet and sensors do to
            the power; the standard errors then include what they do to the parameters.
    """
    rows = log.rows_for(model.surfaces)
    nodes, input_error = Nodes.of(log, model), input_uncertainty(model, rows)
    places = free_places(model, log) if free is None else tuple(free)
    problem = problem_of(log, nodes, model, places)
    watts, columns = tangent(model, nodes, places)
    found = Solution(model, watts, columns)

    def scatter_of(found: Solution) -> Noise:
        residual = log.power - found.watts
        if noise is None:
            scatter, _ = noise_of(log, residual, found.watts, input_error, found.columns)
        else:
            scatter = noise
        even = evenly if noise is None else scatter.even_w > 0.0
        # Rows weigh the same, but how much against what is known before the log, the fit decides.
        return replace(scatter, even_w=max(deviation(residual), LEAST_SPREAD) if even else 0.0)

    # A first fit only has to show the noise.
    for least_gain in [LEAST_STEP_GAIN] if noise else [FIRST_STEP_GAIN, LEAST_STEP_GAIN]:
        scatter = scatter_of(found)
        spread = scatter.spread_for_fits(scatter.spread(found.watts, input_error))
        found = problem.solve(found, scatter.for_fits(), spread, least_gain)
    scatter = scatter_of(found)
    given = run_errors(found.model, nodes, found.watts, log.present)
    finely = Nodes.of(log, found.model, finely=True)
    given = np.column_stack([predict(found.model, finely) - found.watts, given])
    unsure = np.empty((len(log), 0)) if unsure is None else unsure
    return _finished(problem, found, scatter, input_error, given, unsure, tried)


def _finished(
    problem: Problem,
    found: Solution,
    noise: Noise,
    input_error: Array,
    given: Array,
    unsure: Array,
    tried: Sequence[int],
) -> Fit:
    log, index, model, watts = problem.log, problem.index, found.model, found.watts
    residual = log.power - watts
    spread = noise.spread(watts, input_error)
    counts = noise.spread_for_fits(spread)
    given[:, 0] = clipped(given[:, 0], counts)
    everything = np.column_stack([found.columns, clipped(residual, counts), given, unsure])
    meter = meter_columns(log, predict(model, problem.nodes.unmetered()))
    by_fit = noise.for_fits()
    white = by_fit.whiten(log, watts, counts, np.column_stack([everything, meter]))
    if meter.shape[1]:
        # The meter is as unsure as the parameters are: they answer for what it leaves alone.
        white, beside = np.split(white, [everything.shape[1]], axis=1)
        white = white - beside @ np.linalg.lstsq(beside, white, rcond=None)[0]
    covariance, known = covariance_of(problem, white, unsure.shape[1], noise.redundancy)
    stderr = np.full(len(model.parameters), np.nan) if model.stderr is None else model.stderr.copy()
    stderr[index] = np.sqrt(np.diag(covariance))
    for place in tried:
        k = int(np.flatnonzero(index == place)[0])
        if known[k]:
            stderr[place] = profiled(problem, found, by_fit, counts, white, covariance, k)
    fitted = []
    for k, place in enumerate(index):
        effect, name, parameter, element = model.slots[place]
        value = float(model.parameters[place])
        note = ""
        if not known[k]:
            note = "this log says too little about it; it stays near its starting value"
        elif value != parameter.null and not (problem.prior.low[k] < value < problem.prior.high[k]):
            # One at its null, where the effect is absent, makes up for nothing.
            note = FittedParameter.AT_THE_END
        numbers = value, float(stderr[place]), parameter.unit, bool(known[k])
        fitted.append(FittedParameter(effect.slug, name, element, *numbers, note))
    # What was known of the energy belonged to the values that the fit started from.
    model = replace(model, stderr=stderr, covariance=None, energy_error=None)
    free = tuple(index.tolist()), problem.start, covariance
    rmse = float(np.sqrt(np.mean(residual**2)))
    rows = watts, residual, found.columns, spread
    return Fit(model, *free, *rows, noise, rmse, tuple(fitted))
