"""Views of results about routes: answers, fronts, matrices, areas in reach."""

from planner.report.routes.pages import VIEWS

__all__ = ["VIEWS"]
