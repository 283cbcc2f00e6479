"""Yaw along a given track by exact dynamic programming, turning included.

A search over yaw as a third dimension is slow; on a given track the best yaw follows exactly. At
every waypoint the body may stand at 64 angles to the travel (forward, sideways and diagonal are
among them), at the first and last one also at the yaw that was asked for. Between waypoints it
turns evenly while driving. At a waypoint it may stop and turn on the spot, which costs the stop as
well. The power model prices every piece. Yaw angles at which the body would touch something, or
would lose its grip on the slope, are left out.

    search = YawSearch(conditions, field, track, steps, ...)
    search.best()                              # YawProfile, or the place that it does not pass
    search.best(shut=[(x, y, yaw)])            # without an angle that breaks a limit there
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.kernel_arguments import Steps
from planner.search.resolution import OBJECTIVES, STATES, WIDTH
from planner.search.trajectory.track import Track, gentle_slope
from planner.search.trajectory.yaw.free_yaws import (
    add_crab_angles,
    crowded_at,
    ends_alike,
    free_states,
    leave_out,
    leave_out_too_steep,
    state_of,
)
from planner.search.trajectory.yaw.yaw_kernel import best_states
from planner.search.trajectory.yaw.yaw_moves import (
    MOST_SAMPLES,
    Pieces,
    Surroundings,
    Waypoints,
    pieces_of,
    steady_costs_of,
    turn_to_what_holds,
)
from planner.search.turns import spin_costs, turning

STEEP, SPARSE = 0.9, 0.5
"""Share of the slope limit above which every sample is a waypoint of the yaw, where waypoints lie
more than so many cells, and two samples, apart: few angles can be driven there, and other ones half
a cell on."""
CLOSEST_WAYPOINTS = 0.2
"""m between two waypoints at least where there is room."""


@dataclass(frozen=True)
class YawProfile:
    """Yaw at every sample of a track.

    Attributes:
        arriving: (n,) rad, yaw with which a sample is reached.
        leaving: (n,) rad, yaw after turning there on the spot; equal to ``arriving`` elsewhere.
        cost: the minimum found.
    """

    arriving: Array
    leaving: Array
    cost: float

    def towards(self, other: YawProfile, share: Array) -> YawProfile:
        """This one turned by ``share`` (n,) of what another one differs by; exactly so where 1."""
        arriving = self.arriving + share * (other.arriving - self.arriving)
        leaving = self.leaving + share * (other.leaving - self.leaving)
        whole = share >= 1.0
        return YawProfile(
            np.where(whole, other.arriving, arriving),
            np.where(whole, other.leaving, leaving),
            self.cost,
        )


class YawSearch:
    """Looks for the best yaw along a track, and again where an angle breaks a limit.

    Which moves cost how much is known from before then.

    Attributes:
        pieces: between the places at which the yaw is decided, with the prices that are known.
    """

    def __init__(
        self,
        conditions: OperatingConditions,
        field: CostField,
        track: Track,
        steps: Steps,
        *,
        start_yaw: float | None,
        goal_yaw: float | None,
        beside: int,
        most_waypoints: int,
    ) -> None:
        """What does not change from one search to the next.

        Args:
            conditions: model and conditions.
            field: map and costs, for the free yaw angles.
            track: samples of the path.
            steps: between them.
            start_yaw, goal_yaw: rad; None leaves them free.
            beside: angles to either side of the best ones that the power model prices as well.
            most_waypoints: places at most at which yaw is decided, where there is room.
        """
        self._conditions, self._field, self._track, self._steps = conditions, field, track, steps
        self._beside = beside
        self._start_yaw, self._goal_yaw = start_yaw, goal_yaw
        self._crowded = crowded_at(field, track.points)
        steepness = np.hypot(*steps.slopes[:, 2:4].T)
        at = self._at = _chosen(field, track, steepness, self._crowded, most_waypoints)
        self._directions = _directions(track, at)
        places, after = track.points[at], np.minimum(at, len(steps.lengths) - 1)
        self._free, self._shift = free_states(field, places, self._directions, self._crowded[at])
        add_crab_angles(
            *(field, places, at, self._directions, steps),
            *(self._crowded[at], self._free, self._shift),
        )
        self._gentle = gentle_slope(field)
        stride = _stride(at, steepness, self._gentle)
        steady, spin = np.empty((len(at) - 1, STATES)), np.empty(self._free.shape)
        steady_costs_of(field, at, steps, stride, steady)
        kernel, arrays = conditions.model.limits_kernel, conditions.arrays
        (_, slopes), ground = sample_surface(field, places), steps.ground[after]
        spin_costs(
            *(
                kernel,
                arrays,
                self._directions,
                slopes,
                ground,
                OBJECTIVES["energy"],
                self._gentle,
                spin,
            )
        )
        self._waypoints = Waypoints(
            at, self._directions, stride, steady, self._free, self._shift, spin
        )
        self._last = self._free, self._shift
        self.pieces = pieces_of(self._waypoints, steps.lengths, self._crowded, arrays.limits)

    def best(self, shut: Sequence[tuple[float, float, float]] = ()) -> YawProfile | Array:
        """Best yaw, or the place (2,) beyond which no free yaw angles lead.

        Args:
            shut: x, y and yaw with which the body is not to pass there, nor with angles near it.
        """
        at, directions, places = self._at, self._directions, self._track.points[self._at]
        free, shift = self._last = self._held(shut)
        cost, states = self._through(free, shift, 0)
        if not math.isfinite(cost):
            return np.asarray(places[max(states[0], 0)])
        before, after = directions + WIDTH * states[0::2], directions + WIDTH * states[1::2]
        row = np.arange(len(at))
        before += shift[row, states[0::2]]
        after += shift[row, states[1::2]]
        if self._start_yaw is not None:
            before[0] = self._start_yaw
            if states[0] == states[1]:
                after[0] = self._start_yaw
        if self._goal_yaw is not None:
            after[-1] = self._goal_yaw
            if states[-2] == states[-1]:
                before[-1] = self._goal_yaw
        return _at_samples(self._track, at, before, after, cost)

    def ends(self, first: Array, most: int) -> list[Array]:
        """Places (2,), ``most`` at most, beyond which no yaw leads: past each, it is free again.

        Args:
            first: of these places, from ``best``, whose free angles count here as well.
            most: places.
        """
        free, shift = self._last
        places, found = self._track.points[self._at], [first]
        begin, last = 1 + int(np.hypot(*(places - first).T).argmin()), len(places) - 1
        while len(found) < most:
            # Where no yaw is free at all, it is still the same place.
            begin += int(free[begin:].any(axis=1).argmax()) if begin < last else 0
            if begin >= last:
                break
            cost, states = self._through(free, shift, begin)
            if math.isfinite(cost) or states[0] < 0:
                break
            found.append(places[begin + states[0]])
            begin += 1 + int(states[0])
        return found

    def _asked(self) -> list[tuple[int, int]]:
        """Waypoints, from the start or the goal, at which a yaw is asked for, and its state."""
        ends = (0, self._start_yaw), (-1, self._goal_yaw)
        return [(row, state_of(yaw, self._directions[row])) for row, yaw in ends if yaw is not None]

    def _held(self, shut: Sequence[tuple[float, float, float]]) -> tuple[NDArray[np.bool_], Array]:
        """(waypoints, STATES) which states are free, and by how much they are turned, rad."""
        field, track, steps = self._field, self._track, self._steps
        at, directions, places = self._at, self._directions, track.points[self._at]
        free, shift = self._free.copy(), self._shift.copy()
        if shut:
            leave_out(shut, places, directions, float(track.lengths.max()), ends_alike(field), free)
        asked = self._asked()
        fits = [free[place] for place in asked]
        leave_out_too_steep(field, at, directions, steps, self._gentle, free)
        for place, fit in zip(asked, fits, strict=True):
            free[place] = fit
        turn_to_what_holds(
            *(self._conditions.model.limits_kernel, self._conditions.arrays, field.limit),
            *(at, directions, steps),
            *(free & ~self._crowded[at][:, None], shift),
        )
        return free, shift

    def _through(
        self, free: NDArray[np.bool_], shift: Array, begin: int
    ) -> tuple[float, NDArray[np.int64]]:
        """Cost and states of the best yaw from waypoint ``begin`` on, as ``best_states`` has them.

        Beyond the first waypoint it begins with any yaw.
        """
        conditions, field, track = self._conditions, self._field, self._track
        waypoints = self._waypoints._replace(free=free, shift=shift)
        rest = Waypoints._make(one[begin:] for one in waypoints)
        states = np.full(2 * len(rest.at), -1, np.int64)
        wanted = dict(self._asked())
        cost = best_states(
            conditions.model.limits_kernel,
            conditions.arrays,
            Surroundings(field.blocked, field.body_frame(), track.points, self._crowded),
            self._steps,
            rest,
            Pieces._make(one[begin:] for one in self.pieces),
            turning(conditions, OBJECTIVES["energy"]),
            wanted.get(0, -1) if begin == 0 else -1,
            wanted.get(-1, -1),
            self._beside,
            states,
        )
        return float(cost), states


def _chosen(
    field: CostField,
    track: Track,
    steepness: Array,
    crowded: NDArray[np.bool_],
    most_waypoints: int,
) -> NDArray[np.int64]:
    """Samples of the track at which the yaw is decided."""
    spacing = max(CLOSEST_WAYPOINTS, float(track.lengths.sum()) / most_waypoints)
    needed = track.stops | crowded
    apart = 2.0 * float(track.lengths.max())
    if spacing > apart:
        # Between two waypoints the yaw turns evenly, and a bend in their midst has it to one side.
        bends = track.curvatures != 0.0
        needed[1:-1] |= bends[1:] != bends[:-1]
    if spacing > max(SPARSE * min(field.dx, field.dy), apart):
        steep = steepness > STEEP * float(field.limit.min())
        needed[1:] |= steep
        needed[:-1] |= steep
    return waypoints_along(np.append(0.0, np.cumsum(track.lengths)), spacing, needed)


def _stride(at: NDArray[np.int64], steepness: Array, gentle: float) -> NDArray[np.int64]:
    """Where waypoints lie far apart on gentle ground, a few steps stand for all between them."""
    count = np.maximum(1, np.diff(at) // MOST_SAMPLES)
    return np.where(np.maximum.reduceat(steepness, at[:-1]) < gentle, count, 1)


def waypoints_along(along: Array, spacing: float, needed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Samples at least ``spacing`` m apart, those that are ``needed`` (n,), and both ends.

    ``along`` (n,) is how far along the track each sample is, m.
    """
    chosen, last = [0], float(along[0])
    # Of lists, since numbers of arrays are made one by one.
    for k, (here, needs) in enumerate(zip(along.tolist(), needed.tolist(), strict=True)):
        if needs or here - last >= spacing:
            chosen.append(k)
            last = here
    return np.unique([*chosen, len(along) - 1])


