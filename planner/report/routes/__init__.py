"""Views of results about routes: answers, fronts, matrices, areas in reach."""

from planner.report.routes.answer_page import answer_view
from planner.report.routes.area_pages import matrix_view, reach_view
from planner.report.routes.front_page import front_view
from planner.report.routes.planner_page import planner_view
from planner.report.routes.relief_map import whole_map

__all__ = ["answer_view", "front_view", "matrix_view", "planner_view", "reach_view", "whole_map"]
