"""Compare measured power with a model's.

compare gives a Comparison with errors by run, by regime and along curves; Sums adds them up while a
log passes by.
"""

from planner.telemetry.comparison.compare_log import CLOUD, Comparison, compare
from planner.telemetry.comparison.sums import CurveBins, RunComparison, Sums, curve_bins

__all__ = ["CLOUD", "Comparison", "CurveBins", "RunComparison", "Sums", "compare", "curve_bins"]
