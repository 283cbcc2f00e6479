"""Routes for a time weight: the front of energy and duration, and routes by a deadline.

front, searches = filled_in(search, ends_of(search), most=7)
route, reason = in_time(run, 120.0)
"""

from planner.search.tradeoff.deadline import in_time
from planner.search.tradeoff.hull import chord_price, ends_of, filled_in
from planner.search.tradeoff.weighted_objective import DrivenRoute, PricedSearch

__all__ = ["DrivenRoute", "PricedSearch", "chord_price", "ends_of", "filled_in", "in_time"]
