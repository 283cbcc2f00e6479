"""Held-out errors of many candidates, from the Gram matrices of one examination.

    LinearHeldout(log, examination).rmse(columns)

Where rows weigh evenly in the fits (Noise.even_w), they do so here, too, if that predicts better:
errors of whitened rows alone would be larger than those of the fits, and a floor as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
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
        self.tangents = [list(range(count)) for count in counts]
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

    def rmse(self, columns: Sequence[int]) -> float:
        """W, of the model with some columns."""
        return rms(self.residual_with(columns))

    def residual_with(self, columns: Sequence[int]) -> Array:
        """(n,) W, held-out, of the model with some columns."""
        choices = itertools.product(self.tangents, self.sums)
        return min((self._with([*own, *columns], sums) for own, sums in choices), key=rms)

    def _with(self, columns: Sequence[int], given: _Sums) -> Array:
        at, residual = np.array(columns), self.examination.evidence.residual

        def sums(fold: int) -> tuple[Array, Array]:
            gram = given.total - given.parts[fold]
            return gram[np.ix_(at, at)], gram[at, residual]

        return self._held_out(self.examination.raw[:, at], np.diag(given.total)[at], sums)

    def residual_beside(self, more: Array, given: Sequence[int] = ()) -> Array:
        """(n,) W, held-out, of the model with columns that were not examined.

        Args:
            more: (n, k) W per unit.
            given: columns of the examination that stand beside them.
        """
        choices = itertools.product(self.tangents, (False, True)[: len(self.sums)])
        each = (self._beside([*own, *given], more, evenly) for own, evenly in choices)
        return min(each, key=rms)

    def _beside(self, columns: Sequence[int], more: Array, evenly: bool) -> Array:
        examination = self.examination
        raw = np.column_stack([examination.raw[:, columns], more])
        white = self._weighted(raw, evenly)
        known = np.zeros(raw.shape[1])
        known[: len(columns)] = self._known(evenly)[columns]

        def sums(fold: int) -> tuple[Array, Array]:
            own = white[self.folds != fold]
            return own[:, :-1].T @ own[:, :-1] + np.diag(known), own[:, :-1].T @ own[:, -1]

        return self._held_out(raw, (white[:, :-1] ** 2).sum(axis=0) + known, sums)

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

    def _held_out(
        self, raw: Array, whole: Array, sums: Callable[[int], tuple[Array, Array]]
    ) -> Array:
        """(n,) W, held-out, of columns (n, k) with squares (k,); ``sums`` are those of a fold."""
        prior = np.zeros((len(whole), len(whole)))
        own = range(len(self.prior))
        prior[np.ix_(own, own)] = self.prior
        left = np.empty(len(self.folds))
        for fold in self.sums[0].parts:
            gram, right = sums(fold)
            # What moves in this fold alone, the other rows do not show.
            seen = np.diag(gram) > LEAST_LEFT * whole
            seen |= np.diag(prior) > 0.0
            found = np.zeros(len(whole))
            found[seen] = solve(
                gram[np.ix_(seen, seen)] + prior[np.ix_(seen, seen)], right[seen], HELD_OUT_RIDGE
            )
            held = self.folds == fold
            left[held] = self.examination.residual[held] - raw[held] @ found
        return left
