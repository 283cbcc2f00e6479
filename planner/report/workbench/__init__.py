"""Views of the workbench's results: comparisons, diagnoses, adoptions, models."""

from planner.report.workbench.pages import VIEWS, as_html
from planner.report.workbench.residuals import axis_of

__all__ = ["VIEWS", "as_html", "axis_of"]
