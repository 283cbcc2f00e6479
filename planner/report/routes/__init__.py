"""Views of results about routes: answers, fronts, matrices, areas in reach."""

from planner.report.routes.answer_page import answer_view
from planner.report.routes.drive_map import drive_page, ground_layer
from planner.report.routes.pages import VIEWS
from planner.report.routes.relief_map import whole_map

__all__ = ["VIEWS", "answer_view", "drive_page", "ground_layer", "whole_map"]
