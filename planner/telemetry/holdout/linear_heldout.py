"""Held-out errors of many candidates, from the Gram matrices of one examination.

LinearHeldout(log, examination).rmse(columns)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.arrays import Array
from planner.telemetry.evidence import Examination, solve
from planner.telemetry.holdout.heldout import fold_numbers, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.parameters import Prior
from planner.telemetry.sampling import cluster_numbers

HELD_OUT_RIDGE = 1e-6
"""Ridge of a scaled Gram matrix: collinear columns share what they explain."""
LEAST_LEFT = 1e-9
"""Share of a column's square outside a fold below which it is rounding: Gram matrices of the other
rows are differences."""


class LinearHeldout:
    """Held-out errors of many sets of columns, linear around one examination.

    Args:
        log: the rows that were examined.
        examination: of the same rows.
        exact: take data sheet and sensors for exact; otherwise their usual errors may explain what
            they can.
    """

    def __init__(self, log: Telemetry, examination: Examination, *, exact: bool = False) -> None:
        evidence = examination.evidence
        self.examination = examination
        competitors = examination.competitors
        self.tangent = list(range(competitors.first_given if exact else competitors.tangent))
        self.folds = fold_numbers(log)
        blocks = cluster_numbers(log)
        library = competitors.library
        self.prior = Prior.of(library.held_model, library.places).precision
        self.grams = {
            int(fold): evidence.total
            - evidence.clusters.part(np.unique(blocks[self.folds == fold]))
            for fold in np.unique(self.folds)
        }

    def rmse(self, columns: Sequence[int]) -> float:
        """W, of the model with some columns."""
        return rms(self.residual_with(columns))

    def residual_with(self, columns: Sequence[int]) -> Array:
        """(n,) W, held-out, of the model with some columns."""
        evidence, examination = self.examination.evidence, self.examination
        at = np.array([*self.tangent, *columns])
        prior = np.zeros((len(at), len(at)))
        own = range(len(self.prior))
        prior[np.ix_(own, own)] = self.prior
        left = np.empty(len(self.folds))
        for fold, gram in self.grams.items():
            # What moves in this fold alone, the other rows do not show.
            seen = np.diag(gram)[at] > LEAST_LEFT * np.diag(evidence.total)[at]
            seen |= np.diag(prior) > 0.0
            of = at[seen]
            found = np.zeros(len(at))
            found[seen] = solve(
                gram[np.ix_(of, of)] + prior[np.ix_(seen, seen)],
                gram[of, evidence.residual],
                HELD_OUT_RIDGE,
            )
            held = self.folds == fold
            left[held] = examination.residual[held] - examination.raw[held][:, at] @ found
        return left
