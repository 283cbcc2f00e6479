"""Cross-validation: errors on held-out runs.

heldout_residual holds out fold by fold, supports judges a claim, base_fit refuses a fit that
held-out runs refute, metered_base_fit fits the meter too. LinearHeldout does the same for many
candidates from Gram matrices.
"""

from planner.telemetry.holdout.heldout import (
    base_fit,
    heldout_residual,
    rms,
    supports,
)
from planner.telemetry.holdout.linear_heldout import LinearHeldout
from planner.telemetry.holdout.metered import meter_beside, metered_base_fit, overall_error

__all__ = [
    "LinearHeldout",
    "base_fit",
    "heldout_residual",
    "meter_beside",
    "metered_base_fit",
    "overall_error",
    "rms",
    "supports",
]
