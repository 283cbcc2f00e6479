"""The certified lower bound of a route's energy: a potential that no steadily driven route outruns.

    bound = certify(field, conditions, [start, via, goal], seconds=30.0)
    bound.bound_j                     # J; no route of the class ``bound.how`` takes less

Its parts, with the proof in docs/lower-bound.md:

    steady_floor      the least that a metre of steady driving dissipates, by slope
    mesh              triangles of the map, with the ranges of their slopes
    triangle_costs    from both, a floor of the cost in every triangle and direction
    potential         the steepest function whose slope stays below it, made exact at the end
    ends              what start and stop add at least

With little time nodes are left out; the bound stays valid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.ndimage import distance_transform_edt

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.quantities import STANDARD_GRAVITY
from planner.search.certificate.ends import both_ends
from planner.search.certificate.mesh import Mesh, coarse_field, mesh_of
from planner.search.certificate.potential import levelled, steepest_potential, weights_at
from planner.search.certificate.quick_bound import lower_bound
from planner.search.certificate.steady_floor import steady_floor
from planner.search.certificate.triangle_costs import triangle_costs
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.grid import CostToGo, build_lattice, cost_to_go
from planner.search.second_core import CORE

Place = tuple[float, float]

STEADY, ALL = "steadily driven routes", "all motions"
"""Classes that a bound holds for."""
NODES_PER_SECOND, MOST_MESH_NODES = 30_000, 250_000
"""Nodes of the mesh for each second given, and at most: with more, too few rounds fit in."""
SETTLED_LOOKS = 4
"""Looks at the potential without a gain of one part in ten thousand, after which it is done."""
MOST_CLASSES = 64
"""Ground classes that the bits of a cell can distinguish."""


@dataclass(frozen=True)
class CertifiedBound:
    """A lower bound and what it holds for.

    Attributes:
        bound_j: J that every route of the class takes from the source at least.
        seconds: that it took.
        how: the class, STEADY or ALL; ALL where the quick bound is the closer one.
    """

    bound_j: float
    seconds: float
    how: str


def legs_bound(field: CostField, conditions: OperatingConditions, places: Sequence[Place]) -> float:
    """J that every motion through places, in this order, takes at least; see lower_bound."""
    legs = [math.dist(*leg) for leg in pairwise(places)]
    steepest = float(field.limit.max())
    return lower_bound(conditions, sum(legs), _climb(field, places), steepest, shortest=min(legs))


def _climb(field: CostField, places: Sequence[Place]) -> float:
    heights, _ = sample_surface(field, np.array([places[0], places[-1]]))
    return float(heights[1] - heights[0])


def certify(
    field: CostField,
    conditions: OperatingConditions,
    places: Sequence[Place],
    *,
    seconds: float = 30.0,
    token: CancellationToken | None = None,
) -> CertifiedBound:
    """Bound the energy of routes through places, in this order, from below.

    Args:
        field: map with the costs of steady driving by energy. The costs guide the search for a
            potential alone: the bound stays valid where they are wrong.
        conditions: model and conditions.
        places: x, y of start, via points and goal in the map's frame, m.
        seconds: time to spend.
        token: cancellation.

    Raises:
        Cancelled: the caller cancelled.
    """
    began = time.perf_counter()
    token = token or CancellationToken()
    token.check()
    quick, steady = legs_bound(field, conditions, places), -math.inf
    if any(a != b for a, b in pairwise(places)):
        steady = _steady(field, conditions, places, seconds, token)
        steady += conditions.mass * STANDARD_GRAVITY * _climb(field, places)
    bound, how = (steady, STEADY) if steady > quick else (quick, ALL)
    return CertifiedBound(bound, time.perf_counter() - began, how)


def _steady(
    field: CostField,
    conditions: OperatingConditions,
    places: Sequence[Place],
    seconds: float,
    token: CancellationToken,
) -> float:
    """J that steadily driven routes dissipate at least; minus infinity where nothing is known."""
    began = time.perf_counter()
    if conditions.wind.any() or len(conditions.class_rows) > MOST_CLASSES:
        return -math.inf
    floor = steady_floor(conditions)
    if floor is None or floor.least.min() <= 0.0:
        return -math.inf
    nodes = min(max(NODES_PER_SECOND * seconds, 2_000.0), MOST_MESH_NODES)
    mesh = mesh_of(field, floor.steepest, math.ceil(math.sqrt(field.heights.size / nodes)))
    token.check()
    costs = triangle_costs(floor, mesh)
    open_ground = costs[np.isfinite(costs[..., 0])]
    if not len(open_ground) or open_ground.min() <= 0.0:
        return -math.inf
    coarse = coarse_field(field, mesh)
    lattice = build_lattice(coarse)
    total = both_ends(floor, mesh, conditions, places[0], places[-1])
    legs = [leg for leg in pairwise(places) if leg[0] != leg[1]]
    for number, leg in enumerate(legs, 1):
        until = began + seconds * number / len(legs)

        def check(until: float = until) -> bool:
            token.check()
            return time.perf_counter() < until

        guides = CORE.all(
            [
                partial(cost_to_go, coarse, lattice, leg[1]),
                partial(cost_to_go, coarse, lattice, leg[0], from_start=True),
            ]
        )
        token.check()
        # The mean of both is smooth where one of them has its tip.
        to_goal, from_start = (_everywhere(guide, coarse) for guide in guides)
        total += _fall(costs, 0.5 * (to_goal - from_start), mesh, leg, check)
    return total


def _fall(
    costs: Array, psi: Array, mesh: Mesh, leg: tuple[Place, Place], check: Callable[[], bool]
) -> float:
    """J by which the best potential falls over a leg, from a first one."""
    ends = [weights_at(place, mesh.origin, mesh.cell, psi.shape) for place in leg]
    history: list[float] = []

    def more(psi: Array) -> bool:
        top, bottom = (sum(w * float(psi[n]) for n, w in zip(*end, strict=True)) for end in ends)
        found = levelled(psi, costs, mesh.cell, top, bottom)
        history.append(max(found, history[-1]) if history else found)
        before = history[-1 - SETTLED_LOOKS] if len(history) > SETTLED_LOOKS else -math.inf
        return check() and found - before >= 1e-4 * abs(found)

    # A first look comes after some iterations, however little time there is.
    steepest_potential(costs, psi, mesh.cell, *ends, more=more)
    return history[-1]


def _everywhere(guide: CostToGo, field: CostField) -> Array:
    """Costs of a guide (ny, nx), finite where there is no path as well."""
    values = guide.values.astype(float)
    reached = np.isfinite(values)
    if reached.all():
        return values
    if reached.any():
        nearest = distance_transform_edt(~reached, return_distances=False, return_indices=True)
        return np.asarray(values[tuple(nearest)])
    # A place in a passage that lies between the nodes: as the crow flies.
    ny, nx = values.shape
    x = field.x0 + field.dx * np.arange(nx) - guide.goal[0]
    y = field.y0 + field.dy * np.arange(ny) - guide.goal[1]
    return np.asarray(np.hypot(x[None, :], y[:, None]))
