"""Held-out errors of many candidates, from the Gram matrices of one examination.

    LinearHeldout(log, examination).rmse(columns)

The model's own columns are fitted once for each fold, to the residual and to all other columns.
What another column explains beyond them is then a system of its own size (a Schur complement).

Where rows weigh evenly in the fits (Noise.even_w), they do so here, too, if that predicts better:
errors of whitened rows alone would be larger than those of the fits, and a floor as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Array, Integers
from planner.telemetry.evidence import Examination, solve
from planner.telemetry.holdout.heldout import fold_numbers, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped
from planner.telemetry.parameters import Prior
from planner.telemetry.sampling import cluster_numbers

HELD_OUT_RIDGE = 1e-6
"""Ridge of a scaled Gram matrix: collinear columns share what they explain."""
LEAST_LEFT = 1e-9
"""Share of a column's square outside a fold below which it is rounding: Gram matrices of the other
rows are differences."""


class _Sums(NamedTuple):
    """Products of weighted columns (columns, columns): of all rows, and fold → of its rows."""

    total: Array
    parts: dict[int, Array]


class _Outside(NamedTuple):
    """The first columns fitted to the rows outside a fold.

    Attributes:
        gram: (columns, columns) products of these rows.
        found: (first columns, columns) coefficients that fit each column and the residual.
    """

    gram: Array
    found: Array


class LinearHeldout:
    """Held-out errors of many sets of columns, linear around one examination.

    Args:
        log: the rows that were examined.
        examination: of the same rows.
        exact: take data sheet and sensors for exact; otherwise their usual errors explain what
            they can where that predicts better.
    """

    def __init__(self, log: Telemetry, examination: Examination, *, exact: bool = False) -> None:
        evidence = examination.evidence
        self.log, self.examination = log, examination
        competitors = examination.competitors
        counts = (
            (competitors.first_given,) if exact else (competitors.first_given, competitors.tangent)
        )
        self.counts = counts
        self.folds = fold_numbers(log)
        library = competitors.library
        self.prior = Prior.of(library.held_model, library.places).precision
        each, blocks = np.unique(self.folds), cluster_numbers(log)
        parts = [evidence.clusters.part(np.unique(blocks[self.folds == fold])) for fold in each]
        self.sums = [_Sums(evidence.total, dict(zip(each.tolist(), parts, strict=True)))]
        if examination.noise.even_w:
            white = self._weighted(examination.raw[:, :-1], evenly=True)
            parts = [white[self.folds == fold].T @ white[self.folds == fold] for fold in each]
            total = np.sum(parts, axis=0) + np.diag(self._known(evenly=True))
            self.sums.append(_Sums(total, dict(zip(each.tolist(), parts, strict=True))))
        self.rows = {fold: np.flatnonzero(self.folds == fold) for fold in each.tolist()}
        own = examination.raw[:, : max(counts)]
        self.own = {fold: own[rows] for fold, rows in self.rows.items()}
        self.outside: dict[tuple[int, int, int], _Outside] = {}

    def rmse(self, columns: Sequence[int]) -> float:
        """W, of the model with some columns."""
        return rms(self.residual_with(columns))

    def residual_with(self, columns: Sequence[int]) -> Array:
        """(n,) W, held-out, of the model with some columns."""
        at = np.array(columns, np.int64)
        choices = itertools.product(self.counts, range(len(self.sums)))
        return min((self._with(count, at, number) for count, number in choices), key=rms)

    def _with(self, count: int, columns: Integers, number: int) -> Array:
        """(n,) W, held-out, of the first columns and others, by the sums of a number."""
        raw, whole = self.examination.raw, self.sums[number].total.diagonal()
        residual = self.examination.evidence.residual
        left = np.empty(len(self.folds))
        for fold, rows in self.rows.items():
            gram, found = self._outside(count, number, fold)
            seen = columns[gram.diagonal()[columns] > LEAST_LEFT * whole[columns]]
            asked = np.append(seen, residual)
            beyond = gram[np.ix_(seen, asked)] - gram[seen, :count] @ found[:, asked]
            ridge = HELD_OUT_RIDGE * np.diag(gram.diagonal()[seen])
            share = solve(beyond[:, :-1] + ridge, beyond[:, -1], 0.0)
            own = found[:, residual] - found[:, seen] @ share
            explained = self.own[fold][:, :count] @ own + raw[np.ix_(rows, seen)] @ share
            left[rows] = self.examination.residual[rows] - explained
        return left

    def _outside(self, count: int, number: int, fold: int) -> _Outside:
        """The first columns fitted to the rows outside a fold, by the sums of a number."""
        key = count, number, fold
        if key not in self.outside:
            given = self.sums[number]
            gram = given.total - given.parts[fold]
            prior = self._prior(count)
            # What moves in this fold alone, the other rows do not show.
            shown = gram.diagonal()[:count] > LEAST_LEFT * given.total.diagonal()[:count]
            at = np.flatnonzero(shown | (prior.diagonal() > 0.0))
            found = np.zeros((count, len(gram)))
            own = np.ix_(at, at)
            found[at] = solve(gram[own] + prior[own], gram[at], HELD_OUT_RIDGE)
            self.outside[key] = _Outside(gram, found)
        return self.outside[key]

    def _prior(self, count: int) -> Array:
        """(count, count) precision of the first columns before the log."""
        prior = np.zeros((count, count))
        own = range(len(self.prior))
        prior[np.ix_(own, own)] = self.prior
        return prior

    def residual_beside(self, more: Array, given: Sequence[int] = ()) -> Array:
        """(n,) W, held-out, of the model with columns that were not examined.

        Args:
            more: (n, k) W per unit.
            given: columns of the examination that stand beside them.
        """
        choices = itertools.product(self.counts, (False, True)[: len(self.sums)])
        each = (self._beside([*range(own), *given], more, evenly) for own, evenly in choices)
        return min(each, key=rms)

    def _beside(self, columns: Sequence[int], more: Array, evenly: bool) -> Array:
        examination = self.examination
        raw = np.column_stack([examination.raw[:, columns], more])
        white = self._weighted(raw, evenly)
        known = np.zeros(raw.shape[1])
        known[: len(columns)] = self._known(evenly)[columns]
        whole, prior = (white[:, :-1] ** 2).sum(axis=0) + known, self._prior(len(known))
        left = np.empty(len(self.folds))
        for fold, held in self.rows.items():
            own = white[self.folds != fold]
            gram = own[:, :-1].T @ own[:, :-1] + np.diag(known)
            at = np.flatnonzero((gram.diagonal() > LEAST_LEFT * whole) | (prior.diagonal() > 0.0))
            square = (gram + prior)[np.ix_(at, at)]
            found = solve(square, own[:, at].T @ own[:, -1], HELD_OUT_RIDGE)
            left[held] = examination.residual[held] - raw[np.ix_(held, at)] @ found
        return left

    def _known(self, evenly: bool) -> Array:
        """(columns,) what is known of each coefficient before the log."""
        examination = self.examination
        return (examination.noise.redundancy if evenly else 1.0) * examination.competitors.known

    def _weighted(self, columns: Array, evenly: bool) -> Array:
        """(n, k + 1) columns (n, k) W and the clipped residual, whitened or weighted evenly."""
        examination = self.examination
        if not evenly:
            rows = np.column_stack([columns, examination.raw[:, -1]])
            return examination.noise.whiten(self.log, examination.watts, examination.spread, rows)
        even_w = examination.noise.even_w
        residual = clipped(examination.residual, np.full(len(columns), even_w))
        return np.column_stack([columns, residual]) / even_w
