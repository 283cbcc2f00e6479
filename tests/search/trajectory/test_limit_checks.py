"""On ground as steep as a robot can drive, an answer keeps to all limits between its poses too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.arrays import Array
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.trajectory import Motion, motion_rows, move
from planner.search.trajectory.limit_checks import (
    ALONG,
    Broken,
    Kept,
    coarse_pieces,
    ease,
    fine_pieces,
    rows_on_arcs,
)
from planner.search.trajectory.limit_checks import broken_limits as broken_along
from planner.search.trajectory.track import Track, lay_track
from tests.benchmarks.peers.case import case_of
from tests.benchmarks.peers.limits import broken_limits
from tests.search.maps import hills, terrain

MUCH = 9.0
"""m/s and m/s², more than the robot can."""
ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 19.0}}


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_an_answer_on_steep_relief_keeps_to_all_limits(seed: int) -> None:
    """Looked at from its poses, ten times a cell, with rates by differences."""
    case = case_of("test", ASKED, terrain(hills(rms_degrees=11.0, seed=seed)))
    answer = plan_route(terrain=case.situation.ground.terrain, **ASKED)
    assert answer.status == "ok"
    assert broken_limits(case, answer.routes[0]) == {}


@pytest.mark.parametrize("seed", range(4))
def test_a_close_look_where_a_limit_is_near_finds_all_that_one_everywhere_does(seed: int) -> None:
    """Limits are set between what coarse and what fine samples reach: only a close look tells."""
    relief = terrain(hills(rms_degrees=(3.0, 7.0)[seed % 2], seed=seed))
    situation = case_of("test", ASKED, relief).situation
    field, conditions = situation.field("energy"), situation.conditions
    path = np.array([[3.0, 4.0], [11.0 + seed, 12.0 - seed], [20.0, 19.0]])
    motion = move(field, conditions, [path], [None, None], checked=False)
    assert isinstance(motion, Motion)

    def reached(pieces, *, on_arcs=False):
        rows, _, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
        if on_arcs:
            bends, bent = rows_on_arcs(field, conditions, motion, pieces)
            rows, owner = np.concatenate([rows, bends]), np.concatenate([owner, bent])
        moving = np.hypot(np.diff(motion.x), np.diff(motion.y))[owner] > 1e-9
        return conditions.model.power_and_limits(rows)[moving], owner[moving]

    coarse, _ = reached(coarse_pieces(field, motion))
    fine, owner = reached(fine_pieces(field, motion), on_arcs=True)
    for column, number in (("current", 1), ("voltage", 2), ("torque", 3)):
        column_of_results = {"current": 2, "voltage": 3, "torque": 4}[column]
        most, seen = fine[:, column_of_results].max(), coarse[:, column_of_results].max()
        assert most > seen
        limits = np.full(len(conditions.limits), 1e6)
        limits[[0, 4]] = conditions.limits[[0, 4]]
        limits[number] = 0.5 * (most + seen)
        stricter = replace(conditions, limits=limits)
        assert not broken_along(field, stricter, motion)
        found = broken_along(field, stricter, motion, finely=True)
        beyond = owner[fine[:, column_of_results] > limits[number]]
        assert {*found.steps.tolist()} == {*beyond.tolist()} != set()


def straight(rise: float) -> tuple[CostField, OperatingConditions, Motion, Array]:
    """Six metres straight up a slope, and its rows; limits are not looked at."""
    asked = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 9.0, "y": 4.0}}
    path = np.array([[3.0, 4.0], [9.0, 4.0]])
    x = 0.25 * np.tile(np.arange(60.0), (60, 1))
    situation = case_of("test", asked, terrain(rise * x)).situation
    field, conditions = situation.field("energy"), situation.conditions
    motion = move(field, conditions, [path], [0.0, 0.0], checked=False)
    assert isinstance(motion, Motion)
    pieces = coarse_pieces(field, motion)
    rows, _, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
    return field, conditions, motion, rows


def with_peak_torque(conditions: OperatingConditions, torque: float) -> OperatingConditions:
    limits = conditions.limits.copy()
    limits[3] = torque
    return replace(conditions, limits=limits)


@pytest.mark.parametrize(("rise", "helpless"), [(0.0, False), (0.15, True)])
def test_less_speed_is_no_remedy_where_creeping_breaks_the_limit_as_well(
    rise: float, helpless: bool
) -> None:
    """On level ground acceleration takes the torque; on a slope most of it is the slope's."""
    field, conditions, motion, rows = straight(rise)
    torque = conditions.model.power_and_limits(rows)[:, 4]
    peak = 0.5 * float(np.median(torque)) if helpless else 0.9 * float(torque.max())
    broken = broken_along(field, with_peak_torque(conditions, peak), motion)
    assert broken
    assert broken.however_slow.any() == helpless
    assert broken.at(3.0, 4.0).limit == "torque peak"


