"""What to measure next, and what a log cannot show.

advice = Advice(examination, selection, log)
advice.experiments(wide, undecided)        # drives that separate effects
Aliases(advice).parted(slug)               # or the column to log that does
slope_to_log(examination, log, residual)
Untestable(advice).listed(selected)
sampled(fitted_into(settings, area), step) # the commands of a recommended drive
"""

from planner.telemetry.diagnosis.advice.drives import fitted_into, sampled
from planner.telemetry.diagnosis.advice.experiments import UNKNOWN, WIDE, Advice
from planner.telemetry.diagnosis.advice.missing_columns import Aliases, slope_to_log
from planner.telemetry.diagnosis.advice.untestable import Untestable

__all__ = [
    "UNKNOWN",
    "WIDE",
    "Advice",
    "Aliases",
    "Untestable",
    "fitted_into",
    "sampled",
    "slope_to_log",
]
