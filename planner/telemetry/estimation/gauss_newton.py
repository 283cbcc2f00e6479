"""Bounded Gauss-Newton steps to the parameters that fit a log best.

    problem = problem_of(log, nodes, model, places)
    best = problem.solve(model, noise, spread, close)      # best.model, best.watts, best.cost
    problem.holding(k, value).solve(…)                     # the same with one of them held

Whitened residuals count at most 3.5 spreads (Huber's pseudo-values); each step is a bounded linear
least-squares problem (scipy.optimize.lsq_linear), so that no parameter leaves its physical range. A
wide prior around the starting value, ten times the spread that its declaration states, keeps a
parameter in place that the log says nothing about. Of the wheels' own factors only the differences
act: their sum is held at zero, so that the bounds are those of each wheel against the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from planner.arrays import Array, Integers
from planner.power.model import PowerModel
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise, clipped, huber
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import Nodes, predict, tangent

MOST_NEWTON_STEPS = 25
"""Steps at most; kinks of friction may keep them from ever becoming small."""
LEAST_STEP_GAIN = 0.01
"""Twice the log-likelihood that a further step must promise: 0.1 standard errors, squared."""
SMALLEST_STRIDE = 1e-2
"""Share of a step below which it is not halved again."""


@dataclass(frozen=True)
class Solution:
    """Where the steps ended.

    Attributes:
        model: with the parameters found.
        watts: (n,) W of it.
        columns: (n, p) derivatives of the watts by the free parameters.
    """

    model: PowerModel
    watts: Array
    columns: Array


@dataclass(frozen=True)
class Problem:
    """A fit to be solved: rows, free parameters and their prior.

    Attributes:
        log, nodes: the rows.
        index: (p,) numbers of the free parameters.
        start: (p,) middle of the prior.
        prior: its weights and bounds; low equals high where a parameter is held.
    """

    log: Telemetry
    nodes: Nodes
    index: Integers
    start: Array
    prior: Prior

    def holding(self, number: int, value: float) -> Problem:
        """The problem with the free parameter of this number held at a value."""
        low, high = self.prior.low.copy(), self.prior.high.copy()
        low[number] = high[number] = value
        return replace(self, prior=replace(self.prior, low=low, high=high))

    def cost_of(self, model: PowerModel, watts: Array, noise: Noise, spread: Array) -> float:
        """Loss of whitened residuals and of the prior, as minus twice a log-likelihood.

        ``watts`` (n,) W are the model's, ``spread`` (n,) W those of single rows.
        """
        residual = (self.log.power - watts)[:, None]
        white = noise.whiten(self.log, watts, spread, residual)
        return self._cost(white[:, 0], model.parameters[self.index])

    def at(self, model: PowerModel, value: Array) -> Solution:
        """The model with other values (p,) of the free parameters, within their bounds."""
        current = self._within(model, value)
        return Solution(current, *tangent(current, self.nodes, self.index.tolist()))

    def predicted(self, model: PowerModel) -> Array:
        """(n,) W that a model says for the rows."""
        return predict(model, self.nodes)

    def _within(self, model: PowerModel, value: Array) -> PowerModel:
        return with_values(model, self.index, np.clip(value, self.prior.low, self.prior.high))

    def solve(
        self, begin: Solution, noise: Noise, spread: Array, close: float = LEAST_STEP_GAIN
    ) -> Solution:
        """Steps until a further one would gain next to nothing.

        Args:
            begin: where the steps begin; within the bounds.
            noise: what the measurement scatters by.
            spread: (n,) W of single rows. Held while the steps go on: a model that says more power
                must not earn a larger spread.
            close: gain, as of a cost, that is next to nothing.
        """
        found, cost = begin, self.cost_of(begin.model, begin.watts, noise, spread)
        for _ in range(MOST_NEWTON_STEPS):
            step, gain = self._step(found, noise, spread)
            full = self.at(found.model, found.model.parameters[self.index] + step)
            if gain < close:
                return full
            ahead = self._part_of(step, found, full, cost - close, noise, spread)
            if ahead is None:
                # Whatever a step promises, at a kink no part of it gains anything.
                return found
            found, cost = ahead
        return found

    def _part_of(
        self,
        step: Array,
        found: Solution,
        full: Solution,
        most: float,
        noise: Noise,
        spread: Array,
    ) -> tuple[Solution, float] | None:
        """The largest part of a step with a cost of ``most`` at most, and its cost.

        ``full`` is where the whole step leads. Kinks of friction and gears make the power
        non-linear, so that it may lead too far.
        """
        begun, stride = found.model.parameters[self.index], 1.0
        model, watts = full.model, full.watts
        # Where a formula has no value, the cost is no number, and no gain.
        while not (cost := self.cost_of(model, watts, noise, spread)) <= most:
            if stride <= SMALLEST_STRIDE:
                return None
            stride *= 0.5
            # Derivatives take ten times as long as the power, and most parts gain nothing.
            model = self._within(found.model, begun + stride * step)
            watts = self.predicted(model)
        return (full if stride == 1.0 else self.at(model, begun + stride * step)), cost

    def _step(self, found: Solution, noise: Noise, spread: Array) -> tuple[Array, float]:
        """The step (p,) that the rows ask for, and what they promise to gain by it, as a cost."""
        log, prior, value = self.log, self.prior, found.model.parameters[self.index]
        residual = log.power - found.watts
        # Far from the solution most rows are "outliers"; the limit then follows the residual.
        far = max(1.0, float(np.median(np.abs(residual) / spread)) / 0.6745)
        both = np.column_stack([found.columns, clipped(residual, far * spread)])
        white = noise.whiten(log, found.watts, spread, both)
        gram, score = white[:, :-1].T @ white[:, :-1], white[:, :-1].T @ white[:, -1]
        held = prior.weights**2 * (value - self.start) + prior.gauge @ value
        step = bounded_step(
            gram + prior.precision, score - held, prior.low - value, prior.high - value
        )
        return step, float(step @ gram @ step)

    def _cost(self, white: Array, value: Array) -> float:
        away = self.prior.weights * (value - self.start)
        return float(huber(white).sum() + away @ away + value @ self.prior.gauge @ value)


def problem_of(log: Telemetry, nodes: Nodes, model: PowerModel, places: Sequence[int]) -> Problem:
    """What a fit of some parameters of a model has to solve; the model is the prior's middle."""
    index = np.array(places, int)
    return Problem(log, nodes, index, model.parameters[index], Prior.of(model, places))


def with_values(model: PowerModel, index: Integers, value: Array) -> PowerModel:
    """The model with other values of some parameters."""
    values = model.parameters.copy()
    values[index] = value
    return replace(model, parameters=values)


def bounded_step(full: Array, right: Array, low: Array, high: Array) -> Array:
    """The step (p,) from low to high that ``full`` (p, p) and the score ``right`` (p,) ask for.

    Parameters whose low and high are the same take that step, whatever the others do.
    """
    step = low.copy()
    free = np.flatnonzero(low < high)
    if len(free) == 0:
        return step
    right = (right - full @ np.where(low < high, 0.0, low))[free]
    full, low, high = full[np.ix_(free, free)], low[free], high[free]
    scale = 1.0 / np.sqrt(np.diag(full))
    factor = np.linalg.cholesky(full * np.outer(scale, scale) + 1e-10 * np.eye(len(full)))
    target = np.linalg.solve(factor, right * scale)
    found = lsq_linear(
        factor.T, target, bounds=(low / scale, high / scale), method="bvls", tol=1e-12
    )
    step[free] = found.x * scale
    return step
