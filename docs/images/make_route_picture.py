"""Makes route.svg beside this file out of a planned route; started by hand."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from planner import plan_route

HERE = Path(__file__).resolve().parent
REQUEST = {
    "map": "jacksboro-1to100",
    "start": {"x": 93, "y": 225},
    "goal": {"x": 212, "y": 73},
    "seed": 1,
}


def main() -> None:
    """Plan and draw."""
    plan_route(REQUEST).plot().save(HERE / "route.svg")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(0)
