"""What routes take if friction changes its sign at once: a planner must not live off smooth signs.

    python -m tests.benchmarks.sharp_friction                      questions of hard maps
    python -m tests.benchmarks.sharp_friction --seed 7 --count 4   others

The power model's friction changes sign within some mm/s. A route may lean into that: rollers that
creep drag less than they would. Every route is priced once more, motion and ground as they are, by
the second power model of tests/power/reference.py, whose signs are sharp.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

from planner import plan_route
from planner.arrays import Array
from planner.quantities import INDEX
from planner.search.requests import PlanRequest
from planner.search.situation import situation_of
from planner.search.trajectory import motion_rows
from planner.terrain.heightmap import Terrain
from tests.benchmarks.hard_maps import SEED, made, places
from tests.power.reference import Robot, State, evaluate

MAPS = ("shelves", "rocks", "maze", "jacksboro-1to100")
"""Maps of one kind of ground, as the second model knows no others; the warehouse has several."""
BARS = {"mean": 0.1, "worst": 0.3}
"""% of the energy."""


def sharp_watts(rows: Array) -> Array:
    """(n,) W of rows, with sharp signs."""
    robot, found = Robot(), np.empty(len(rows))
    for n, row in enumerate(rows):
        velocity, gravity, acceleration = (
            tuple(float(row[INDEX[name]]) for name in names)
            for names in (
                ("vx", "vy", "wz"),
                ("gravity_x", "gravity_y", "gravity_normal"),
                ("ax", "ay", "yaw_acceleration"),
            )
        )
        state = State(velocity=velocity, gravity=gravity, acceleration=acceleration)
        found[n] = evaluate(robot, state).supply
    return found


def shares(terrain: Terrain, count: int, seed: int) -> list[float]:
    """% by which routes between random places take more with sharp signs."""
    found = []
    for asked in places(terrain, count, seed):
        route = plan_route(terrain=terrain, **asked).routes[0]
        request = PlanRequest.from_json({"map": terrain.name, **asked})
        situation = situation_of(request, terrain=terrain)
        field, conditions = situation.field("energy"), situation.conditions
        assert route.motion is not None
        rows, seconds, _ = motion_rows(field, route.motion, conditions.class_rows, conditions.wind)
        found.append(100.0 * (float(sharp_watts(rows) @ seconds) / route.energy_j - 1.0))
    return found


def measure(seed: int = SEED, count: int = 6) -> dict[str, Any]:
    """Mean and largest share over all maps, and whether the bars hold."""
    every: list[float] = []
    for name in MAPS:
        found = shares(made(name, seed), count, seed)
        every += found
        print(f"{name:18s} mean {np.mean(found):.3f} %, worst {max(found):.3f} %", flush=True)
    measured = {"mean": round(float(np.mean(every)), 3), "worst": round(max(every), 3)}
    holds = all(measured[name] <= bar for name, bar in BARS.items())
    return {"routes": len(every), "per_cent": measured, "bars": BARS, "holds": holds}


def main() -> None:
    """Print the shares by map, and whether the bars hold."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--count", type=int, default=6, help="questions on each map")
    options = parser.parse_args()
    print(json.dumps(measure(options.seed, options.count)))


if __name__ == "__main__":
    main()