def _directions(track: Track, at: NDArray[np.int64]) -> Array:
    """Direction of travel at waypoints: between that of the step before and the step after."""
    before = track.directions[np.maximum(at - 1, 0)]
    after = track.directions[np.minimum(at, len(track.directions) - 1)]
    turn = np.remainder(after - before + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(before + 0.5 * turn)


def _at_samples(
    track: Track, at: NDArray[np.int64], before: Array, after: Array, cost: float
) -> YawProfile:
    """Yaw at all samples, even in distance between the waypoints and without jumps of 2π."""
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    spins = _turned(after - before)
    turns = _turned(before[1:] - after[:-1])
    yaws = before[0] + np.concatenate([[0.0], np.cumsum(spins[:-1] + turns)])
    # Every sample but the first belongs to the waypoint before it.
    k = np.searchsorted(at, np.arange(1, len(along))) - 1
    share = (along[1:] - along[at[k]]) / (along[at[k + 1]] - along[at[k]])
    arriving = np.append(yaws[0], (yaws + spins)[k] + turns[k] * share)
    leaving = arriving.copy()
    leaving[at] = yaws + spins
    return YawProfile(arriving, leaving, cost)


def _turned(angles: Array) -> Array:
    """The shorter way round, between -π and π."""
    return np.asarray(angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi)))
