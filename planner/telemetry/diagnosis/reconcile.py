"""Which of two searches of one log is believed: one around the fit, one around the model as given.

    rather(first, second)       # the diagnosis to return

Where a strong effect is missing, the fit of the bare model runs into the bounds of what is
physical, and what is laid out around it may point nowhere. A second search, around the model as it
is given, then finds other names at times. It is believed when its error on runs that were not
fitted is clearly lower. Where neither is clearly better, the tamer one is: the one that needs no
formula from outside the catalogue, and of two such the one that leaves fewer parameters at the ends
of their physical ranges. A parameter at its end makes up for something that is not in the model,
and does so only inside the log.
"""

from __future__ import annotations

import numpy as np

from planner.telemetry.diagnosis.results import Diagnosis
from planner.telemetry.holdout import heldout_residual

BETTER, FAR_BETTER = 0.98, 0.5
"""Held-out error of the second search over the first, from which the second is believed; the same
where the first found nothing missing, and must have taken something large for noise."""
ALIKE_Z, ALIKE = 2.0, 1.05
"""Standard errors over runs, and ratio, within which held-out errors count as equal."""


def rather(first: Diagnosis, second: Diagnosis) -> Diagnosis:
    """The one to believe.

    Args:
        first: of the search around the fit.
        second: of the search around the model as given.
    """
    named = first.verdict != "complete"
    enough = BETTER if named else FAR_BETTER
    if second.after.heldout_rmse_w < enough * first.after.heldout_rmse_w:
        return second
    both = first.proposed and second.proposed and not (first.sensors or second.sensors)
    if both and _wildness(second) < _wildness(first) and _as_good(second, first):
        return second
    return first


def _wildness(diagnosis: Diagnosis) -> tuple[bool, int]:
    """Whether a formula is needed, and how many parameters stand at the ends of their ranges."""
    ends = sum(1 for p in diagnosis.fitted.parameters if p.at_the_end)
    return diagnosis.outside is not None, ends


def _as_good(one: Diagnosis, other: Diagnosis) -> bool:
    """Whether the held-out error of the one is not clearly above that of the other."""
    if one.after.heldout_rmse_w > ALIKE * other.after.heldout_rmse_w:
        return False
    log = one.corrected  # the same rows in both: neither blames a sensor
    mine, theirs = (heldout_residual(log, each.fitted) ** 2 for each in (one, other))
    _, run = np.unique(log.run, return_inverse=True)
    excess = np.bincount(run, mine - theirs)
    return bool(excess.sum() < ALIKE_Z * np.sqrt(np.sum(excess**2)) + 1e-12)
