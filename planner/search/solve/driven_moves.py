"""The best route with waypoints moved at random and driven closely each time, in a time budget.

    for candidate in with_moves_driven(run, field, best, left): ...

Waypoint descent keeps yaw and speeds as they were while it looks about. Where a limit holds the
speed down, at tight corners above all, a move allows another speed and yaw, and most of what it
saves comes from them. A corner that is moved by a centimetre may be taken half as fast again. Only
driving anew shows that.

Moves are drawn where the route takes most beyond its metres. A move and its opposite are driven at
once, and what saves energy is repeated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost
from planner.search.results import Route, energy_by_step
from planner.search.run import Run
from planner.search.solve.pipeline import Candidate, drive_legs
from planner.search.solve.sketch import with_costs
from planner.search.trajectory import Motion

SMALLEST, LARGEST = 0.01, 1.0
"""Cells, spread of a waypoint's move: any size between is as likely."""
LIKELY = {"one": 0.5, "several": 0.35, "new": 0.1, "left out": 0.05}
"""How often one waypoint is moved, with its neighbours, a new one, or one is left out."""
NEIGHBOURS = (0.5, 4.0)
"""Waypoints over which a move of several fades, least and most."""
NEW_AT = (0.05, 0.95)
"""Shares of a piece between which a new waypoint is put."""
ANYWHERE = 0.25
"""Share of moves that are drawn anywhere: not only where the route takes more than its metres."""


class Move(NamedTuple):
    """Waypoints of every leg, (k, 2) m each, and by how much they are moved."""

    legs: list[Array]
    shifts: list[Array]

    def by(self, share: float) -> list[Array]:
        """The legs, moved by a share of it."""
        return [leg + share * shift for leg, shift in zip(self.legs, self.shifts, strict=True)]


def with_moves_driven(
    run: Run, field: CostField, best: Candidate, left: Callable[[], bool]
) -> Iterator[Candidate]:
    """Cheaper and cheaper routes near the best one, while time is left.

    Args:
        run: the request; its seed draws the moves.
        field: map and costs.
        best: the route to begin with.
        left: whether another two trajectories may be begun.

    Raises:
        Cancelled: the caller wants to stop, or the time is up within a trajectory.
    """
    random = np.random.default_rng(run.request.seed)
    cell = min(field.dx, field.dy)
    legs, route = [path for path, _ in best.legs], best.route
    likely = _likely(run, field, legs, route)
    again: Move | None = None
    while left():
        run.step(0.9, "waypoints moved and driven")
        move = again or _drawn(random, legs, likely, cell)
        shares = (1.0, -1.0) if again is None else (1.0, 2.0)
        shifted = any(shift.any() for shift in move.shifts)  # nothing is where one is left out
        tried = [move.by(share) for share in shares[: 2 if shifted else 1]]
        tasks = [partial(drive_legs, run, field, with_costs(field, one), "energy") for one in tried]
        again = None
        for paths, found in zip(tried, run.other_core.all(tasks), strict=True):
            if not isinstance(found, Route) or found.energy_j >= route.energy_j:
                continue
            if shifted:
                again = Move(paths, [a - b for a, b in zip(paths, move.legs, strict=True)])
            legs, route = paths, found
            likely = _likely(run, field, legs, route)
            yield Candidate(route, "waypoints moved and driven", with_costs(field, legs))


def _likely(run: Run, field: CostField, legs: Sequence[Array], route: Route) -> Array:
    """How likely each waypoint is moved, (waypoints of all legs,): by what is spent beside it.

    Beyond what the metres take, that is; the ends of legs stay.
    """
    motion = route.motion
    assert isinstance(motion, Motion)
    joules = np.append(0.0, np.cumsum(energy_by_step(field, run.conditions, motion)))
    spent = joules - run.conditions.mass * STANDARD_GRAVITY * (motion.heights - motion.heights[0])
    excess, inner = [], []
    for path in legs:
        # Half of a piece belongs to the waypoint at its end.
        halves = np.empty((2 * len(path) - 1, 2))
        halves[::2], halves[1::2] = path, 0.5 * (path[1:] + path[:-1])
        taken = np.diff(motion.along(halves, spent))
        metres = [polyline_cost(field, halves[k : k + 2], field.step) for k in range(len(taken))]
        beyond = np.maximum(np.where(np.isfinite(metres), taken - metres, 0.0), 0.0)
        excess.append(np.pad(beyond[1:-1:2] + beyond[2::2], 1))
        inner.append(np.pad(np.ones(len(path) - 2), 1))
    most, free = np.concatenate(excess), np.concatenate(inner)
    anywhere = free / max(free.sum(), 1.0)
    if most.sum() <= 0.0:
        return np.asarray(anywhere)
    return np.asarray((1.0 - ANYWHERE) * most / most.sum() + ANYWHERE * anywhere)


def _drawn(random: np.random.Generator, legs: Sequence[Array], likely: Array, cell: float) -> Move:
    """A random move of the legs' waypoints; ``cell`` in m."""
    paths = list(legs)
    size = cell * math.exp(random.uniform(math.log(SMALLEST), math.log(LARGEST)))
    kind = str(random.choice(list(LIKELY), p=list(LIKELY.values())))
    if likely.sum() > 0.0:
        number = int(random.choice(len(likely), p=likely / likely.sum()))
    else:
        number, kind = int(random.integers(len(likely))), "new"
    leg = 0
    while number >= len(paths[leg]):
        number -= len(paths[leg])
        leg += 1
    path, offset = paths[leg], size * random.standard_normal(2)
    if kind == "left out":
        path = np.delete(path, number, axis=0)
        shift = np.zeros_like(path)
    elif kind == "new":
        before = min(max(number - int(random.integers(2)), 0), len(path) - 2)
        share = random.uniform(*NEW_AT)
        path = np.insert(
            path, before + 1, (1.0 - share) * path[before] + share * path[before + 1], 0
        )
        shift = np.zeros_like(path)
        shift[before + 1] = offset
    else:
        shift = np.zeros_like(path)
        shift[number] = offset
        if kind == "several":
            away = (np.arange(len(path)) - number) / random.uniform(*NEIGHBOURS)
            shift = np.exp(-(away**2))[:, None] * offset
            shift[[0, -1]] = 0.0
    paths[leg] = path
    shifts = [np.zeros_like(one) for one in paths]
    shifts[leg] = shift
    return Move(paths, shifts)
