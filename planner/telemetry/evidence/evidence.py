"""Sufficient statistics of a log: likelihood gains and cluster-robust tests of columns.

    evidence = Evidence(tangent, clusters, plain, rows, slow)   # see gram_matrices
    evidence.gain(columns)                            # log-likelihood gained by some columns
    evidence.test(columns, given=others)              # is their coefficient zero?
    evidence.compare(first, second)                   # which of two sets explains more? (Vuong)

The model's Jacobian is always in: what refitting its parameters could absorb counts for nothing.
All tests use the scatter of the score over clusters, and over runs for columns that hardly change
within a run; so noise that the whitening left correlated cannot make everything significant. They
are in Wald form: the scatter is taken at the fit with the tested columns, otherwise a huge effect
would hide itself.

Source
    score and sandwich: White, "Maximum likelihood estimation of misspecified models", Econometrica
    50(1), 1982; comparison of sets that do not contain each other: Vuong, "Likelihood ratio tests
    for model selection and non-nested hypotheses", Econometrica 57(2), 1989.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from planner.arrays import Array, Integers
from planner.telemetry.evidence.gram_matrices import RowClusters

ALIAS_COSINE = 0.95
"""Cosine of what refitting leaves of two effects' columns, from which they are aliases in this log:
naming one says the other, too. Others that explain as much say that it is neither."""
RIDGE = 1e-9
"""Added to scaled diagonals, so that collinear columns can be solved for."""
SLOW_SHARE = 0.2
"""Share of a column's variance between runs from which the scatter over runs counts too."""
RUNS_ONLY_SHARE = 0.4
"""Share of variance between runs from which runs alone count as degrees of freedom."""


@dataclass(frozen=True)
class Test:
    """Is a set of coefficients zero?

    Attributes:
        z: normal deviate of the same tail probability.
        p_value: two-sided.
        coefficients: (k,) estimates.
        information: (k, k) what the log tells of them once all else is fitted.
        statistic: Wald's, by the widest scatter; ``free`` its degrees of freedom.
    """

    z: float
    p_value: float
    coefficients: Array
    information: Array
    statistic: float
    free: int


