"""Cost of a metre of steady driving on a slope, tabulated over yaw, direction and steepness.

    costs = steady_costs(model, class_rows, "energy")        # SteadyCosts, arrays

The other names look these tables up from compiled code.
"""

from planner.search.steady.kept_tables import kept_table
from planner.search.steady.steady_cost import (
    SteadyCosts,
    cost_for_best_yaw,
    costs_for_yaws,
    crab_angle_for_yaw,
    polar,
)
from planner.search.steady.steady_cost_tables import steady_costs

__all__ = [
    "SteadyCosts",
    "cost_for_best_yaw",
    "costs_for_yaws",
    "crab_angle_for_yaw",
    "kept_table",
    "polar",
    "steady_costs",
]
