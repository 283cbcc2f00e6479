"""The design matrix of a residual, and its sufficient statistics by cluster.

An Examination answers every later question without the rows.
"""

from planner.telemetry.evidence.design_matrix import DesignColumns, Examination, examine
from planner.telemetry.evidence.evidence import Test, solve

__all__ = ["DesignColumns", "Examination", "Test", "examine", "solve"]
