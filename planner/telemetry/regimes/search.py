"""Significance of a residual's bias over thousands of sets of rows at once.

    search = Search(axes, residual, weight, run)
    search.excess[pair]           # (sets of a, sets of b): 1 is what chance hardly ever reaches

Rows next to each other err alike, and a run may be off as a whole, so a log's rows are not as many
independent observations. The contrast between a set and the rest of the log is taken twice: within
runs, by *clusters* of rows (runs, or blocks of several correlation times where runs are few), and
between the means of runs.

    within    T = Σ A / √(Σ A²)       A: sum over the set in a cluster of residual - mean of the run
              z² = -(k - 1)·ln(1 - T²/k)           k: clusters with rows in the set
    between   z² = -(R - 2)·ln(1 - ρ²)             ρ: means of the R runs, share of rows in the set
    both      weighted by what each knows about the contrast

No model of the noise enters. With few clusters z is what Student's t would say, whatever k. What a
search over so many sets reaches by chance is found by doing it again and again with the signs of
clusters flipped and the means of runs shuffled.

Source
    A. C. Cameron, J. B. Gelbach, D. L. Miller, Bootstrap-based improvements for inference with
    clustered errors, Review of Economics and Statistics 90 (2008); P. H. Westfall, S. S. Young,
    Resampling-based multiple testing, Wiley 1993, for the largest z; D. L. Wallace, Bounds on
    normal approximations to Student's and the chi-square distributions, Annals of Mathematical
    Statistics 30 (1959), for z of t.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Integers, Mask
from planner.telemetry.quantities_of_motion import FURTHER
from planner.telemetry.regimes.conditions import AxisBins
from planner.telemetry.regimes.kernels import FEW_CLUSTERS, LEAST_UNEXPLAINED, largest_z, product
from planner.telemetry.regimes.units import Units

Floats = NDArray[np.floating[Any]]

SHUFFLES = 200
"""Resamplings that the distribution of the largest z by chance comes from."""
CHANCE = 0.03
"""Share of logs without structure in which some set passes."""
LEAST_RUNS = 4
"""Runs from which on they can agree or not."""
AGREEMENT_Z = 2.5
"""z that a contrast within runs needs with whole runs as clusters, without regard to the search."""
_WITH_FURTHER = {"speed", "heading", "slope_along", "load"}
_CLIP = 6.0
"""Robust standard deviations that a residual counts at most: one outlier is not structure."""
_TWO_AXES = 2
"""Kinds of limits on one axis; those of sets on two axes follow."""


@dataclass(frozen=True, eq=False)
class _Parts:
    """A residual taken apart, weighted: within runs by row, and the means of runs."""

    within: Floats  # (n,)
    means: Floats  # (runs,), centred


@dataclass(frozen=True, eq=False)
class _Sets:
    """What z needs to know of some sets; each (...sets) but for the first."""

    squares: Floats  # Σ A²
    clusters: Floats  # k
    spread: Floats  # √Σ (share - mean share)² over runs
    inner: Floats  # what the contrast within runs knows, 1/W²
    outer: Floats  # and that between runs


class Search:
    """All sets on one or two axes over one residual.

    Args:
        axes: bins of the axes.
        residual: (n,) W.
        weight: (n,) how much a row's error says, about 1.
        units: from units_of.

    Attributes:
        pairs: indices of the axes, (a, b); b = -1 for one axis alone.
        excess: for each pair (sets of a, sets of b) or (sets of a,): z over the limit, signed.
        limits: |z| that chance reaches, of sets on one axis known mostly within runs or mostly
            between them, and the same on two axes: there are more of these, so more by chance.
    """

    def __init__(
        self, axes: Sequence[AxisBins], residual: Floats, weight: Floats, units: Units
    ) -> None:
        self.axes = axes
        self.units = units
        self.pairs = list(pairs_of(axes))
        self._weight = weight
        self._run_weight = np.bincount(units.run, weight, units.runs)
        parts = self._parts(residual)
        chance = np.random.default_rng(0)
        signs = chance.integers(0, 2, (SHUFFLES, units.clusters)) * 2.0 - 1.0
        shuffled = chance.permuted(np.tile(parts.means, (SHUFFLES, 1)), axis=1)
        # Single precision is enough to count how often chance passes, and twice as fast.
        signs, shuffled = signs.astype(np.float32), shuffled.astype(np.float32)
        largest = np.zeros((2 * _TWO_AXES, SHUFFLES), np.float32)
        scores = []
        for pair in self.pairs:
            sums, shares, sets = self._tables(pair, parts)
            kinds = _kinds(sets, 1 if pair[1] < 0 else 2)
            flipped, mixed = _mixed(signs, sums), _mixed(shuffled, shares)
            tables = [
                box_sums(axes, sums_by_chance, pair).reshape(SHUFFLES, -1)
                for sums_by_chance in (flipped, mixed)
            ]
            tables += [table.ravel() for table in vars(sets).values()]
            size = float(np.sqrt(parts.means @ parts.means))
            arguments: Any = (*tables, units.runs, size, kinds.ravel(), largest)
            largest_z(*arguments)
            mean = np.tensordot(parts.means.astype(np.float32), shares, axes=(0, 0))
            inner, outer = box_sums(axes, sums.sum(axis=0), pair), box_sums(axes, mean, pair)
            scores.append((self._z(inner, outer, sets, parts.means), kinds))
        self._largest = largest
        self.limits = np.array([_limit(kind) for kind in largest])
        self.excess = [z / self.limits[kinds] for z, kinds in scores]

    def excess_of(self, met: Mask, residual: Floats, axes: int) -> float:
        """z over the limit, signed.

        Args:
            met: (n,) rows of a set.
            residual: (n,) W over the same log.
            axes: how many the set is on.
        """
        z, kind = self._z_of(met, residual)
        return z / float(self.limits[kind + _TWO_AXES * (axes > 1)])

    def chance_of(self, met: Mask, residual: Floats, axes: int) -> float:
        """Probability that a search like this one finds as much in noise; as excess_of."""
        z, kind = self._z_of(met, residual)
        scale, middle = _gumbel(self._largest[kind + _TWO_AXES * (axes > 1)])
        kinds = len(self.limits)
        return float(min(1.0, -kinds * np.expm1(-np.exp(-(abs(z) - middle) / scale))))

    def stderr_of(self, met: Mask, residual: Floats) -> float:
        """Standard error in W of the residual's mean over a set of rows (n,), by clusters."""
        inside = residual[met]
        units = self.units
        centred = np.where(met, residual - inside.mean(), 0.0)
        sums = np.bincount(units.cluster, centred, units.clusters)
        few = int(np.count_nonzero(np.bincount(units.cluster, met, units.clusters)))
        return float(np.sqrt(sums @ sums * few / max(1, few - 1))) / len(inside)

    def _parts(self, residual: Floats) -> _Parts:
        units, weighed = self.units, clipped(residual) * self._weight
        means = np.bincount(units.run, weighed, units.runs) / self._run_weight
        return _Parts(weighed - self._weight * means[units.run], means - means.mean())

    def _tables(self, pair: tuple[int, int], parts: _Parts) -> tuple[Floats, Floats, _Sets]:
        """Sums by cluster and bin, centred shares of runs by bin, and what z needs of the sets."""
        units = self.units
        cell, shape = cells(self.axes, pair)
        size = int(np.prod(shape))
        place = units.cluster * size + cell
        sums = np.bincount(place, parts.within, units.clusters * size)
        rows = np.bincount(place, self._weight, units.clusters * size)
        by_cluster = sums.reshape(units.clusters, *shape).astype(np.float32)
        counts = rows.reshape(units.clusters, *shape).astype(np.float32)
        if units.clusters == units.runs:
            shares = counts.copy()
        else:
            shares = np.add.reduceat(counts, np.searchsorted(units.of, np.arange(units.runs)))
        shares /= self._run_weight.reshape(-1, *[1] * len(shape)).astype(np.float32)
        share = box_sums(self.axes, shares, pair)
        inside, known = (box_sums(self.axes, table, pair) for table in (by_cluster, counts))
        sets = self._sets(inside, known, share, parts.means, units.of)
        return by_cluster, shares - shares.mean(axis=0), sets

    def _sets(
        self, sums: Floats, counts: Floats, share: Floats, means: Floats, of: Integers
    ) -> _Sets:
        """Sums and rows of sets by cluster (clusters, ...), shares by run (runs, ...)."""
        against = counts * (1.0 - share[of])
        squares = np.einsum("u...,u...->...", sums, sums)
        total = against.sum(axis=0)
        centred = share - share.mean(axis=0)
        spread = np.einsum("u...,u...->...", centred, centred)
        variance = float(means @ means) / max(1, len(means) - 1)
        return _Sets(
            squares,
            np.maximum((against > 0.0).sum(axis=0), 1).astype(squares.dtype),
            np.sqrt(spread),
            _over(total * total, squares),
            spread / variance if variance > 0.0 and len(means) > 3 else 0.0 * spread,
        )

    def _z(self, within: Floats, between: Floats, sets: _Sets, means: Floats) -> Floats:
        """z of sums over sets (..., sets): residual within runs, means of runs against shares."""
        ratio = _over(within * within, sets.squares * sets.clusters)
        inner = np.sign(within) * np.where(
            sets.clusters < FEW_CLUSTERS,
            np.sqrt(ratio * sets.clusters),
            np.sqrt((sets.clusters - 1.0) * -np.log(np.maximum(1.0 - ratio, LEAST_UNEXPLAINED))),
        )
        rho = _over(between, sets.spread * float(np.sqrt(means @ means)))
        outer = np.sign(rho) * np.sqrt(
            max(0, len(means) - 2) * -np.log(np.maximum(1.0 - rho * rho, LEAST_UNEXPLAINED))
        )
        both = np.sqrt(sets.inner + sets.outer)
        return _over(inner * np.sqrt(sets.inner) + outer * np.sqrt(sets.outer), both)

    def _z_of(self, met: Mask, residual: Floats, units: Units | None = None) -> tuple[float, int]:
        units, parts = units or self.units, self._parts(residual)
        if met.all():
            return self._z_of_all(residual), 0
        inside = np.where(met, self._weight, 0.0)
        within = np.where(met, parts.within, 0.0)
        sums, counts = (
            np.bincount(units.cluster, values, units.clusters).astype(float)
            for values in (within, inside)
        )
        share = np.bincount(units.run, inside, units.runs) / self._run_weight
        sets = self._sets(sums, counts, share, parts.means, units.of)
        mean = np.asarray(parts.means @ (share - share.mean()))
        return float(self._z(sums.sum(), mean, sets, parts.means)), int(_kinds(sets, 1))

    def runs_agree(self, met: Mask, residual: Floats) -> bool:
        """Whether a contrast holds from run to run; True where there are too few runs to say.

        Args:
            met: (n,) rows of a set.
            residual: (n,) W.
        """
        units = self.units
        if units.clusters == units.runs or units.runs < LEAST_RUNS or met.all():
            return True
        by_run = Units(units.run, units.run, np.arange(units.runs), units.runs)
        z, _ = self._z_of(met, residual, by_run)
        return abs(z) > AGREEMENT_Z

    def _z_of_all(self, residual: Floats) -> float:
        """z of the mean over the whole log, which has no rest to be compared with."""
        units = self.units
        sums = np.bincount(units.cluster, clipped(residual) * self._weight, units.clusters)
        rows = np.bincount(units.cluster, self._weight, units.clusters)
        if 1 < units.runs < units.clusters:
            sums, rows = (np.bincount(units.of, values, units.runs) for values in (sums, rows))
        effective = float(rows.sum() ** 2 / (rows @ rows))
        left = 1.0 - float(sums.sum()) ** 2 / max(float(sums @ sums) * effective, 1e-300)
        size = (effective - 1.0) * -np.log(max(left, LEAST_UNEXPLAINED))
        return float(np.sign(sums.sum()) * np.sqrt(size))


