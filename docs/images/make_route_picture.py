"""Makes route.png beside this file out of a planned route; started by hand."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path

from PIL import Image

from planner import plan_route

HERE = Path(__file__).resolve().parent
REQUEST = {
    "map": "jacksboro-1to100",
    "start": {"x": 93, "y": 225},
    "goal": {"x": 212, "y": 73},
    "seed": 1,
}


def main() -> None:
    """Plan, draw, and reduce the colours so that the file stays below 300 kB."""
    answer = plan_route(REQUEST)
    buffer = io.BytesIO()
    answer.plot().savefig(buffer, format="png", dpi=90)
    picture = Image.open(buffer).convert("RGB")
    colours = picture.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=2)
    colours.save(HERE / "route.png", optimize=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(0)