class Evidence:
    """Products of whitened columns: Jacobian of the model, competing terms, residual last.

    Args:
        tangent: number of the model's own columns, which come first.
        clusters: the whitened columns.
        plain: (columns, columns) products over the spread of each row, not whitened.
        rows: how many.
        slow: (columns,) share of every column's variance that lies between runs.
    """

    def __init__(
        self, tangent: int, clusters: RowClusters, plain: Array, rows: int, slow: Array
    ) -> None:
        self.tangent = own = np.arange(tangent)
        self.clusters, self.plain, self.rows, self.slow = clusters, plain, rows, slow
        self.total = clusters.total()
        self.columns = len(self.total)
        self.residual = self.columns - 1
        self.absorbed = solve(self.total[np.ix_(own, own)], self.total[own])
        self.partial = self.total - self.total[:, own] @ self.absorbed
        runs, self._run_number = np.unique(clusters.runs, return_inverse=True)
        self.run_count = len(runs)

    @property
    def cluster_count(self) -> int:
        """Number of clusters."""
        return len(self.clusters.runs)

    def size(self, columns: Sequence[int], coefficients: Array, given: Sequence[int] = ()) -> float:
        """ρ: rms of what some columns add once everything else is refitted, over the noise.

        Taken over the rows as they are: whitening would make a slow effect look small.
        """
        at = list(columns)
        rest = [*self.tangent.tolist(), *given]
        clear = self.plain[np.ix_(at, at)] - self.plain[np.ix_(at, rest)] @ solve(
            self.plain[np.ix_(rest, rest)], self.plain[np.ix_(rest, at)]
        )
        return float(np.sqrt(max(float(coefficients @ clear @ coefficients), 0.0) / self.rows))

    def tolerance(self, column: int) -> float:
        """Share of a column's variance that refitting the model cannot absorb."""
        raw = self.total[column, column]
        return float(self.partial[column, column] / raw) if raw > 0 else 0.0

    def coefficients(self, columns: Sequence[int]) -> Array:
        """(k,) best coefficients of some columns, with the tangent."""
        at = list(columns)
        return solve(self.partial[np.ix_(at, at)], self.partial[at, self.residual])

    def gain(self, columns: Sequence[int]) -> tuple[float, Array]:
        """Log-likelihood gained by some columns over the tangent alone, and their coefficients."""
        if not len(columns):
            return 0.0, np.zeros(0)
        found = self.coefficients(columns)
        return float(0.5 * found @ self.partial[list(columns), self.residual]), found

    def gains(self, columns: Integers) -> tuple[Array, Array]:
        """``gain`` of many sets of as many columns (s, k) at once: (s,) and (s, k)."""
        inner = self.partial[columns[:, :, None], columns[:, None, :]]
        right = self.partial[columns, self.residual]
        scale = np.sqrt(np.maximum(np.diagonal(inner, axis1=1, axis2=2), 1e-300))
        scaled = inner / (scale[:, :, None] * scale[:, None, :]) + RIDGE * np.eye(inner.shape[1])
        try:
            found = np.linalg.solve(scaled, (right / scale)[:, :, None])[:, :, 0] / scale
        except np.linalg.LinAlgError:
            found = np.array([self.coefficients(each) for each in columns.tolist()])
        return 0.5 * np.sum(found * right, axis=1), found

    def _fit(self, columns: Sequence[int]) -> Array:
        """(columns,) vector v with residual = Z v after fitting tangent and some columns."""
        at = [*self.tangent.tolist(), *columns]
        v = np.zeros(self.columns)
        v[at] = -self.fitted(at)
        v[self.residual] = 1.0
        return v

    def fitted(self, columns: Sequence[int]) -> Array:
        """(k,) coefficients of exactly these columns, the tangent not added."""
        at = list(columns)
        return solve(self.total[np.ix_(at, at)], self.total[at, self.residual])

    def test(self, columns: Sequence[int], given: Sequence[int] = ()) -> Test:
        """Are the coefficients of some columns zero, once ``given`` ones are fitted?"""
        at = np.array(columns, int)
        active, beta, cluster_scores = self._scores(at, given)
        cluster_information = self.clusters.partial_grams(at, active, beta)
        total, information = cluster_scores.sum(axis=0), cluster_information.sum(axis=0)
        found = solve(information, total)
        left = cluster_scores - np.einsum("bkl,l->bk", cluster_information, found)
        slow = float(np.max(self.slow[at], initial=0.0))
        statistic, free = self._statistic(total, information, left, slow)
        size = len(at)
        p_value = float(stats.f.sf(statistic / size, size, free))
        z = float(stats.norm.isf(max(p_value, 1e-300) / 2.0))
        return Test(z, p_value, found, information, statistic, free)

    def robust_gain(self, columns: Sequence[int], given: Sequence[int]) -> float:
        """Log-likelihood gained by some columns beside ``given`` ones, by their test's statistic.

        That of Student's distribution, since the scatter is known from few clusters or runs.
        """
        test = self.test(columns, given)
        share = np.log1p(test.statistic / test.free)
        return float(0.5 * (test.free + len(columns)) * share)

    def _scores(self, at: Integers, given: Sequence[int]) -> tuple[Integers, Array, Array]:
        """Fitted columns, what they explain of some others, and the scores of these by cluster."""
        active = np.array([*self.tangent.tolist(), *given], int)
        beta = solve(self.total[np.ix_(active, active)], self.total[np.ix_(active, at)])
        scores = self.clusters.times(self._fit(given))
        return active, beta, scores[:, at] - scores[:, active] @ beta

    def _statistic(
        self, total: Array, information: Array, left: Array, slow: float
    ) -> tuple[float, int]:
        """Wald's statistic by the widest scatter, and its degrees of freedom."""
        count, size = self.cluster_count, len(total)
        scatters = [information]
        if count > size + 2:
            scatters.append(left.T @ left * count / (count - 1))
        if slow > SLOW_SHARE and self.run_count > size + 2:
            by_run = np.zeros((self.run_count, size))
            np.add.at(by_run, self._run_number, left)
            scatters.append(by_run.T @ by_run * self.run_count / (self.run_count - 1))
        statistic = min(float(total @ solve(s, total)) for s in scatters)
        free = (self.run_count if slow > RUNS_ONLY_SHARE else count) - size
        return max(statistic, 0.0), max(free, 1)

    def test_each(
        self, columns: Sequence[int], given: Sequence[int] = ()
    ) -> tuple[Array, Array, Array]:
        """``test`` of every column alone, at once: z, coefficient and information, each (k,)."""
        at = np.array(columns, int)
        active, beta, cluster_scores = self._scores(at, given)
        info = self.clusters.partial_diagonals(at, active, beta)
        total, information = cluster_scores.sum(axis=0), info.sum(axis=0)
        raw = self.total[at, at]
        dead = information < 2e-3 * raw
        safe = np.where(dead | (information <= 0), 1.0, information)
        found = np.where(dead, 0.0, total / safe)
        left = cluster_scores - info * found
        count = self.cluster_count
        variance = np.maximum(safe, (left**2).sum(axis=0) * count / max(count - 1, 1))
        slow = self.slow[at]
        if self.run_count > 3:
            by_run = np.zeros((self.run_count, len(at)))
            np.add.at(by_run, self._run_number, left)
            between = (by_run**2).sum(axis=0) * self.run_count / (self.run_count - 1)
            variance = np.where(slow > SLOW_SHARE, np.maximum(variance, between), variance)
        t = np.abs(total) / np.sqrt(variance)
        free = np.where(slow > RUNS_ONLY_SHARE, max(self.run_count - 1, 1), max(count - 1, 1))
        tail = np.maximum(2.0 * stats.t.sf(t, free), 1e-300)
        z = np.where(dead, 0.0, stats.norm.isf(tail / 2.0))
        return z, found, np.where(dead, 0.0, information)

    def compare(self, first: Sequence[int], second: Sequence[int]) -> tuple[float, float]:
        """Log-likelihood of the first set over the second's, and Vuong's z of the difference."""
        one, other = (
            -0.5 * self.clusters.times(v) @ v for v in (self._fit(first), self._fit(second))
        )
        scatter = float((one - other).std() * np.sqrt(self.cluster_count)) + 1e-12
        total = float((one - other).sum())
        return total, total / scatter

    def collinearity(self, first: int, second: int) -> float:
        """|cosine| between two columns once the tangent is taken out."""
        at = [first, second]
        inner = self.partial[np.ix_(at, at)]
        size = inner[0, 0] * inner[1, 1]
        return float(abs(inner[0, 1]) / np.sqrt(size)) if size > 0 else 0.0

    def aliased(self, first: int, second: int) -> bool:
        """Whether two columns are the same up to a factor once the tangent is taken out."""
        return self.collinearity(first, second) > ALIAS_COSINE


def solve(matrix: Array, right: Array, ridge: float = RIDGE) -> Array:
    """Solution of a symmetric system (k, k), scaled to a unit diagonal.

    Args:
        matrix: (k, k), positive semidefinite.
        right: (k,) or (k, m).
        ridge: added to the scaled diagonal; directions without information get about 0.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(scale, scale) + ridge * np.eye(len(matrix))
    shape = (len(scale),) + (1,) * (right.ndim - 1)
    scaled_right = right / scale.reshape(shape)
    try:
        found = np.linalg.solve(scaled, scaled_right)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(scaled, hermitian=True) @ scaled_right
    return np.asarray(found / scale.reshape(shape))
