"""One map, one robot and one model under given conditions, with the costs that follow.

    situation = situation_of(request)
    field = situation.field("energy")

It also refuses places without room, and says what blocks where there is no route.
"""

from planner.search.situation.infeasibility import (
    check_hold,
    check_place,
    explain_no_route,
    not_driven,
)
from planner.search.situation.situation import KINDS, Situation, situation_of
from planner.search.situation.traversability import DrivingGround

__all__ = [
    "KINDS",
    "DrivingGround",
    "Situation",
    "check_hold",
    "check_place",
    "explain_no_route",
    "not_driven",
    "situation_of",
]
