"""Makes route.svg and the gallery's route pictures beside this file; started by hand.

python -m docs.images.make_route_pictures [NAME…]    # all, or some of PICTURES
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from planner import plan_route

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

PICTURES: dict[str, tuple[dict[str, Any], str]] = {
    "route": ({**RELIEF, "seed": 1}, "overview"),
    "gallery-warehouse": ({**WAREHOUSE, "seed": 1}, "map"),
    "gallery-energy": ({**WAREHOUSE, "seed": 1}, "energy"),
    "gallery-cone": ({**CONE, "seed": 1}, "map"),
    "gallery-saddle": ({**SADDLE, "seed": 1}, "map"),
}
"""Name of a picture: the request, and the figure of its answer."""


def main(names: list[str]) -> None:
    """Plan and draw."""
    for name in names or PICTURES:
        request, figure = PICTURES[name]
        plan_route(request).figure(figure).save(HERE / f"{name}.svg")


if __name__ == "__main__":
    main(sys.argv[1:])
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(0)
