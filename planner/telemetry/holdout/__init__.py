"""Cross-validation: errors on held-out runs.

heldout_residual holds out fold by fold, falls compares two answers, base_fit refuses a fit that
held-out runs refute, metered_base_fit fits the meter too. LinearHeldout does the same for many
candidates from Gram matrices.
"""

from planner.telemetry.holdout.heldout import base_fit, falls, heldout_residual, heldout_rmse, rms
from planner.telemetry.holdout.linear_heldout import LinearHeldout
from planner.telemetry.holdout.metered import meter_beside, metered_base_fit

__all__ = [
    "LinearHeldout",
    "base_fit",
    "falls",
    "heldout_residual",
    "heldout_rmse",
    "meter_beside",
    "metered_base_fit",
    "rms",
]
