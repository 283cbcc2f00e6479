"""What turning costs: on the spot, on the move, and for straight steps with an even turn.

prices = turning(around, OBJECTIVES["energy"])           # Turning
spin_costs(kernel, ..., spin); step_costs(kernel, ..., costs)
"""

from planner.search.turns.turn_in_place import spin_costs, spin_round
from planner.search.turns.turning_prices import Turning, turning
from planner.search.turns.turning_steps import step_costs
from planner.search.turns.turning_table import turn_cost, turn_cost_at, turn_place

__all__ = [
    "Turning",
    "spin_costs",
    "spin_round",
    "step_costs",
    "turn_cost",
    "turn_cost_at",
    "turn_place",
    "turning",
]
