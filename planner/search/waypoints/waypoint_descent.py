"""Waypoint descent: moves the waypoints of a path while its motion gets cheaper.

    better = optimise_waypoints(field, conditions, legs, yaws)
    better.legs, better.energy

Smoothing counts metres, each with the cheapest yaw there. On bends the body cannot turn that way,
and a path a little to the side costs less. Here whole motions give the cost of a path.

Every second waypoint is moved at once, to one side and then to the other, while those between them
stay: the energy between two that stay shows what moving the one between them does. Yaw angles and
speeds stay as they are for that, since small changes of the best ones cost nothing. A parabola for
each waypoint says how far it should go; they go there together if the whole motion is cheaper so,
with its yaw angles and speeds found anew, else those that save energy beside them, else every
second one. One such search a round moves all waypoints, however many there are.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.quantities import STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, segment_cost
from planner.search.limit_places import Infeasible
from planner.search.resolution import OBJECTIVES
from planner.search.results import energy_by_step
from planner.search.trajectory import ROUGHLY, Motion, move, moved_alike
from planner.search.turns import turning
from planner.search.wanted_yaw import Wanted
from planner.search.waypoints.path_smoothing import resample

Task = Callable[[], "Driven"]
Both = Callable[[Sequence[Task]], list["Driven"]]

LARGEST_MOVE, LEAST_MOVE, MOST_REPEATS = 1.0, 0.25, 8
"""Cells by which waypoints are moved at most and at least, and rounds at most, where no steps are
given: the step stays while it pays, and halves then."""
PAYS = 0.003
"""Share of what a motion dissipates that a round has to save to be repeated."""
SCATTER = 2e-4
"""Share of what a motion dissipates that moved waypoints have to save: rough motions along one line
differ by as much with other waypoints, and a straight line on level ground must stay straight."""
WAYPOINT_SPACING = 24.0
"""Cells from one waypoint to the next at most; closer ones make bends that cost more."""
MOST_STEPS = 2.0
"""Moves by which a parabola may shift a waypoint; beyond, it extrapolates too far."""
STEP_SHARES = (1.0, 0.6)
"""Shares of what the parabolas say: neighbours that move together do more than each alone."""
SURPLUS = 0.025
"""Share that a motion dissipates over what its metres cost, from which descent is worth it."""
DETOUR_EXCESS = 0.015
"""Share over its metres, start and stop, from which other paths are worth a look: the search counts
metres with the body turned as these bends do not allow."""


@dataclass(frozen=True)
class Driven:
    """A path and its motion, roughly worked out.

    Attributes:
        legs: polylines (k, 2) from one fixed place to the next.
        motion: along them; None where there is none.
        energy: J; infinite without a motion.
        spent: (samples,) J dissipated up to each sample of the motion.
    """

    legs: tuple[Array, ...]
    motion: Motion | None = None
    energy: float = math.inf
    spent: Array | None = None

    @property
    def dissipated(self) -> float:
        """J, without what climbing stores."""
        return math.inf if self.spent is None else float(self.spent[-1])


def optimise_waypoints(
    field: CostField,
    conditions: OperatingConditions,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    *,
    steps: Iterable[float] | None = None,
    spacing: float = WAYPOINT_SPACING,
    both: Both | None = None,
    check: Callable[[], None] = lambda: None,
) -> Driven:
    """The path with its waypoints moved.

    Args:
        field, conditions, legs, yaws: as for ``planner.search.trajectory.drive.move``.
        steps: by how many cells waypoints are moved, round after round; may end whenever it likes.
            None goes on while that pays.
        spacing: cells from one waypoint to the next, at most.
        both: works out several motions, two at once where there is another core.
        check: called between motions; may raise to stop.

    Returns:
        The cheapest found, which may be the path that was given, with more waypoints.
    """
    both = both or (lambda tasks: [task() for task in tasks])
    cell = min(field.dx, field.dy)
    pieces = [resample(leg, spacing * cell) for leg in legs]
    marks = np.cumsum([0, *(len(piece) - 1 for piece in pieces)])
    waypoints = np.vstack([pieces[0][:1], *(piece[1:] for piece in pieces)])
    free = np.ones(len(waypoints), bool)
    free[marks] = False
    number = np.arange(len(waypoints))
    halves = [free & (number % 2 == 1), free & (number % 2 == 0)]

    def parted(waypoints: Array) -> tuple[Array, ...]:
        return tuple(waypoints[a : b + 1] for a, b in itertools.pairwise(marks))

    def driven(waypoints: Array) -> Driven:
        return drive_roughly(field, conditions, parted(waypoints), yaws)

    def alike(moved: Array) -> Driven:
        check()
        assert best.motion is not None
        before, after = parted(waypoints), parted(moved)
        motion = moved_alike(field, conditions, best.motion, before, after)
        return with_energy(field, conditions, after, motion)

    def seen(*moves: Array) -> list[tuple[Driven, Array]]:
        places = [where_open(field, waypoints, move) for move in moves]
        return list(zip(both([partial(alike, one) for one in places]), places, strict=True))

    best = driven(waypoints)
    if best.motion is None or not free.any():
        return best
    steps = steps or while_it_pays(lambda: best)
    for step in steps:
        across = step * cell * _normals(waypoints)
        shift = np.zeros(len(waypoints))
        here = alike(waypoints)
        for half in halves:
            aside = across * half[:, None]
            (low, left), (high, right) = seen(-aside, aside)
            beside = (low, left), (here, waypoints), (high, right)
            shift[half] = to_least(*(spent_beside(one, at, half) for one, at in beside))
        whole = across * shift[:, None]
        several = seen(*(share * whole for share in STEP_SHARES))
        # Where moves get into each other's way, those stay that pay where they are, or a half.
        kept = [paying(one, at, here, waypoints, free) - waypoints for one, at in several]
        several += seen(*kept, *(whole * half[:, None] for half in halves))
        least, places = min(several, key=lambda one: one[0].energy)
        if least.energy < here.energy:
            found = driven(places)
            if found.energy < best.energy - SCATTER * best.dissipated:
                best, waypoints = found, places
    return best


def paying(
    moved: Driven, places: Array, best: Driven, waypoints: Array, free: NDArray[np.bool_]
) -> Array:
    """Waypoints (n, 2), of which only those are moved where less is spent beside them.

    Args:
        moved, places: motion with all waypoints moved, and where these are then.
        best, waypoints: motion before, and where they were.
        free: (n,) whether a waypoint may move.
    """
    if moved.motion is None or best.motion is None:
        return waypoints
    saved = spent_by_piece(best, waypoints) - spent_by_piece(moved, places)
    pays = np.zeros(len(waypoints), bool)
    pays[1:-1] = saved[:-1] + saved[1:] > 0.0
    return np.where((pays & free)[:, None], places, waypoints)


def spent_by_piece(driven: Driven, waypoints: Array) -> Array:
    """(n - 1,) J that a motion spends from each waypoint to the next."""
    assert driven.motion is not None
    assert driven.spent is not None
    return np.diff(driven.motion.along(waypoints, driven.spent))


def while_it_pays(best: Callable[[], Driven]) -> Iterator[float]:
    """Steps in cells; ``best`` gives the best motion found by then."""
    step = LARGEST_MOVE
    for _ in range(MOST_REPEATS):
        before = best().energy
        yield step
        if before - best().energy < PAYS * best().dissipated:
            step *= 0.5
            if step < LEAST_MOVE:
                return


def worth_optimising(dissipated: float, metres: float) -> bool:
    """Whether a motion dissipates (J) enough beyond what its metres cost (J)."""
    return dissipated > (1.0 + SURPLUS) * metres


def suggests_detour(conditions: OperatingConditions, dissipated: float, metres: float) -> bool:
    """Whether bends make a motion dissipate much (J) beside its metres (J), start and stop."""
    return (
        dissipated - turning(conditions, OBJECTIVES["energy"]).stop > (1.0 + DETOUR_EXCESS) * metres
    )


def drive_roughly(
    field: CostField,
    conditions: OperatingConditions,
    legs: tuple[Array, ...],
    yaws: Sequence[Wanted],
) -> Driven:
    """The motion along a path, roughly, with what it takes."""
    motion = move(field, conditions, legs, yaws, care=ROUGHLY, checked=False)
    return with_energy(field, conditions, legs, motion)


def with_energy(
    field: CostField,
    conditions: OperatingConditions,
    legs: tuple[Array, ...],
    motion: Motion | Infeasible,
) -> Driven:
    """A path and its motion, with what it takes."""
    if isinstance(motion, Infeasible):
        return Driven(legs)
    joules = energy_by_step(field, conditions, motion)
    weight = conditions.mass * STANDARD_GRAVITY
    spent = np.append(0.0, np.cumsum(joules)) - weight * (motion.heights - motion.heights[0])
    return Driven(legs, motion, float(joules.sum()), spent)


def _normals(waypoints: Array) -> Array:
    """Unit vectors (n, 2) to the left of the line between each waypoint's neighbours."""
    along = np.empty_like(waypoints)
    along[1:-1] = waypoints[2:] - waypoints[:-2]
    along[0], along[-1] = waypoints[1] - waypoints[0], waypoints[-1] - waypoints[-2]
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-12)
    return np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]


