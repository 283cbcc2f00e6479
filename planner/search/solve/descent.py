"""Descent: rough trajectories with their waypoints moved.

    better = descended(run, moving, closely)       # (Driven, Sketch), cheapest first

planner.search.waypoints moves them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.quantities import STANDARD_GRAVITY
from planner.search.field import polyline_cost
from planner.search.results import Route
from planner.search.run import Run
from planner.search.solve.sketch import Closely, Driven, Sketch, with_costs
from planner.search.waypoints import optimise_waypoints, worth_optimising

DESCENDED, MOST_SAVED = 3, 0.025
"""Sketches whose waypoints are moved at most, and the share of what a trajectory dissipates that
this may save: a sketch that takes more than that in addition is left alone."""


def descended(
    run: Run, moving: Sequence[tuple[Driven, Sketch]], closely: Closely
) -> list[tuple[Driven, Sketch]]:
    """The best trajectories with their waypoints moved, where that is likely to help and does.

    Moved waypoints seldom pass a place where a limit is broken. So once a trajectory was refused,
    only such are taken that are feasible as they are.

    Args:
        run: the request.
        moving: trajectories by energy, each with its sketch; of a sketch, the best one is taken.
        closely: drives them.
    """
    found: list[tuple[Driven, Sketch]] = []
    wary = closely.refused
    with run.within_budget() as limited:
        for one, of in _worth_descent(moving, found):
            limited.check()
            if wary and closely.stopped(limited, one.legs, of):
                continue
            legs = [path for path, _ in one.legs]
            better = optimise_waypoints(
                *(of.field, run.conditions, legs, run.yaws),
                both=run.other_core.all,
                check=limited.check,
            )
            if better.motion is not None and better.energy < one.energy:
                moved = with_costs(of.field, better.legs)
                driven = Driven(moved, better.motion, better.energy, better.dissipated)
                found.append((driven, of))
    return sorted(found, key=lambda pair: pair[0].energy)


def dissipated(run: Run, route: Route) -> float:
    """J that a route takes without what climbing stores."""
    return route.energy_j - run.conditions.mass * STANDARD_GRAVITY * route.rise_m


def _worth_descent(
    moving: Sequence[tuple[Driven, Sketch]], found: Sequence[tuple[Driven, Sketch]]
) -> Iterator[tuple[Driven, Sketch]]:
    """The best trajectory of each sketch that may come below those ``found`` so far."""
    tried: list[Sketch] = []
    for one, of in moving:
        least = min((better.energy for better, _ in found), default=moving[0][0].energy)
        if len(tried) == DESCENDED or one.energy - MOST_SAVED * one.dissipated >= least:
            return
        if any(of is other for other in tried):
            continue
        tried.append(of)
        # The legs' own costs may hold penalties for clearance.
        metres = sum(polyline_cost(of.field, path, of.field.step) for path, _ in one.legs)
        if worth_optimising(one.dissipated, metres):
            yield one, of
