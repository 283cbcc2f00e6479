"""Requests on the fixed maps whose answers are kept, and how they are planned.

``python -m tests.regression.cases`` prints today's figures in the form of expected.json. Figures
there change only together with the reason written beside them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

EXPECTED = Path(__file__).with_name("expected.json")

CASES: dict[str, dict[str, Any]] = {
    "test bench, over the top": {
        "map": "test-bench",
        "start": {"x": 0.8, "y": 1.5, "yaw": 0.0},
        "goal": {"x": 13.0, "y": 1.5, "yaw": 0.0},
    },
    "warehouse, through the racks": {
        "map": "warehouse",
        "start": {"x": 2.0, "y": 2.0},
        "goal": {"x": 20.0, "y": 17.0},
    },
    "tilted plane, across": {
        "map": "tilted-plane",
        "start": {"x": 3.0, "y": 12.0},
        "goal": {"x": 20.0, "y": 12.0},
    },
    "cone, round the top": {
        "map": "cone",
        "start": {"x": 6.0, "y": 20.0},
        "goal": {"x": 34.0, "y": 20.0},
    },
    "saddle, over the pass": {
        "map": "saddle",
        "start": {"x": 6.0, "y": 9.0},
        "goal": {"x": 34.0, "y": 33.0},
    },
    "fractal, corner to corner": {
        "map": "fractal-512",
        "start": {"x": 10.0, "y": 10.0},
        "goal": {"x": 118.0, "y": 116.0},
    },
    "jacksboro, along steep slopes": {
        "map": "jacksboro-1to100",
        "start": {"x": 95.0, "y": 264.8},
        "goal": {"x": 265.6, "y": 120.2},
    },
    "loaded robot on the tilted plane": {
        "map": "tilted-plane",
        "start": {"x": 4.0, "y": 4.0},
        "goal": {"x": 19.0, "y": 18.0},
        "payload": {"mass": 5.0, "x": 0.05, "y": 0.0},
    },
}


def measure(name: str) -> dict[str, Any]:
    """Energy, length, duration and account of one case, planned on the grid."""
    from planner import plan_route

    answer = plan_route(CASES[name])
    if answer.status != "ok":
        return {"status": answer.status, "reason": answer.reason}
    route = answer.routes[0]
    return {
        "energy_j": round(route.energy_j, 2),
        "length_m": round(route.length_m, 3),
        "duration_s": round(route.duration_s, 2),
        "breakdown_j": {slug: round(value, 2) for slug, value in route.breakdown_j.items()},
    }


if __name__ == "__main__":
    json.dump({name: measure(name) for name in CASES}, sys.stdout, indent=2)
