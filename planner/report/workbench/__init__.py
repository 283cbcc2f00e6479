"""Views of the workbench's results: comparisons, diagnoses, adoptions, models."""

from planner.report.workbench.pages import workbench_view

__all__ = ["workbench_view"]
