"""Parameters that fit a log best, by bounded Gauss-Newton steps.

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
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise, clipped, huber
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import Nodes, tangent

STEPS = 25
CLOSE = 0.01
"""Gain of log-likelihood, doubled, that a further step must promise."""


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
    """Rows, free parameters, and what is known of them without the rows.

    Attributes:
        log, nodes: the rows.
        index: (p,) numbers of the free parameters.
        start: (p,) middle of the prior.
        prior: (p,) one over its standard deviation.
        gauge: (p, p) weights that hold the sum of the wheels' own factors.
        low, high: (p,) lowest and highest possible values; the same where one is held.
    """

    log: Telemetry
    nodes: Nodes
    index: NDArray[np.int64]
    start: Array
    prior: Array
    gauge: Array
    low: Array
    high: Array

    @property
    def known(self) -> Array:
        """(p, p) inverse covariance of what is known without the rows."""
        return self.gauge + np.diag(self.prior**2)

    def holding(self, number: int, value: float) -> Problem:
        """The problem with the free parameter of this number held at a value."""
        low, high = self.low.copy(), self.high.copy()
        low[number] = high[number] = value
        return replace(self, low=low, high=high)

    def cost_of(self, model: PowerModel, watts: Array, noise: Noise, spread: Array) -> float:
        """Loss of whitened residuals and of the prior, as minus twice a log-likelihood.

        ``watts`` (n,) W are the model's, ``spread`` (n,) W those of single rows.
        """
        residual = (self.log.power - watts)[:, None]
        white = noise.whiten(self.log, watts, spread, residual)
        return self._cost(white[:, 0], model.parameters[self.index])

    def at(self, model: PowerModel, value: Array) -> Solution:
        """The model with other values (p,) of the free parameters, within their bounds."""
        current = with_values(model, self.index, np.clip(value, self.low, self.high))
        return Solution(current, *tangent(current, self.nodes, self.index.tolist()))

    def solve(self, begin: Solution, noise: Noise, spread: Array, close: float = CLOSE) -> Solution:
        """Steps until a further one would gain next to nothing.

        Args:
            begin: where the steps begin; within the bounds.
            noise: what the measurement scatters by.
            spread: (n,) W of single rows. Held while the steps go on: a model that says more power
                must not earn a larger spread.
            close: gain, as of a cost, that is next to nothing.
        """
        log = self.log
        found = begin
        value = begin.model.parameters[self.index]
        best, stride, settled = np.inf, 1.0, value
        step, known = np.zeros(len(self.index)), self.known
        for _ in range(STEPS):
            residual = log.power - found.watts
            # Far from the solution most rows are "outliers"; the limit then follows the residual.
            far = max(1.0, float(np.median(np.abs(residual) / spread)) / 0.6745)
            everything = np.column_stack([found.columns, clipped(residual, far * spread), residual])
            white = noise.whiten(log, found.watts, spread, everything)
            # Squares of clipped residuals would not show that large ones have become smaller.
            cost = self._cost(white[:, -1], value)
            white = white[:, :-1]
            if cost > best + close and stride > 1e-2:
                # The step went too far: kinks of friction and gears make the power non-linear.
                stride *= 0.5
                value = value - stride * step
            else:
                best, stride, settled = cost, 1.0, value
                gram, score = white[:, :-1].T @ white[:, :-1], white[:, :-1].T @ white[:, -1]
                held = self.prior**2 * (value - self.start) + self.gauge @ value
                low, high = self.low - value, self.high - value
                step = bounded_step(gram + known, score - held, low, high)
                # Rounding may end beyond a bound.
                value = np.clip(value + step, self.low, self.high)
            found = self.at(found.model, value)
            if stride == 1.0 and float(step @ gram @ step) < close:
                break
        else:
            # The last step was not looked at.
            found = self.at(found.model, settled)
        return found

    def _cost(self, white: Array, value: Array) -> float:
        away = self.prior * (value - self.start)
        return float(huber(white).sum() + away @ away + value @ self.gauge @ value)


def problem_of(log: Telemetry, nodes: Nodes, model: PowerModel, places: Sequence[int]) -> Problem:
    """What a fit of some parameters of a model has to solve; the model is the prior's middle."""
    prior = Prior.of(model, places)
    start = model.parameters[np.array(places, int)]
    return Problem(
        log,
        nodes,
        np.array(places, int),
        start,
        prior.weights,
        prior.gauge,
        prior.low,
        prior.high,
    )


def with_values(model: PowerModel, index: NDArray[np.int64], value: Array) -> PowerModel:
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
