"""Whether every gap that the body and its clearance pass is passed, and nothing is touched.

    python -m tests.benchmarks.gaps                            200 gaps
    python -m tests.benchmarks.gaps --count 20 --seed 7        others

A wall across a room has a gap that is 0.5 to 3 cm wider than body and clearance. Cells have at most
2 cm. Half the walls run along the cells, the others in any direction; there a strip of that width
is free of cells that are blocked. The start is any pose at which the body fits, and so is the goal,
or its yaw is free. The answer's motion is tested against the cells' own squares at steps of 0.5 mm
and 0.05°, with the whole clearance.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import JoulepathError
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.plan import plan_route
from planner.search.requests import PlanRequest
from planner.search.results import Route
from planner.terrain.heightmap import Terrain
from planner.terrain.obstacles import rectangle_free

WIDER = 0.005, 0.03
"""m by which gaps are wider than the body with its clearance."""
CELLS = 0.01, 0.02
"""m, of cells."""
STEP, TURN = 5e-4, math.radians(0.05)
"""m and rad between poses that are tested."""
ALLOWED = 5e-5
"""m of the clearance that a motion may use: 0.1 % of 5 cm."""
ROOM = 2.0
"""m from the wall to the map's border: the body can turn there, but not everywhere."""


@dataclass(frozen=True)
class Gap:
    """One question: a way through one gap.

    Attributes:
        terrain, model: map and robot.
        request: start and goal on both sides of the wall.
        text: what it is, in words.
    """

    terrain: Terrain
    model: PowerModel
    request: PlanRequest
    text: str


def gaps(
    count: int, seed: int, room: float = ROOM, wider: tuple[float, float] = WIDER
) -> Iterator[Gap]:
    """Random gaps; the same for the same seed."""
    for number in range(count):
        yield gap(np.random.default_rng((seed, number)), room, wider, turned=number % 2 == 1)


def gap(rng: np.random.Generator, room: float, wider: tuple[float, float], *, turned: bool) -> Gap:
    """One random gap, along the cells or ``turned`` in any direction."""
    vehicle = load_vehicle("minibalance")
    clearance = float(rng.choice([0.02, 0.03, 0.05]))
    width = float(rng.uniform(0.4, 0.6))
    vehicle = replace(vehicle, width=width, limits=replace(vehicle.limits, clearance=clearance))
    spare = float(rng.uniform(*wider))
    needed = width + 2.0 * clearance
    wide, cell = needed + spare, float(rng.uniform(*CELLS))
    across_gap = math.ceil(wide / cell)
    angle = float(rng.uniform(0.0, math.pi))
    if not turned:
        # The gap is as wide as so many cells; its middle is a cell's middle or border.
        cell, angle = wide / across_gap, 0.5 * math.pi * int(rng.integers(2))
    thick = float(rng.uniform(0.04, 0.6))
    along = np.array([math.cos(angle), math.sin(angle)])
    side = 2 * math.ceil((0.5 * thick + room) / cell) + int(rng.integers(2))
    x0 = -0.5 * (side - 1) * cell
    if not turned:
        x0 = -cell * (side // 2) + (0.0 if across_gap % 2 else 0.5 * cell)
    axis = x0 + cell * np.arange(side)
    x, y = np.meshgrid(axis, axis)
    through, across = x * along[0] + y * along[1], y * along[0] - x * along[1]
    reach = 0.5 * cell * (abs(along[0]) + abs(along[1]))
    # A cell stands in the wall where its middle does, and leaves the strip where any part is in it.
    solid = np.abs(through) <= 0.5 * thick
    solid &= np.abs(across) >= 0.5 * wide + reach - 1e-9
    terrain = Terrain.from_arrays(
        np.zeros((side, side)), cell=(cell, cell), origin=(x0, x0), obstacles=solid, name="gap"
    )

    def pose(on: float) -> dict[str, float]:
        """Any at which the body fits, on one side of the wall."""
        while True:
            place, yaw = rng.uniform(-room, room, 2), rng.uniform(-math.pi, math.pi)
            half = 0.5 * vehicle.length + clearance, 0.5 * width + clearance
            if on * (place @ along) > 0.5 * thick and rectangle_free(
                solid, x0, x0, cell, cell, *place, yaw, *half
            ):
                return {"x": place[0], "y": place[1], "yaw": yaw}

    start, goal = pose(-1.0), pose(1.0)
    if rng.random() < 0.5:
        del goal["yaw"]
    request = PlanRequest.model_validate({"map": "gap", "start": start, "goal": goal})
    text = (
        f"cells {cell:.4f} m, {math.degrees(angle):5.1f}°, {100 * spare:.2f} cm wider than "
        f"{needed:.3f} m, wall {thick:.2f} m, yaw {math.degrees(start['yaw']):4.0f}°"
    )
    return Gap(terrain, PowerModel.from_vehicle(vehicle), request, text)


def overlap(one: Gap, route: Route) -> float:
    """m of the clearance that a route's motion uses, 0 where it keeps all of it."""
    vehicle = one.model.vehicle
    clearance = vehicle.limits.clearance
    poses = route.poses
    solid, (x0, y0), (dx, dy) = one.terrain.obstacles, one.terrain.origin, one.terrain.cell
    worst = 0.0
    for a, b in zip(poses[:-1], poses[1:], strict=True):
        turn = b.yaw - a.yaw
        count = max(1, math.ceil(max(math.hypot(b.x - a.x, b.y - a.y) / STEP, abs(turn) / TURN)))
        for w in np.arange(count + 1) / count:
            pose = a.x + w * (b.x - a.x), a.y + w * (b.y - a.y), a.yaw + w * turn
            while worst <= clearance and not rectangle_free(
                *(solid, x0, y0, dx, dy, *pose),
                *(
                    0.5 * vehicle.length + clearance - worst,
                    0.5 * vehicle.width + clearance - worst,
                ),
            ):
                worst += 1e-5
    return worst


def main() -> None:
    """Ask for a way through every gap; exit 1 where one is not found or something is touched."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    refused, worst, seconds = 0, 0.0, []
    for number, one in enumerate(gaps(asked.count, asked.seed)):
        if number < asked.first:
            continue
        begun = time.process_time()
        try:
            answer = plan_route(one.request, terrain=one.terrain, model=one.model)
            reason = answer.reason
        except JoulepathError as error:
            answer, reason = None, str(error)
        seconds.append(time.process_time() - begun)
        if answer is None or not answer.routes:
            refused += 1
            print(f"{number}: {one.text}: {reason} ({seconds[-1]:.1f} s)", flush=True)
            continue
        used = overlap(one, answer.routes[0])
        worst = max(worst, used)
        told = f"passed, {1e3 * used:.2f} mm of the clearance used ({seconds[-1]:.1f} s)"
        print(f"{number}: {one.text}: {told}", flush=True)
    print(
        f"{len(seconds)} gaps, {refused} without a route, at most {1e3 * worst:.2f} mm of the "
        f"clearance used; CPU s: median {np.median(seconds):.2f}, most {max(seconds):.2f}"
    )
    sys.exit(refused > 0 or worst > ALLOWED)


if __name__ == "__main__":
    main()
