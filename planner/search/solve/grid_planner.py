"""A route by the grid alone: least-cost paths, and the trajectory near them.

attempt = on_grid(run, run.field("energy"), "energy")
attempt.route            # or None, with attempt.reason
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.search.field import CostField, polyline_cost
from planner.search.limit_places import Infeasible
from planner.search.run import Run
from planner.search.situation import not_driven
from planner.search.solve.alternatives import nearness
from planner.search.solve.corridors import corridors, worth_looking
from planner.search.solve.grid_paths import leg_paths, why_not
from planner.search.solve.narrow_passages import through_passages
from planner.search.solve.pipeline import Attempt, cheapest_near, finished
from planner.search.solve.recovery.caution import (
    FEW_SLOPE_MARGINS,
    SLOPE_MARGINS,
    Caution,
    first_caution,
    more_clearance,
    next_caution,
)
from planner.search.solve.recovery.steep_ground import (
    FIRST,
    FOR_A_BUDGET,
    PoseSearch,
    leg_poses,
    straight_up,
)
from planner.search.solve.recovery.torque_limits import (
    near_torque_limits,
    or_gentler,
    with_other_torque,
)
from planner.search.solve.sketch import (
    ANSWER,
    BASELINE,
    ONE_OF_MANY,
    PATIENT_BASELINE,
    Closely,
    Effort,
    Sketch,
    sketch,
)
from planner.search.trajectory import Motion
from planner.search.waypoints import suggests_detour

DETOURS, DETOUR_PENALTY = 2, 0.1
"""Searches for another homotopy class where bends cost much, and the share by which ground near
the best route costs more in each."""
LEAST_TURN = 1e-6
"""rad, and share of the length, up to which a motion is straight: more than rounding, less than any
turn that costs something."""
MISSED = 0.01
"""Share of a route's energy by which one that cannot be driven was cheaper, from which poses are
searched as well."""
MUCH_TURNING = 1.1
"""Energy over that of even driving from which paths with more room are tried as well."""


def on_grid(run: Run, field: CostField, objective: str, effort: Effort = ANSWER) -> Attempt:
    """Search the grid; where no trajectory comes of it, search more cautiously.

    Args:
        run, field: the request, and map and costs.
        objective: "energy", "time" or "length".
        effort: BASELINE keeps to the same limits, but yaw and speed may be a few parts in ten
            thousand off the best.
    """
    if effort is PATIENT_BASELINE:
        # Recovery in small steps takes longer, and may end in a longer route.
        quick = on_grid(run, field, objective, BASELINE)
        if quick.route is not None:
            return quick
    passages: Callable[[], Attempt | None] | None = None
    if effort.closely:
        part = partial(_on_grid, field=field, objective=objective, effort=ONE_OF_MANY)
        passages = partial(through_passages, run, field, objective, part)
    attempt = _on_grid(run, field, objective, effort, passages)
    other = None if attempt.route is not None else with_other_torque(run, attempt, effort)
    if other is not None:
        costs = other.field(objective, field.margin, field.factor)
        found = _on_grid(other, costs, objective, effort)
        attempt = attempt if found.route is None else found
    margins = SLOPE_MARGINS if effort.patient else FEW_SLOPE_MARGINS[objective]
    if len(margins) > 1 and near_torque_limits(run, field, attempt, objective):
        attempt = or_gentler(run, field, attempt, objective, effort, margins[1:])
    # Nobody asks why there is no baseline.
    if attempt.route is None and not attempt.reason and effort.closely:
        cause = why_not(run, attempt.field, objective)
        return replace(attempt, reason=cause.what, infeasible=cause)
    if attempt.route is None and attempt.infeasible is not None and effort.closely:
        cause = not_driven(run.conditions, attempt.field, attempt.infeasible)
        return replace(attempt, reason=cause.what, infeasible=cause)
    return attempt


def _on_grid(
    run: Run,
    field: CostField,
    objective: str,
    effort: Effort,
    passages: Callable[[], Attempt | None] | None = None,
) -> Attempt:
    """The best of all attempts within the limits that hold at every moment, and the mean torque."""
    caution: Caution | None = first_caution(run, field, objective, patient=effort.patient)
    sketching = _Sketching(
        *(run, objective, effort, effort.patient, field, passages), Closely(objective)
    )
    first: Attempt | None = None
    while caution is not None:
        sketches, caution = sketching.with_caution(caution)
        if sketching.passed is not None:
            return sketching.passed
        if not sketches:
            break
        attempt = finished(run, sketches, objective, effort, sketching.closely)
        if attempt.route is not None:
            best = attempt
            if attempt.missed >= MISSED:
                with run.within_budget() as limited:
                    sketching.run = limited
                    best = _cheaper(best, sketching.straight_up(caution, attempt) or best)
            return best
        if first is None:
            # What stops the path of least cost says more than what stops a way round it.
            first = attempt
            by_poses = sketching.straight_up(caution, attempt)
            if by_poses is not None:
                return _or_cheaper(run, field, sketching, caution, attempt, by_poses)
            if sketching.searched:
                # Poses know slopes better than a share of the limit that holds everywhere.
                caution = replace(caution, slope_margins=caution.slope_margins[:1])
        caution = next_caution(caution, attempt)
    if first is None:
        return Attempt(sketching.field)
    found = sketching.at_last(field, first)
    return found or replace(first, too_warm=sketching.closely.too_warm)


def _or_cheaper(
    run: Run,
    field: CostField,
    sketching: _Sketching,
    caution: Caution,
    attempt: Attempt,
    by_poses: Attempt,
) -> Attempt:
    """A route by poses, or what recovery finds next, where that costs less.

    Recovery goes on while time is left, and the metres of its paths cost less than the route. It
    leaves the slope limit alone: what keeps to gentler slopes hardly ever costs less.
    """
    with run.within_budget() as limited:
        sketching.run = limited
        while attempt.metres(field) < by_poses.spent(run, "energy"):
            following = next_caution(caution, attempt)
            if following is None or following.slope_margins != caution.slope_margins:
                break
            sketches, caution = sketching.with_caution(following)
            if not sketches:
                break
            attempt = finished(
                *(limited, sketches, sketching.objective, sketching.effort, sketching.closely)
            )
            if attempt.route is not None:
                return _cheaper(attempt, by_poses)
    return by_poses


def _cheaper(*attempts: Attempt) -> Attempt:
    """The attempt whose route takes least energy."""
    return min(attempts, key=lambda one: one.value("energy"))


@dataclass
class _Sketching:
    """Sketches for one request, the cheap ones first: paths, detours, more room, and last poses.

    Attributes:
        run, objective, effort: as for ``on_grid``.
        poses_left: whether poses may still be searched.
        field: map and costs of the latest search.
        passages: looks for a way through narrow passages; None after it did, or where none is
            wanted.
        closely: drives legs, and knows those that come up again.
        passed: what was found through narrow passages.
        searched: whether poses were searched on steep ground.
    """

    run: Run
    objective: str
    effort: Effort
    poses_left: bool
    field: CostField
    passages: Callable[[], Attempt | None] | None
    closely: Closely
    passed: Attempt | None = None
    searched: bool = False

    def with_caution(self, caution: Caution) -> tuple[list[Sketch], Caution]:
        """All sketches to choose among, and the caution that the last of them came from.

        Where the body lacks room or turns much, paths with more clearance are tried as long as
        they get cheaper. Poses are searched where that was of no use.
        """
        found: list[tuple[Sketch, Caution]] = []
        with self.run.within_budget() as limited:
            for latest in self._sketches(caution, limited):
                found.append(latest)
        return [one for one, _ in found], found[-1][1] if found else caution

    def _sketches(self, caution: Caution, limited: Run) -> Iterator[tuple[Sketch, Caution]]:
        """As ``with_caution``; whatever follows one that moves is done in ``limited``."""
        run, objective = self.run, self.objective
        plain = caution.unobstructed_field(run, objective)
        best: Sketch | None = None
        while True:
            self.field = caution.field(run, objective)
            paths = leg_paths(run, self.field, objective)
            if paths is None:
                if best is None and self._passes():
                    return
                break
            latest = sketch(run, self.field, paths, objective, self.effort, plain=plain)
            refused = latest.infeasible
            if refused is not None and refused.for_want_of_room and self._passes():
                return
            yield latest, caution
            improved = best is None or latest.energy < best.energy
            if best is None or improved:
                best = latest
            if not (improved or latest.best is None) or not self._wants_room(best, plain):
                break
            wider = more_clearance(caution, Attempt(plain, infeasible=latest.infeasible))
            if wider is None:
                break
            caution, run = wider, run if best.best is None else limited
        if best is None:
            return
        if objective == "energy":
            for latest in itertools.chain(
                self._corridors(limited, best), self._detours(limited, best)
            ):
                yield latest, caution
        # Beside a path that moves, poses take long and hardly ever save anything.
        if self.poses_left and best.best is None and self._wants_room(best, plain):
            self.poses_left = False
            for latest in self._by_poses(plain):
                yield latest, caution

    def _passes(self) -> bool:
        """Whether there is a route through narrow passages; it is looked for once."""
        if self.passages is not None:
            self.passed, self.passages = self.passages(), None
        return self.passed is not None

    def _wants_room(self, best: Sketch, field: CostField) -> bool:
        """Whether paths with more room, or poses, may do better among obstacles."""
        if best.infeasible is not None:
            return best.infeasible.for_want_of_room
        if best.best is None or self.objective != "energy" or not self.run.ground.blocked.any():
            return False
        if _straight_on(best.best.motion):
            return False
        # Turns and ramps are not in the costs of the search.
        metres = sum(polyline_cost(field, path, field.step) for path, _ in best.best.legs)
        return best.best.dissipated > MUCH_TURNING * metres

    def _corridors(self, run: Run, best: Sketch) -> Iterator[Sketch]:
        """Sketches of other paths that may cost less once they are smoothed, on coarse maps."""
        if best.best is None or not worth_looking(run, best.field):
            return
        metres = sum(polyline_cost(best.field, path, best.field.step) for path, _ in best.best.legs)
        for path in corridors(run, best.field, best.paths[0], metres):
            yield sketch(run, best.field, [path], "energy")

    def _detours(self, run: Run, best: Sketch) -> Iterator[Sketch]:
        """Sketches of paths beside the best one, while its bends cost much and they get cheaper.

        Not on large maps, where a search with costs of its own for every node takes long, and not
        where slopes last: beside such cells, bends cost next to nothing.
        """
        field = best.field
        factor = field.factor
        known = [best.paths]
        lasting = run.conditions.lasting
        for _ in range(
            0 if run.situation.large or lasting or run.ground.blocked.any() else DETOURS
        ):
            driven = best.best
            if driven is None or not isinstance(driven.motion, Motion):
                break
            metres = sum(cost for _, cost in driven.legs)
            if not suggests_detour(run.conditions, driven.dissipated, metres):
                break
            near = nearness((driven.motion.x, driven.motion.y), field)
            factor = factor * (1.0 + DETOUR_PENALTY * near)
            paths = leg_paths(run, run.field("energy", field.margin, factor), "energy")
            if paths is not None and not any(_same(paths, other) for other in known):
                known.append(paths)
                latest = sketch(run, field, paths, "energy")
                yield latest
                if latest.energy >= best.energy:
                    break
                best = latest

    def _by_poses(self, field: CostField) -> Iterator[Sketch]:
        """What a search with the yaw in it comes to: one sketch or none."""
        poses = leg_poses(self.run, field, self.objective)
        if poses is not None:
            polylines = [path.polyline for path in poses]
            yield sketch(self.run, field, polylines, self.objective, self.effort, poses=poses)

    def straight_up(self, caution: Caution, refused: Attempt) -> Attempt | None:
        """A route by poses, where it is no want of room that refuses the path of least cost."""
        infeasible = refused.infeasible
        if not self.poses_left or infeasible is None or infeasible.too_warm:
            return None
        field = caution.unobstructed_field(self.run, self.objective)
        return self._straight_up(field, infeasible, FIRST)

    def at_last(self, field: CostField, refused: Attempt) -> Attempt | None:
        """A route by poses where all else failed; searched for while a time budget lasts."""
        assert refused.infeasible is not None  # it has no route
        found = None
        if not self.searched:
            found = self._straight_up(field, refused.infeasible, FIRST)
        if found is None and math.isfinite(self.run.seconds_left):
            with self.run.within_budget() as self.run:
                found = self._straight_up(field, refused.infeasible, FOR_A_BUDGET)
        return found

    def _straight_up(
        self, field: CostField, refused: Infeasible, searches: Iterable[PoseSearch]
    ) -> Attempt | None:
        """A route by poses for an answer; none where a robot turns within a part of a cell."""
        if refused.for_want_of_room or not self.effort.closely or self.objective != "energy":
            return None
        if self.run.conditions.lasting or not self.effort.patient:
            return None
        self.poses_left, self.searched = False, True
        return straight_up(self.run, field, self.objective, self.effort, self.closely, searches)


def _same(paths: Sequence[Array], others: Sequence[Array]) -> bool:
    """Whether the legs of two paths are the same."""
    return all(np.array_equal(one, other) for one, other in zip(paths, others, strict=True))


def _straight_on(motion: Motion | Infeasible) -> bool:
    """Whether a motion neither bends nor turns: then room would save nothing."""
    if not isinstance(motion, Motion) or float(np.ptp(motion.yaw)) > LEAST_TURN:
        return False
    length = np.hypot(np.diff(motion.x), np.diff(motion.y)).sum()
    return bool(
        length <= (1.0 + LEAST_TURN) * math.dist(*np.column_stack([motion.x, motion.y])[[0, -1]])
    )


def near_path_of(run: Run, field: CostField, factor: Array, objective: str) -> Attempt:
    """What the path of other costs comes to with the field's own.

    ``factor`` is (ny, nx), on the costs of a metre for the search alone.
    """
    paths = leg_paths(run, run.field(objective, field.margin, factor), objective)
    if paths is None:
        return Attempt(field)
    return cheapest_near(run, field, paths, objective, ONE_OF_MANY)
