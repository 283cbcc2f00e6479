"""Views of the workbench's results: comparisons, diagnoses, adoptions, models."""

from planner.report.workbench.pages import VIEWS

__all__ = ["VIEWS"]
