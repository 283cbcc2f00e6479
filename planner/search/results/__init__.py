"""A route and its energy account by physical effect.

route = drive(field, conditions, legs, yaws)    # Route, or Infeasible
route = price(field, conditions, motion)
"""

from planner.search.results.energy_account import drive, energy_by_step, energy_of, price
from planner.search.results.route import Answer, Baseline, Route
from planner.search.results.search_summary import SearchSummary

__all__ = [
    "Answer",
    "Baseline",
    "Route",
    "SearchSummary",
    "drive",
    "energy_by_step",
    "energy_of",
    "price",
]