@njit(cache=True, error_model="numpy", nogil=True)
def where_open(field: Any, waypoints: Any, shifts: Any) -> Any:
    """Waypoints (n, 2) moved by shifts (n, 2), except where a piece would become impassable."""
    count = waypoints.shape[0]
    moved = waypoints + shifts
    back = True
    while back:
        back = False
        for k in range(1, count):
            (xa, ya), (xb, yb) = moved[k - 1], moved[k]
            if (
                (xa == waypoints[k - 1, 0] and ya == waypoints[k - 1, 1])
                and (xb == waypoints[k, 0] and yb == waypoints[k, 1])
            ):  # fmt: skip
                continue
            if segment_cost(field, xa, ya, xb, yb, field.step) < np.inf:
                continue
            for n in (k - 1, k):
                if moved[n, 0] != waypoints[n, 0] or moved[n, 1] != waypoints[n, 1]:
                    moved[n, 0], moved[n, 1] = waypoints[n, 0], waypoints[n, 1]
                    back = True
    return moved


def spent_beside(driven: Driven, waypoints: Array, some: NDArray[np.bool_]) -> Array:
    """J that a motion spends from the waypoint before to the waypoint after each of ``some``."""
    if driven.motion is None or driven.spent is None:
        return np.full(int(some.sum()), np.inf)
    spent = driven.motion.along(waypoints, driven.spent)
    at = np.flatnonzero(some)
    return np.asarray(spent[at + 1] - spent[at - 1])


def to_least(low: Array, here: Array, high: Array) -> Array:
    """Where parabolas through three values, at -1, 0 and 1, are least; one side may be infinite."""
    lower = np.where(low < high, -1.0, 1.0)
    aside = np.minimum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = low + high - 2.0 * here
        vertex = np.clip(0.5 * (low - high) / bend, -MOST_STEPS, MOST_STEPS)
    hollow = np.isfinite(bend) & (bend > 0.0)
    return np.where(hollow, vertex, np.where(aside < here, lower, 0.0))
