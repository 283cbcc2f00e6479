"""The best speeds along a track within all limits, for one yaw profile after another.

    search = SpeedSearch(field, conditions, track, steps, beside=3, levels=44, ...)
    motion = search.along(yaw)              # Motion, or Infeasible that says where
    finer = search.along(turned)            # quick where few steps changed

Limits are looked for between the samples as well. Where one is broken, speed or acceleration is
eased there, and the speeds are found anew. Refinement turns the body on some of the steps. On the
others, costs and what was eased are those of the yaw profile before.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import Steps
from planner.search.limit_places import Infeasible
from planner.search.trajectory.limit_checks import Kept, broken_limits, ease, with_neighbours
from planner.search.trajectory.motion import Motion, assemble
from planner.search.trajectory.speed_profile import KnownStretch, speed_profile
from planner.search.trajectory.track import Track
from planner.search.trajectory.turn_on_the_spot import pose_spacing
from planner.search.trajectory.yaw import YawProfile

MOST_SPEED_PROFILES = 12
"""Speed profiles until no limit is broken between samples either."""


class SpeedSearch:
    """Speeds along one track.

    Args:
        field, conditions: map, model and conditions.
        track, steps: samples of the path, and the steps between.
        beside, levels: of speed, priced beside the best ones, and in all at most.
        checked: whether limits are checked between samples too.
        check: called between profiles; may raise to stop.
    """

    def __init__(
        self,
        field: CostField,
        conditions: OperatingConditions,
        track: Track,
        steps: Steps,
        *,
        beside: int,
        levels: int,
        checked: bool,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        self.field, self.conditions, self.track, self.steps = field, conditions, track, steps
        self.beside, self.levels = beside, levels
        self.checked, self.check = checked, check
        self._kept: Kept | None = None
        self._broken_at = -1
        self._forget()

    def along(self, yaw: YawProfile) -> Motion | Infeasible:
        """The best motion with a yaw profile, or where a limit is in the way of it."""
        known = self._yaw is not None
        found = self._along(yaw, self._changed(yaw))
        if found is None and known:
            # What was eased for another yaw profile may be in the way.
            self._forget()
            found = self._along(yaw, self._changed(yaw))
        if found is None:
            self._forget()
            x, y = self.track.points[self._broken_at]
            return Infeasible(float(x), float(y), "no speed keeps to all limits")
        return found

    def _forget(self) -> None:
        """Lift what was eased, and forget the costs."""
        limits, count = self.conditions.model.vehicle.limits, len(self.track.lengths)
        self._fastest = np.full(count, limits.speed)
        self._hardest = np.full((count, 2), limits.acceleration)
        self._known: list[KnownStretch] = []
        self._yaw: YawProfile | None = None

    def _changed(self, yaw: YawProfile) -> NDArray[np.bool_]:
        """(steps,) where the body has another yaw than the last time, and those beside them.

        None where nothing is known yet. On these steps, nothing is eased any more.
        """
        last, self._yaw = self._yaw, yaw
        if last is None:
            return np.zeros(len(self.track.lengths), np.bool_)
        # What was eased because of one step may have been eased on those beside it.
        changed = with_neighbours(
            (yaw.leaving[:-1] != last.leaving[:-1]) | (yaw.arriving[1:] != last.arriving[1:])
        )
        limits = self.conditions.model.vehicle.limits
        self._fastest[changed], self._hardest[changed] = limits.speed, limits.acceleration
        return changed

    def _along(self, yaw: YawProfile, changed: NDArray[np.bool_]) -> Motion | Infeasible | None:
        """As ``along``; None where no speed leads further, whatever limit is in the way."""
        limits = self.conditions.model.vehicle.limits
        spacing = pose_spacing(min(self.field.dx, self.field.dy))
        for _ in range(MOST_SPEED_PROFILES):
            self.check()
            speeds, self._broken_at = speed_profile(
                *(self.conditions, self.track, yaw, self.steps, self.beside),
                *(self.levels, self._fastest, self._hardest, self._known, changed),
            )
            if speeds is None:
                return None
            changed = np.zeros_like(changed)
            motion = assemble(
                *(self.field, self.track, yaw, speeds), yaw_rate=limits.yaw_rate, spacing=spacing
            )
            if not self.checked:
                return motion
            broken = broken_limits(
                self.field, self.conditions, motion, finely=True, kept=self._kept
            )
            self._kept = Kept.by(motion, broken)
            if not broken:
                return motion
            hopeless = ease(broken, motion, self.track, self._fastest, self._hardest)
            if len(hopeless):
                places = 0.5 * (self.track.points[hopeless + 1] + self.track.points[hopeless])
                x, y = places[0]
                return broken.at(x, y, places[1:])
            x, y = motion.x[broken.steps[0]], motion.y[broken.steps[0]]
            infeasible = broken.at(x, y)
        return infeasible
