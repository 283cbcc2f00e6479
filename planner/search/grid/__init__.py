"""The cheapest path on the grid of a cost field.

lattice = build_lattice(field)
to_go = cost_to_go(field, lattice, goal)                 # CostToGo, from everywhere
path = grid_path(field, lattice, to_go, start)
"""

from planner.search.grid.close_moves import can_be_driven
from planner.search.grid.lattice import Lattice, build_lattice, number_nodes
from planner.search.grid.least_cost import CostToGo, cost_from, cost_to_go, grid_path

__all__ = [
    "CostToGo",
    "Lattice",
    "build_lattice",
    "can_be_driven",
    "cost_from",
    "cost_to_go",
    "grid_path",
    "number_nodes",
]