def test_easing_by_what_is_kept_comes_to_the_limit() -> None:
    """On level ground torque is linear in the acceleration: so much of it, and the limit is met."""
    field, conditions, motion, rows = straight(0.0)
    torque = conditions.model.power_and_limits(rows)[:, 4]
    stricter = with_peak_torque(conditions, 0.5 * float(np.median(torque) + torque.max()))
    broken = broken_along(field, stricter, motion)
    kept = float(broken.kept.min())
    assert 0.1 < kept < 0.9
    rows[:, [INDEX[name] for name in ("ax", "ay")]] *= kept
    eased = conditions.model.power_and_limits(rows)[:, 4].max()
    assert eased == pytest.approx(stricter.limits[3], rel=0.03)


def test_where_speeding_up_breaks_a_limit_slowing_down_stays_as_hard() -> None:
    field, conditions, motion, rows = straight(0.0)
    torque = conditions.model.power_and_limits(rows)[:, 4]
    stricter = with_peak_torque(conditions, 0.5 * float(np.median(torque) + torque.max()))
    broken = broken_along(field, stricter, motion)
    speeding_up = np.diff(motion.speed)[broken.steps] > 0.0
    assert speeding_up.all()
    track = track_of(field, conditions)
    fastest, hardest = eased(broken, motion, track)
    assert hardest[:, 0].min() < 0.5 * MUCH
    assert hardest[:, 1].min() == fastest.min() == MUCH


@pytest.mark.parametrize("bend", [0.0, 4.0])
def test_what_takes_most_of_a_limit_is_eased(bend: float) -> None:
    """In a bend that is the speed, before it the acceleration."""
    field, conditions, motion, _ = straight(0.0)
    gained = np.diff(motion.speed) / np.diff(motion.time)
    step = int(np.flatnonzero(gained > 0.2 * gained.max())[-1])
    motion = replace(motion, curvatures=np.full(len(gained), bend))
    at, limit = np.array([step]), np.array([ALONG.index("traction")])
    kept = np.array([0.8])
    broken = Broken(at, limit, np.zeros(1), np.zeros(1), np.zeros(1, bool), kept, kept)
    fastest, hardest = eased(broken, motion, track_of(field, conditions))
    assert (fastest.min() < MUCH) == (bend > 0.0)
    assert (hardest.min() < MUCH) == (bend == 0.0)


def test_a_steady_speed_is_lowered_to_what_holds_at_once() -> None:
    """Drag hardly grows with a high speed: by its share, a round would follow for every level."""
    field, conditions, motion, _ = straight(0.0)
    step = len(motion.x) // 2
    assert motion.speed[step + 1] == pytest.approx(motion.speed[step], rel=1e-6)
    at, limit = np.array([step]), np.array([ALONG.index("traction")])
    shares = np.array([0.95]), np.array([0.4])
    broken = Broken(at, limit, np.zeros(1), np.zeros(1), np.zeros(1, bool), *shares)
    fastest, hardest = eased(broken, motion, track_of(field, conditions))
    assert fastest.min() == pytest.approx(0.4 * motion.speed[step], rel=1e-3)
    assert hardest.min() == MUCH


def track_of(field: CostField, conditions: OperatingConditions) -> Track:
    """The track of ``straight``."""
    limits = conditions.model.vehicle.limits
    path = np.array([[3.0, 4.0], [9.0, 4.0]])
    return lay_track(
        field, [path], spacing=0.1, speed=limits.speed, acceleration=limits.acceleration
    )


def eased(broken: Broken, motion: Motion, track: Track) -> tuple[Array, Array]:
    """Speed and accelerations of the track's steps after easing, from MUCH of both."""
    count = len(track.lengths)
    fastest, hardest = np.full(count, MUCH), np.full((count, 2), MUCH)
    assert not len(ease(broken, motion, track, fastest, hardest))
    return fastest, hardest


def test_what_was_checked_before_is_not_looked_at_again() -> None:
    """One check serves two motions where they do the same; where not, nothing is missed."""
    field, conditions, motion, rows = straight(0.0)
    torque = conditions.model.power_and_limits(rows)[:, 4]
    middle = float(np.median(torque))
    stricter = with_peak_torque(conditions, 0.5 * (middle + float(torque.max())))
    steady = replace(motion, speed=np.full(len(motion.x), float(motion.speed.max())))
    even = np.hypot(np.diff(motion.x), np.diff(motion.y)) / steady.speed[1:]
    steady = replace(steady, time=np.append(0.0, np.cumsum(even)))
    nothing = broken_along(field, stricter, steady, finely=True)
    assert not nothing
    known = Kept.by(steady, nothing)
    whole = broken_along(field, stricter, motion, finely=True)
    assert {*whole.steps.tolist()} == {
        *broken_along(field, stricter, motion, finely=True, kept=known).steps.tolist()
    }
    assert whole
    # What breaks a limit is looked at again, though it is the same.
    again = broken_along(field, stricter, motion, finely=True, kept=Kept.by(motion, whole))
    assert {*again.steps.tolist()} == {*whole.steps.tolist()}
    seen = Kept.by(motion, whole).on(motion)
    assert seen.any()
    assert not seen[whole.steps].any()
