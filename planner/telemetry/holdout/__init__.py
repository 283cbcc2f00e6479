"""Cross-validation: errors on held-out runs.

heldout_residual holds out fold by fold, falls compares two answers, base_fit refuses a fit that
held-out runs refute. LinearHeldout does the same for many candidates from Gram matrices.
"""

from planner.telemetry.holdout.heldout import base_fit, falls, heldout_residual, heldout_rmse, rms
from planner.telemetry.holdout.linear_heldout import LinearHeldout

__all__ = ["LinearHeldout", "base_fit", "falls", "heldout_residual", "heldout_rmse", "rms"]
