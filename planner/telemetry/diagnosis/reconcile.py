"""Choose between two searches of one log: around the fit, or around the model as given.

    more_credible(first, second)       # the diagnosis to return

Where a strong effect is missing, the fit of the base model ends at physical bounds. The columns
around such a fit may be misleading. A second search, around the model as given, then sometimes
names other effects. It wins when its held-out error is clearly lower. Among equally good
explanations the simpler one wins: no formula outside the catalogue, then fewer parameters at
bounds. A parameter at its bound makes up for a missing effect, and only within this log.
"""

from __future__ import annotations

import numpy as np

from planner.telemetry.diagnosis.results import Diagnosis
from planner.telemetry.holdout import heldout_residual

BELIEVED_RATIO, NAMING_RATIO, OVERRULING_RATIO = 0.98, 0.9, 0.5
"""Held-out error of the second search over that of the first, below which the second wins: where
the first named something; where it could not tell what is missing; and where it found nothing, and
must have taken a large effect for noise."""
EQUAL_Z, EQUAL_RATIO = 2.0, 1.05
"""Standard errors over runs, and ratio, within which held-out errors count as equal."""


def more_credible(first: Diagnosis, second: Diagnosis) -> Diagnosis:
    """The one to believe.

    Args:
        first: of the search around the fit.
        second: of the search around the model as given.
    """
    ratios = {"complete": OVERRULING_RATIO, "not_identifiable": NAMING_RATIO}
    enough = ratios.get(first.verdict, BELIEVED_RATIO)
    if second.after.heldout_rmse_w < enough * first.after.heldout_rmse_w:
        return second
    both = first.proposed and second.proposed and not (first.sensors or second.sensors)
    if both and _complexity(second) < _complexity(first) and _as_good(second, first):
        return second
    return first


def _complexity(diagnosis: Diagnosis) -> tuple[bool, int]:
    """Whether a formula is needed, and how many parameters stand at the ends of their ranges."""
    ends = sum(1 for p in diagnosis.fitted.parameters if p.at_the_end)
    return diagnosis.outside is not None, ends


def _as_good(one: Diagnosis, other: Diagnosis) -> bool:
    """Whether the held-out error of the one is not clearly above that of the other."""
    if one.after.heldout_rmse_w > EQUAL_RATIO * other.after.heldout_rmse_w:
        return False
    log = one.corrected  # the same rows in both: neither names a sensor fault
    mine, theirs = (heldout_residual(log, each.fitted) ** 2 for each in (one, other))
    _, run = np.unique(log.run, return_inverse=True)
    excess = np.bincount(run, mine - theirs)
    return bool(excess.sum() < EQUAL_Z * np.sqrt(np.sum(excess**2)) + 1e-12)