def pairs_of(axes: Sequence[AxisBins]) -> Iterator[tuple[int, int]]:
    """Every axis alone, (a, -1), and every two axes that make sense together."""
    for a in range(len(axes)):
        yield a, -1
    for a, first in enumerate(axes):
        for b, second in enumerate(axes[a + 1 :], a + 1):
            further = {first.name, second.name} & FURTHER.keys()
            if not further or (len(further) == 1 and {first.name, second.name} & _WITH_FURTHER):
                yield a, b


def cells(axes: Sequence[AxisBins], pair: tuple[int, int]) -> tuple[Integers, tuple[int, ...]]:
    """Cell of every row in the grid of a pair's bins, (n,), and the shape of that grid."""
    a, b = pair
    if b < 0:
        return axes[a].code, (axes[a].count,)
    return axes[a].code * axes[b].count + axes[b].code, (axes[a].count, axes[b].count)


def box_sums(axes: Sequence[AxisBins], sums: Floats, pair: tuple[int, int]) -> Floats:
    """Sums over sets (..., sets) or (..., sets of a, sets of b) from sums over bins."""
    a, b = pair
    kind = sums.dtype
    if b < 0:
        return sums @ axes[a].member.T.astype(kind)
    first, second = (axes[k].member[axes[k].paired].astype(kind) for k in pair)
    return np.asarray(np.matmul(first, sums @ second.T))


