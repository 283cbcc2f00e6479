"""What a user may ask for, checked field by field: a route, a front, a matrix, a reachable area.

    request = PlanRequest.from_text('{"map": "warehouse", "start": {"x": 1, "y": 1}, ...}')

Python, the command line and HTTP share these classes.
"""

from planner.search.requests.places import PoseRequest, RegionRequest
from planner.search.requests.questions import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from planner.search.requests.scenario import RequestLike, SituationRequest

__all__ = [
    "FrontRequest",
    "MatrixRequest",
    "PlanRequest",
    "PoseRequest",
    "ReachRequest",
    "RegionRequest",
    "RequestLike",
    "SituationRequest",
]
