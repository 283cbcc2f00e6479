"""Makes route.svg and the gallery's route pictures beside this file; started by hand.

python -m docs.images.make_route_pictures [NAME…]    # all, or some of PICTURES
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from planner import energy_time_front, plan_route, reachable_area

HERE = Path(__file__).resolve().parent
WAREHOUSE: dict[str, Any] = {
    "map": "warehouse",
    "start": {"x": 1.5, "y": 2},
    "goal": {"x": 27, "y": 17},
}
CONE: dict[str, Any] = {"map": "cone", "start": {"x": 6, "y": 20}, "goal": {"x": 34, "y": 20}}
RELIEF: dict[str, Any] = {
    "map": "jacksboro-1to100",
    "start": {"x": 93, "y": 225},
    "goal": {"x": 212, "y": 73},
}
SADDLE: dict[str, Any] = {"map": "saddle", "start": {"x": 5, "y": 20}, "goal": {"x": 35, "y": 20}}

REACH: dict[str, Any] = {"map": "saddle", "start": {"x": 5, "y": 20}, "energy_j": 400}

PICTURES: dict[str, tuple[Callable[..., Any], dict[str, Any], str]] = {
    "route": (plan_route, {**RELIEF, "seed": 1}, "overview"),
    "gallery-warehouse": (plan_route, {**WAREHOUSE, "seed": 1}, "map"),
    "gallery-energy": (plan_route, {**WAREHOUSE, "seed": 1}, "energy"),
    "gallery-cone": (plan_route, {**CONE, "seed": 1}, "map"),
    "gallery-saddle": (plan_route, {**SADDLE, "seed": 1}, "map"),
    "gallery-front": (energy_time_front, {**CONE, "points": 4}, "front"),
    "gallery-reach": (reachable_area, REACH, "map"),
}
"""Name of a picture: the question, its request, and the figure of its answer."""


def main(names: list[str]) -> None:
    """Plan and draw."""
    for name in names or PICTURES:
        ask, request, figure = PICTURES[name]
        ask(request).figure(figure).save(HERE / f"{name}.svg")


if __name__ == "__main__":
    main(sys.argv[1:])
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(0)
