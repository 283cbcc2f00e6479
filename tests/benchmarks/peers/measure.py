"""One method on one question, in a process of its own: a list of findings as JSON.

    python -m tests.benchmarks.peers.measure '{"map": …, "asked": …, "method": …, "seconds": …}'

A finding is a method's path after some CPU seconds with its energies, J (None: a limit breaks):

    as it is       driven along the path as it was found, with the best yaw and speed
    own yaw        poses only: driven with the yaw that they have, at the best speed
    straightened   with fewer corners, by scikit-image
    refined        refined as our own paths are, and driven
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from planner import plan_route
from planner.search.waypoints import refine
from tests.benchmarks.peers.best_known import best_known, distinct
from tests.benchmarks.peers.case import Array, Case, case_of

Finding = dict[str, Any]


def ours(case: Case, seconds: float) -> Iterator[Finding]:
    """The answer as it comes, on a map that is known, to a goal that is not; then with time."""
    from tests.benchmarks.peers.limits import broken_limits

    ground = case.situation.ground.terrain
    yield _path_alone(case)
    back = {"start": case.asked["goal"], "goal": case.asked["start"]}
    plan_route(terrain=ground, **back)
    for name, given in (("ours", {}), ("ours, long", {"time_budget_s": seconds})):
        begun, worked = time.perf_counter(), time.process_time()
        answer = plan_route(terrain=ground, **_beside(case.asked), **given)
        took, worked = time.perf_counter() - begun, time.process_time() - worked
        if not answer.routes:
            continue
        route = answer.routes[0]
        yield {
            "method": name,
            "seconds": worked,
            "wall_s": took,
            "energies": {"as it is": route.energy_j},
            "found_by": answer.planner["chosen"],
            "broken": broken_limits(case, route),
            "path": _thinned(np.column_stack([route.arrays["x"], route.arrays["y"]])),
        }


def _beside(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The same question to a goal that no search has gone to yet: a tenth of a millimetre off."""
    goal = asked["goal"]
    return {"start": asked["start"], "goal": {"x": goal["x"] + 1e-4, "y": goal["y"]}}


def _path_alone(case: Case) -> Finding:
    """What compares with the others' times: search and refinement, without yaw and speed."""
    situation, field = case.situation, case.field
    situation.path("energy", field, case.goal, case.start)  # the lattice is there, the goal is not
    corner_penalty = situation.corner_penalty("energy")
    begun = time.process_time()
    path = situation.path("energy", field, case.start, case.goal)
    if path is None:
        return {"method": "ours, path alone", "seconds": 0.0, "energies": {}}
    [(path, _)] = refine(field, path, penalties=[corner_penalty])
    worked = time.process_time() - begun
    return {
        "method": "ours, path alone",
        "seconds": worked,
        "energies": {"as it is": case.score(path)},
        "path": path.tolist(),
    }


def isotropic(case: Case, _seconds: float) -> Iterator[Finding]:
    """scikit-image with every isotropic cost."""
    from tests.benchmarks.peers import mcp

    for cost, seconds, path in mcp.paths(case, mcp.prepare(case)):
        found = _finding(case, "MCP_Geometric", seconds, path)
        found["cost"] = cost
        found["energies"]["straightened"] = case.score(mcp.straightened(case, path))
        yield found


def plain(case: Case, _seconds: float) -> Iterator[Finding]:
    """scipy's Dijkstra."""
    from tests.benchmarks.peers import dijkstra

    seconds, path = dijkstra.shortest(case, dijkstra.prepare(case))
    if path is not None:
        yield _finding(case, "Dijkstra", seconds, path)


def ellipses(case: Case, _seconds: float) -> Iterator[Finding]:
    """ttcrpy's rays, where it is installed."""
    from tests.benchmarks.peers import eikonal

    found = eikonal.shortest(case, eikonal.prepare(case))
    if found is not None:
        yield _finding(case, "ttcrpy", *found)


def on_poses(planner: str, aim: str) -> Callable[[Case, float], Iterator[Finding]]:
    """One of OMPL's planners on poses, as time passes."""

    def curve(case: Case, seconds: float) -> Iterator[Finding]:
        from tests.benchmarks.peers import ompl_poses
        from tests.benchmarks.peers.poses import score_as_they_are

        before: Array | None = None
        energies: dict[str, float | None] = {}
        for at, priced, poses in ompl_poses.plan(case, planner, aim, seconds=seconds, seed=1):
            if poses is None:
                continue
            if poses is not before:
                own = score_as_they_are(case, poses)
                energies = {"own yaw": own, "as it is": case.score(poses)}
                before = poses
            yield {
                "method": f"{planner}, {aim}",
                "seconds": at,
                "motions_priced": priced,
                "energies": dict(energies),
                "path": poses[:, :2].tolist(),
            }
        if before is not None:
            route = case.refined(before)
            yield {
                "method": f"{planner}, {aim}",
                "seconds": seconds,
                "energies": {"refined": None if route is None else route.energy_j},
                "path": before[:, :2].tolist(),
            }

    return curve


METHODS: dict[str, Callable[[Case, float], Iterator[Finding]]] = {
    "ours": ours,
    "MCP_Geometric": isotropic,
    "Dijkstra": plain,
    "ttcrpy": ellipses,
    "BIT*, energy": on_poses("BIT*", "energy"),
    "BIT*, work": on_poses("BIT*", "work"),
    "Informed RRT*, energy": on_poses("Informed RRT*", "energy"),
    "SORRT*, energy": on_poses("SORRT*", "energy"),
    "RRT*, energy": on_poses("RRT*", "energy"),
}


def long_run(case: Case, paths: list[Array], seconds: float) -> Iterator[Finding]:
    """The best near anything that was found."""
    begun = time.process_time()
    route = best_known(case, distinct(case, paths, 8), seconds)
    if route is not None:
        yield {
            "method": "everything, refined",
            "seconds": time.process_time() - begun,
            "energies": {"as it is": route.energy_j},
        }


def _finding(case: Case, method: str, seconds: float, path: Array) -> Finding:
    route = case.refined(path)
    return {
        "method": method,
        "seconds": seconds,
        "energies": {
            "as it is": case.score(path),
            "refined": None if route is None else route.energy_j,
        },
        "path": path.tolist(),
    }


def _thinned(path: Array) -> list[list[float]]:
    """Every few points of a route's poses: where it goes, not how its bends are rounded."""
    kept: list[list[float]] = path[::8].tolist()
    return [*kept, path[-1].tolist()]


def main() -> None:
    """The command."""
    task = json.loads(sys.argv[1])
    case = case_of(task["map"], task["asked"])
    if task["method"] == "best known":
        paths = [np.array(path, float) for path in json.load(sys.stdin)]
        findings = list(long_run(case, paths, task["seconds"]))
    else:
        findings = list(METHODS[task["method"]](case, task["seconds"]))
    sys.stdout.write(json.dumps(findings))
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(0)


if __name__ == "__main__":
    main()