def _mixed(factors: Floats, sums: Floats) -> Floats:
    """Sums over bins (units, ...) with factors (rounds, units): (rounds, ...)."""
    result = np.empty((len(factors), *sums.shape[1:]), np.float32)
    product(factors, sums.reshape(len(sums), -1), result.reshape(len(factors), -1))
    return result


def clipped(residual: Floats) -> Floats:
    """A residual with what lies beyond _CLIP robust standard deviations cut back."""
    middle = float(np.median(residual))
    spread = 1.4826 * float(np.median(np.abs(residual - middle)))
    if spread == 0.0:
        return residual
    return np.clip(residual, middle - _CLIP * spread, middle + _CLIP * spread)


def _kinds(sets: _Sets, axes: int) -> Integers:
    """Which limit holds for each set: known mostly within runs (0) or between them (1)."""
    return np.asarray(_TWO_AXES * (axes > 1) + (sets.outer > sets.inner).astype(np.int64))


def _gumbel(largest: Floats) -> tuple[float, float]:
    """Scale and mode of the distribution of a largest value, by its moments."""
    scale = max(float(np.std(largest)), 1e-6) * np.sqrt(6.0) / np.pi
    return float(scale), float(np.mean(largest)) - 0.5772156649 * float(scale)


def _limit(largest: Floats) -> float:
    """What is passed in CHANCE of the logs, shared between the four kinds of sets."""
    scale, middle = _gumbel(largest)
    return max(middle - scale * float(np.log(-np.log1p(-CHANCE / 4.0))), 1e-6)


def _over(top: Floats, bottom: Floats) -> Floats:
    """Quotient that is 0 where the bottom is."""
    return np.where(bottom > 0.0, top / np.where(bottom > 0.0, bottom, 1.0), 0.0)
