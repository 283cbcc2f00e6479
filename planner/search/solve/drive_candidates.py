"""From paths to motions: legs refined in several ways, driven roughly, and the best within limits.

moved, stuck = driven_roughly(run, field, paths, objective, (), False)    # cheapest first
refined, route = driven_closely(run, field, None, moved, stuck, objective, False)
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost
from planner.search.resolution import OBJECTIVES
from planner.search.results import Route, energy_of, price
from planner.search.se2 import PosePath, keeping_yaw
from planner.search.solve.run import Run
from planner.search.trajectory import CLOSELY, ROUGHLY, Care, Motion, Stuck, move
from planner.search.waypoints import VARIANTS, polish, refine, worth_polishing

POSED = {2.0: (1.0,), 4.0: (1.0,)}
"""As VARIANTS of planner.search.waypoints.path_smoothing, for ways that keep their yaw angles."""
DEARER = 0.01
"""Share of the energy that keeping to limits may cost before other ways are tried as well."""

Refined = list[tuple[Array, float]]
"""A refined polyline with its cost for each leg."""


@dataclass(frozen=True)
class Tried:
    """Refined legs, the motion along them, its energy and what it dissipates, J.

    The energies are infinite where it is stuck.
    """

    refined: Refined
    motion: Motion | Stuck
    energy: float = math.inf
    dissipated: float = math.inf


def driven_roughly(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    ways: Sequence[PosePath],
    checked: bool,
) -> tuple[list[Tried], list[Tried]]:
    """The legs refined with closer and wider knots: what moves, cheapest first, and what sticks.

    With ``checked`` all limits are kept between the stations too.
    """
    toll = run.situation.toll(objective)
    variants = VARIANTS if objective == "energy" else {8.0: (1.0,)}
    near = field
    if ways:
        variants, near = POSED, keeping_yaw(field, ways)

    def refined_legs(knot_cells: float, shares: Sequence[float]) -> list[Refined]:
        tolls = [share * toll for share in shares]
        legs = [
            refine(near, path, tolls=tolls, knot_cells=knot_cells, check=run.check)
            for path in paths
        ]
        return [list(refined) for refined in zip(*legs, strict=True)]

    def tried(refined: Refined) -> Tried:
        motion = move_along(run, field, refined, objective, ROUGHLY, checked)
        if isinstance(motion, Stuck):
            return Tried(refined, motion)
        energy = energy_of(field, run.around, motion)
        climb = run.around.mass * STANDARD_GRAVITY * float(motion.heights[-1] - motion.heights[0])
        return Tried(refined, motion, energy, energy - climb)

    several = run.other_core.all([partial(refined_legs, *variant) for variant in variants.items()])
    chains = itertools.chain.from_iterable(several)
    found = run.other_core.all([partial(tried, refined) for refined in chains])
    moved = [one for one in found if isinstance(one.motion, Motion)]
    stuck = [one for one in found if isinstance(one.motion, Stuck)]
    return sorted(moved, key=lambda one: one.energy), stuck


def driven_closely(
    run: Run,
    field: CostField,
    better: Tried | None,
    moved: list[Tried],
    stuck: list[Tried],
    objective: str,
    checked: bool,
) -> tuple[Refined, Route | Stuck]:
    """The cheapest of these ways that keeps to all limits, or where they stick.

    ``better`` is ``moved[0]`` with its knots moved: it counts only if it keeps to all limits, and
    if that costs what was gained, only if the others cost more. What is ``checked`` already is not
    worked out more closely.
    """
    kept: list[tuple[Refined, Route]] = []
    for one in moved if better is None else [better, *moved]:
        closer = one.motion
        if not checked:
            closer = move_along(run, field, one.refined, objective, CLOSELY, True)
        if isinstance(closer, Stuck):
            stuck = [Tried(one.refined, closer)]
            continue
        route = priced(run, field, closer)
        kept.append((one.refined, route))
        # Where keeping to the limits costs little, the others are not looked at.
        most = moved[0].energy + (0.0 if one is better else DEARER * abs(moved[0].energy))
        if objective != "energy" or route.energy_j <= most:
            break
    if kept:
        return min(kept, key=lambda way: way[1].energy_j)
    where = stuck[0].motion
    assert isinstance(where, Stuck)  # whatever did not move is stuck
    return (moved or stuck)[0].refined, where


def with_knots_moved(run: Run, field: CostField, best: Tried) -> Tried | None:
    """The best way with its knots moved, where that is likely to help and does."""
    if not worth_polishing(best.dissipated, sum(cost for _, cost in best.refined)):
        return None
    legs = [path for path, _ in best.refined]
    better = polish(field, run.around, legs, run.yaws, both=run.other_core.all, check=run.check)
    if better.motion is None or better.energy >= best.energy:
        return None
    refined = [(leg, float(polyline_cost(field, leg, field.step))) for leg in better.legs]
    return Tried(refined, better.motion, better.energy, better.dissipated)


def move_along(
    run: Run,
    field: CostField,
    refined: Refined,
    objective: str,
    care: Care,
    checked: bool,
) -> Motion | Stuck:
    """The motion along refined legs, or where it is stuck; ``care`` and ``checked`` as in move."""
    run.check()
    legs = [path for path, _ in refined]
    if objective == "length":
        # Whatever way it goes, a robot turns as costs it least.
        costs = run.situation.costs("energy")
        field = field._replace(by_yaw=costs.by_yaw, yaw_limit=costs.yaw_limit, lean=costs.lean)
    return move(
        field,
        run.around,
        legs,
        run.yaws,
        objective=OBJECTIVES[objective],
        care=care,
        checked=checked,
    )


def drive_legs(run: Run, field: CostField, refined: Refined, objective: str) -> Route | Stuck:
    """The best motion along refined legs, and its energy."""
    motion = move_along(run, field, refined, objective, CLOSELY, True)
    return motion if isinstance(motion, Stuck) else priced(run, field, motion)


def priced(run: Run, field: CostField, motion: Motion) -> Route:
    """The route of a motion, with its energy and account."""
    return price(field, run.around, motion, charge=run.request.conditions.battery_charge)
