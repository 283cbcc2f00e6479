"""A route and its energy account by physical effect.

route = drive(field, around, legs, yaws, objective=0)    # Route, or Stuck
route = price(field, around, motion)
"""

from planner.search.results.energy_account import drive, energy_by_step, energy_of, price
from planner.search.results.route import Answer, Baseline, Route

__all__ = [
    "Answer",
    "Baseline",
    "Route",
    "drive",
    "energy_by_step",
    "energy_of",
    "price",
]
