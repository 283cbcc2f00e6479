"""Planners by name, and the answer that each gives to a request.

found = answer(run)            # by run.request.planner: "least-energy", "bit*", "rrt*", ...
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from planner.arrays import Array
from planner.search.ompl.costs import costs_of
from planner.search.ompl.least_energy import solved
from planner.search.ompl.sampling import Sampled, Sampling, in_fresh_process
from planner.search.run import Run
from planner.search.solve import Found, best_along, best_route, summary_of

ITERATIONS = {"bit*": 4000, "rrt*": 800, "informed-rrt*": 800}
"""Iterations of a sampling planner where the request gives neither a time budget nor iterations:
about two seconds, but the same answer on every machine."""


def answer(run: Run) -> Found:
    """The best route that the request's planner finds.

    Args:
        run: the request; its goal is one place.

    Raises:
        Cancelled: the caller wants to stop.
    """
    if run.request.planner != "least-energy":
        return _sampled(run)
    found, status = solved(run, best_route)
    return replace(found, summary=replace(found.summary, status=status))


def _sampled(run: Run) -> Found:
    """What a sampling planner finds, leg by leg, smoothed and driven."""
    asked = run.request
    iterations = asked.iterations
    if iterations is None and "time_budget_s" not in asked.model_fields_set:
        iterations = ITERATIONS[asked.planner]
    run.step(0.1, f"sampling by {asked.planner}")
    costs = costs_of(run, asked.objective, asked.space == "poses")
    legs = list(pairwise(run.poses))
    runs: list[Sampled] = []
    paths: list[Array] = []
    for start, goal in legs:
        sampling = Sampling(
            asked.planner,
            costs,
            start,
            goal,
            asked.seed,
            asked.time_budget_s / len(legs),
            iterations,
        )
        found = in_fresh_process(sampling, run.token)
        runs.append(found)
        if found.path is None:
            break
        paths.append(_ended(found.path, (start.x, start.y), (goal.x, goal.y)))
    summary = replace(
        summary_of(run),
        status=runs[-1].status,
        iterations=sum(one.iterations for one in runs),
        edges_evaluated=sum(one.evaluations for one in runs),
    )
    spent = f"{summary.iterations} iterations"
    if iterations is None:
        spent = f"{asked.time_budget_s:g} s"
    nothing = f"{asked.planner} found nothing in {spent}"
    if len(paths) < len(legs):
        return Found(summary, reason=f"{nothing}; least-energy searches exhaustively")
    run.step(0.6, "smoothing, yaw, speed")
    best = best_along(run, paths, replace(summary, path_cost=sum(one.cost for one in runs)))
    if best.candidate is None:
        return replace(best, reason=f"{nothing} that can be driven: {best.reason}")
    return best


def _ended(path: Array, start: tuple[float, float], goal: tuple[float, float]) -> Array:
    """The path with its ends exactly where they were asked for."""
    path = path.copy() if len(path) > 1 else np.array([start, goal])
    path[0], path[-1] = start, goal
    return path
