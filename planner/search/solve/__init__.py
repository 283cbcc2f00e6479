"""The search for one route: grid, smoothing, yaw, speed, and what to do where that fails.

found = best_route(run, run.field("energy"))
attempt = on_grid(run, field, "energy")
"""

from planner.search.solve.alternatives import find_alternatives
from planner.search.solve.certification import certified
from planner.search.solve.grid_planner import grid_route, on_grid
from planner.search.solve.portfolio import best_route, shortest_and_fastest, value_of
from planner.search.solve.run import Run

__all__ = [
    "Run",
    "best_route",
    "certified",
    "find_alternatives",
    "grid_route",
    "on_grid",
    "shortest_and_fastest",
    "value_of",
]
