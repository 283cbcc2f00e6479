"""A process in which one more effect stands beside the catalogue: what follows from its file alone.

    python -m tests.conformance.one_more_effect FOLDER

FOLDER holds the file; nothing else names the effect. Prints JSON. The file is imported as if it lay
in planner/power/effects, since a package may have several folders.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

import planner.power.effects as package


def observed(folder: Path) -> dict[str, Any]:
    """What catalogue, page, cases, robot, diagnosis and planning make of the effect."""
    package.__path__.append(str(folder))
    # Not before the folder belongs to the package.
    from docs.make_effects import effects_page
    from planner import diagnose, plan_route
    from planner.power.catalogue import list_effects
    from planner.power.model import PowerModel
    from planner.power.vehicles import load_vehicle
    from planner.telemetry.virtual import Noise, VirtualRobot
    from tests.hidden_effects.cases import cases

    (slug,) = (path.stem for path in folder.glob("*.py"))
    robot = VirtualRobot("minibalance", hidden={slug: {"size": 0.08}}, seed=2)
    drive = robot.drive("rich", noise=Noise(level=0.01))
    drive.write_csv(folder / "drive.csv")
    flat = VirtualRobot("minibalance", seed=2).drive("flat", noise=Noise(level=0.01))
    flat.write_csv(folder / "flat.csv")
    found, without = (
        diagnose(folder / name, "minibalance").to_json() for name in ("drive.csv", "flat.csv")
    )
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=[slug])
    model.save(folder / "model.json")
    ends = {"start": {"x": 6.0, "y": 20.0}, "goal": {"x": 34.0, "y": 20.0}}
    route = plan_route(map="cone", model=str(folder / "model.json"), **ends).routes[0]
    x, y = np.diff(route.arrays["x"]), np.diff(route.arrays["y"])
    forward = np.hypot(x, y) * np.cos(route.arrays["yaw"][:-1] - np.arctan2(y, x))
    return {
        "listed": slug in [entry["name"] for entry in list_effects()],
        "on_the_page": f"\n## {slug}\n" in effects_page(),
        "cases": sorted({case.kind for case in cases(seeds=1) if slug in case.truth}),
        "hidden": robot.hidden[slug],
        "size": drive.truth["sizes"][slug],
        "selected": found["selected"],
        "fitted": found["candidates"][0]["parameters"],
        "truth": drive.truth["hidden"][slug],
        "not_there": without["selected"],
        "in_the_account_j": route.breakdown_j[slug],
        "forward_m": float(forward.sum()),
        "gap": route.gap,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(observed(Path(sys.argv[1])), default=str) + "\n")
