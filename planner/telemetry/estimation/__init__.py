"""Parameters of a model fitted to a log.

fit gives a Fit with standard errors and remarks; energy_error says how well the fitted model
predicts energies. A fit that held-out runs refute carries a RefusedFit. with_meter finds the meter
that a log was read from, followed_motions the motion that its power follows.
"""

from planner.telemetry.estimation.energy_errors import energy_error
from planner.telemetry.estimation.gauss_newton import bounded_step
from planner.telemetry.estimation.meter_fit import with_meter
from planner.telemetry.estimation.model_fit import Fit, FittedParameter, RefusedFit, fit
from planner.telemetry.estimation.moment_of_motion import followed_motions

__all__ = [
    "Fit",
    "FittedParameter",
    "RefusedFit",
    "bounded_step",
    "energy_error",
    "fit",
    "followed_motions",
    "with_meter",
]
