"""Costs of turning: on the spot, on the move, and on straight steps with an even turn.

prices = turning(conditions, OBJECTIVES["energy"])           # Turning
spin_costs(kernel, arrays, ..., spin); step_costs(kernel, arrays, ..., costs)
"""

from planner.search.turns.turn_in_place import spin_costs, spin_round
from planner.search.turns.turning_prices import turning
from planner.search.turns.turning_steps import step_costs
from planner.search.turns.turning_table import TURNING, Turning, turn_cost, turn_place

__all__ = [
    "TURNING",
    "Turning",
    "spin_costs",
    "spin_round",
    "step_costs",
    "turn_cost",
    "turn_place",
    "turning",
]
