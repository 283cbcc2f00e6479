"""Sums over a log from which every later question is answered: Gram matrices block by block.

    evidence = Evidence(groups)                       # names of the columns by group
    evidence.add(sums_of(white, scaled, blocks, runs))   # whitened columns, the residual last
    evidence.settle()
    evidence.gain(columns)                            # log-likelihood gained by some columns
    evidence.test(columns, given=others)              # is their coefficient zero?
    evidence.compare(first, second)                   # which of two sets explains more, and surely?

The model's tangent is always in: what refitting its parameters could absorb counts for nothing.
All tests use the scatter of the score over blocks, and over runs for columns that hardly change
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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

RIDGE = 1e-9
SLOW_SHARE = 0.2
"""A column of which more than this lies between runs is also judged by the scatter over runs."""
MOST_SLOW = 0.4
"""Above this the runs alone count as degrees of freedom."""


@dataclass(frozen=True)
class Test:
    """Is a set of coefficients zero?

    Attributes:
        z: normal deviate of the same tail probability.
        p_value: two-sided.
        coefficients: (k,) estimates.
        information: (k, k) what the log tells of them once all else is fitted.
    """

    z: float
    p_value: float
    coefficients: Floats
    information: Floats


class Sums(NamedTuple):
    """Sums over some rows.

    Attributes:
        grams: (columns, columns) of each block, whitened.
        runs: number of each block's run.
        plain: (columns, columns) of all rows, scaled but not whitened.
        rows: how many.
    """

    grams: list[Floats]
    runs: list[int]
    plain: Floats
    rows: int


def sums_of(white: Floats, scaled: Floats, blocks: Integers, runs: Integers) -> Sums:
    """Sums over rows.

    Args:
        white: (n, columns) whitened.
        scaled: (n, columns) over the spread of each row only.
        blocks: (n,) number of the block, not decreasing.
        runs: (n,) number of the run.
    """
    borders = [0, *(np.flatnonzero(np.diff(blocks)) + 1).tolist(), len(blocks)]
    grams = []
    for start, stop in zip(borders[:-1], borders[1:], strict=True):
        part = white[start:stop]
        grams.append(part.T @ part)
    return Sums(grams, [int(runs[start]) for start in borders[:-1]], scaled.T @ scaled, len(white))


class Evidence:
    """Gram matrices of whitened columns: tangent, everything that competes, residual last.

    Args:
        tangent: number of the model's own columns, which come first.
        columns: number of all columns, with the residual.
    """

    def __init__(self, tangent: int, columns: int) -> None:
        self.tangent = np.arange(tangent)
        self.residual = columns - 1
        self.columns = columns
        self.rows = 0
        self.slow = np.zeros(columns)
        self.plain = np.zeros((columns, columns))
        self._blocks: list[Floats] = []
        self._runs: list[int] = []

    def add(self, sums: Sums) -> None:
        """Take in the sums of rows, in the order of the log."""
        self._blocks += sums.grams
        self._runs += sums.runs
        self.plain += sums.plain
        self.rows += sums.rows

    def settle(self) -> None:
        """Close the sums; called once after the last ``add``."""
        self.grams = np.stack(self._blocks)
        self._blocks = []
        self.run_of_block = np.array(self._runs)
        self.total = self.grams.sum(axis=0)
        own = self.tangent
        self.absorbed = _solve(self.total[np.ix_(own, own)], self.total[own])
        self.clear = self.total - self.total[:, own] @ self.absorbed
        runs, self._run_number = np.unique(self.run_of_block, return_inverse=True)
        self.run_count = len(runs)

    @property
    def block_count(self) -> int:
        """Number of blocks."""
        return len(self.grams)

    def size(
        self, columns: Sequence[int], coefficients: Floats, given: Sequence[int] = ()
    ) -> float:
        """ρ: rms of what some columns add once everything else is refitted, over the noise.

        Taken over the rows as they are: whitening would make a slow effect look small.
        """
        at = list(columns)
        rest = [*self.tangent.tolist(), *given]
        clear = self.plain[np.ix_(at, at)] - self.plain[np.ix_(at, rest)] @ _solve(
            self.plain[np.ix_(rest, rest)], self.plain[np.ix_(rest, at)]
        )
        return float(np.sqrt(max(float(coefficients @ clear @ coefficients), 0.0) / self.rows))

    def kept_share(self, column: int) -> float:
        """Share of a column's variance that refitting the model cannot absorb."""
        raw = self.total[column, column]
        return float(self.clear[column, column] / raw) if raw > 0 else 0.0

    def coefficients(self, columns: Sequence[int]) -> Floats:
        """(k,) best coefficients of some columns, with the tangent."""
        at = list(columns)
        return _solve(self.clear[np.ix_(at, at)], self.clear[at, self.residual])

    def gain(self, columns: Sequence[int]) -> tuple[float, Floats]:
        """Log-likelihood gained by some columns over the tangent alone, and their coefficients."""
        if not len(columns):
            return 0.0, np.zeros(0)
        found = self.coefficients(columns)
        return float(0.5 * found @ self.clear[list(columns), self.residual]), found

    def _fit(self, columns: Sequence[int]) -> Floats:
        """(columns,) vector v with residual = Z v after fitting tangent and some columns."""
        at = [*self.tangent.tolist(), *columns]
        found = _solve(self.total[np.ix_(at, at)], self.total[at, self.residual])
        v = np.zeros(self.columns)
        v[at] = -found
        v[self.residual] = 1.0
        return v

    def test(self, columns: Sequence[int], given: Sequence[int] = ()) -> Test:
        """Are the coefficients of some columns zero, once ``given`` ones are fitted?"""
        at = list(columns)
        active = [*self.tangent.tolist(), *given]
        lean = _solve(self.total[np.ix_(active, active)], self.total[np.ix_(active, at)])
        v = self._fit(given)
        scores = self.grams @ v  # (blocks, columns)
        block_scores = scores[:, at] - scores[:, active] @ lean
        k, a = np.array(at), np.array(active)
        inner = self.grams[:, k[:, None], k]
        cross = self.grams[:, a[:, None], k]
        own = self.grams[:, a[:, None], a]
        mixed = np.einsum("ak,bal->bkl", lean, cross)
        block_info = (
            inner - mixed - mixed.transpose(0, 2, 1) + np.einsum("ak,bac,cl->bkl", lean, own, lean)
        )
        total, information = block_scores.sum(axis=0), block_info.sum(axis=0)
        found = _solve(information, total)
        left = block_scores - np.einsum("bkl,l->bk", block_info, found)
        slow = float(np.max(self.slow[at])) if at else 0.0
        z, p_value = self._judge(total, information, left, slow)
        return Test(z, p_value, found, information)

    def _judge(
        self, total: Floats, information: Floats, left: Floats, slow: float
    ) -> tuple[float, float]:
        count, size = self.block_count, len(total)
        scatters = [information]
        if count > size + 2:
            scatters.append(left.T @ left * count / (count - 1))
        if slow > SLOW_SHARE and self.run_count > size + 2:
            by_run = np.zeros((self.run_count, size))
            np.add.at(by_run, self._run_number, left)
            scatters.append(by_run.T @ by_run * self.run_count / (self.run_count - 1))
        statistic = min(float(total @ _solve(s, total)) for s in scatters)
        free = (self.run_count if slow > MOST_SLOW else count) - size
        p_value = float(stats.f.sf(max(statistic, 0.0) / size, size, max(free, 1)))
        return float(stats.norm.isf(max(p_value, 1e-300) / 2.0)), p_value

    def test_each(
        self, columns: Sequence[int], given: Sequence[int] = ()
    ) -> tuple[Floats, Floats, Floats]:
        """``test`` of every column alone, at once: z, coefficient and information, each (k,)."""
        at = np.array(columns, int)
        active = np.array([*self.tangent.tolist(), *given], int)
        lean = _solve(self.total[np.ix_(active, active)], self.total[np.ix_(active, at)])
        v = self._fit(given)
        scores = self.grams @ v
        block_scores = scores[:, at] - scores[:, active] @ lean
        inner = self.grams[:, at, at]
        cross = self.grams[:, active[:, None], at]
        own = self.grams[:, active[:, None], active]
        info = inner - 2.0 * np.einsum("ak,bak->bk", lean, cross)
        info += np.einsum("ak,bak->bk", lean, own @ lean)
        total, information = block_scores.sum(axis=0), info.sum(axis=0)
        raw = self.total[at, at]
        dead = information < 2e-3 * raw
        safe = np.where(dead | (information <= 0), 1.0, information)
        found = np.where(dead, 0.0, total / safe)
        left = block_scores - info * found
        count = self.block_count
        variance = np.maximum(safe, (left**2).sum(axis=0) * count / max(count - 1, 1))
        slow = self.slow[at]
        if self.run_count > 3:
            by_run = np.zeros((self.run_count, len(at)))
            np.add.at(by_run, self._run_number, left)
            between = (by_run**2).sum(axis=0) * self.run_count / (self.run_count - 1)
            variance = np.where(slow > SLOW_SHARE, np.maximum(variance, between), variance)
        t = np.abs(total) / np.sqrt(variance)
        free = np.where(slow > MOST_SLOW, max(self.run_count - 1, 1), max(count - 1, 1))
        tail = np.maximum(2.0 * stats.t.sf(t, free), 1e-300)
        z = np.where(dead, 0.0, stats.norm.isf(tail / 2.0))
        return z, found, np.where(dead, 0.0, information)

    def compare(self, first: Sequence[int], second: Sequence[int]) -> tuple[float, float]:
        """Log-likelihood of the first set over the second's, and Vuong's z of the difference."""
        difference = self._by_block(first) - self._by_block(second)
        scatter = float(difference.std() * np.sqrt(self.block_count)) + 1e-12
        total = float(difference.sum())
        return total, total / scatter

    def _by_block(self, columns: Sequence[int]) -> Floats:
        v = self._fit(columns)
        return np.asarray(-0.5 * np.einsum("bi,i->b", self.grams @ v, v))

    def likeness(self, first: int, second: int, given: Sequence[int] = ()) -> float:
        """|cosine| between two columns once tangent and ``given`` are taken out."""
        at = [first, second]
        rest = list(given)
        inner = self.clear[np.ix_(at, at)].copy()
        if rest:
            inner -= self.clear[np.ix_(at, rest)] @ _solve(
                self.clear[np.ix_(rest, rest)], self.clear[np.ix_(rest, at)]
            )
        size = inner[0, 0] * inner[1, 1]
        return float(abs(inner[0, 1]) / np.sqrt(size)) if size > 0 else 0.0


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solution of a symmetric system; directions that nothing is known about count as 0."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(scale, scale) + RIDGE * np.eye(len(matrix))
    shape = (len(scale),) + (1,) * (right.ndim - 1)
    scaled_right = right / scale.reshape(shape)
    try:
        found = np.linalg.solve(scaled, scaled_right)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(scaled, hermitian=True) @ scaled_right
    return np.asarray(found / scale.reshape(shape))
