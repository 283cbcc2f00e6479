"""Views of the workbench's results: comparisons, diagnoses, adoptions, models."""

from planner.report.workbench.pages import VIEWS, as_html

__all__ = ["VIEWS", "as_html"]
