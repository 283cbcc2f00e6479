"""Error on runs that a fit has not seen.

heldout_residual leaves out fold by fold, falls compares two answers, base_fit refuses a fit that
held-out runs refute. LinearHeldout does it for many candidates from sums.
"""

from planner.telemetry.holdout.heldout import base_fit, falls, heldout_residual, heldout_rmse, rms
from planner.telemetry.holdout.linear_heldout import LinearHeldout

__all__ = [
    "LinearHeldout",
    "base_fit",
    "falls",
    "heldout_residual",
    "heldout_rmse",
    "rms",
]
