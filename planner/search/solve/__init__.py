"""The search for one route: grid, smoothing, yaw, speed, and what to do where that fails.

found = best_route(run)
attempt = on_grid(run, run.field("energy"), "energy")
"""

from planner.search.solve.alternatives import find_alternatives
from planner.search.solve.certification import with_bounds
from planner.search.solve.grid_planner import on_grid
from planner.search.solve.portfolio import Found, best_along, best_route, summary_of
from planner.search.solve.sketch import ONE_OF_MANY

__all__ = [
    "ONE_OF_MANY",
    "Found",
    "best_along",
    "best_route",
    "find_alternatives",
    "on_grid",
    "summary_of",
    "with_bounds",
]
