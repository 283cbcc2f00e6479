"""The design matrix of a residual, and its sufficient statistics by cluster.

examine takes a log in memory, examine_all a long one in one pass. An Examination answers every
later question without the rows.
"""

from planner.telemetry.evidence.design_matrix import DesignColumns, Examination, examine
from planner.telemetry.evidence.evidence import Test, solve
from planner.telemetry.evidence.streaming import examine_all

__all__ = ["DesignColumns", "Examination", "Test", "examine", "examine_all", "solve"]
