"""The speed profile works out only what changed since the round or the profile before."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.resolution import CREEP, MORE_LEVELS
from planner.search.results import energy_of
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import assemble
from planner.search.trajectory.speed_estimate import REACH, levels, reach_of
from planner.search.trajectory.speed_profile import KnownStretch, relax, speed_profile
from planner.search.trajectory.track import Track, lay_track, steps_of
from planner.search.trajectory.yaw import YawProfile
from tests.benchmarks.peers.case import case_of
from tests.search.maps import hills, terrain


@pytest.mark.parametrize("seed", range(4))
def test_a_round_of_speeds_leaves_out_only_what_does_not_change(seed: int) -> None:
    random = np.random.default_rng(seed)
    steps, count, reach = 120, 24, 9
    expected = random.uniform(1.0, 2.0, (steps, count, 2 * reach + 1))
    expected[random.random(expected.shape) < 0.3] = np.inf
    exact = random.random(expected.shape) < 0.5
    cost, came = np.zeros((steps + 1, count)), np.zeros((steps + 1, count), np.int64)
    cost[0, 1:] = np.inf
    relax(expected, exact, False, np.ones(steps, bool), cost, came)
    fresh = np.zeros(steps, bool)
    fresh[[17, 60, 61]] = True
    expected[fresh] += random.uniform(0.0, 0.5, expected[fresh].shape)
    whole, origins = cost.copy(), came.copy()
    relax(expected, exact, False, np.ones(steps, bool), whole, origins)
    assert not np.array_equal(came, origins), "nothing is tested"
    relax(expected, exact, False, fresh, cost, came)
    np.testing.assert_allclose(cost, whole, atol=1e-8)
    np.testing.assert_array_equal(came, origins)


@pytest.mark.parametrize("top", [0.3, 1.2, 5.0])
@pytest.mark.parametrize("longest", [0.02, 0.1, 0.4])
def test_no_possible_change_of_speed_is_out_of_reach(top: float, longest: float) -> None:
    acceleration, count = 0.8, MORE_LEVELS
    squared = levels(top, count) ** 2
    possible = np.abs(squared[:, None] - squared) <= 2.0 * acceleration * longest
    away = np.abs(np.arange(count)[:, None] - np.arange(count))
    most = int(away[possible].max())
    reach = reach_of(top, count, longest, acceleration)
    assert reach >= min(most, round(REACH * (count - len(CREEP))))
    assert reach <= most + len(CREEP)


def test_lower_limits_lead_to_the_same_speeds_from_known_costs_as_from_none() -> None:
    asked = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 12.0}}
    situation = case_of("test", asked, terrain(hills(96, rms_degrees=5.0))).situation
    field, conditions = situation.field("energy"), situation.conditions
    limits = conditions.model.vehicle.limits
    track = lay_track(
        field,
        [np.array([[3.0, 4.0], [11.0, 6.0], [20.0, 12.0]])],
        spacing=0.25,
        speed=limits.speed,
        acceleration=limits.acceleration,
    )
    yaw = np.append(track.directions, track.directions[-1])
    profile, steps = YawProfile(yaw, yaw, 0.0), steps_of(field, track)
    count = len(track.lengths)
    fastest, hardest = np.full(count, limits.speed), np.full((count, 2), limits.acceleration)
    known: list[KnownStretch] = []
    rest = conditions, track, profile, steps, 3, MORE_LEVELS

    def joules(speeds) -> float:
        motion = assemble(field, track, profile, speeds, yaw_rate=limits.yaw_rate, spacing=0.25)
        return energy_of(field, conditions, motion)

    first, _ = speed_profile(*rest, fastest, hardest, known)
    slow = slice(count // 3, count // 2)
    fastest[slow] = 0.4 * float(first[slow].min())
    hardest[2 * count // 3 :] *= 0.5
    again, _ = speed_profile(*rest, fastest, hardest, known)
    anew, _ = speed_profile(*rest, fastest, hardest)
    most = fastest * (1.0 + 1e-6)
    assert (again[:-1] <= most).all()
    assert (again[1:] <= most).all()
    assert joules(anew) > 1.005 * joules(first), "the lower limits cost nothing"
    assert joules(again) == pytest.approx(joules(anew), rel=1e-3)


def test_a_robot_at_rest_begins_to_turn_as_slowly_as_it_begins_to_drive() -> None:
    """Yaw goes with the distance. Across a slope it turns while it drives, slowly enough.

    Loaded so that the torque limits it, no wheel has to change its direction on this bend. On one
    more than twice as tight some wheels do, and that breaks the limit.
    """
    slope, tight, step = 0.1, 1.5, 0.15
    relief = terrain(np.tile(slope * 0.25 * np.arange(40.0)[:, None], (1, 40)))
    asked = {"start": {"x": 2.0, "y": 5.0}, "goal": {"x": 6.0, "y": 5.0}, "payload": {"mass": 28.0}}
    situation = case_of("test", asked, relief).situation
    field, conditions = situation.field("energy"), situation.conditions
    limits = conditions.model.vehicle.limits
    nothing = np.zeros(2)
    points = np.column_stack([4.0 + step * np.arange(3.0), np.full(3, 5.0)])
    stops = np.array([True, False, True])
    track = Track(points, nothing, np.full(2, step), nothing, stops, (0, 2))
    yaw = 0.5 + tight * step * np.arange(3.0)
    profile, steps = YawProfile(yaw, yaw, 0.0), steps_of(field, track)
    fastest, hardest = np.full(2, limits.speed), np.full((2, 2), limits.acceleration)
    rest = conditions, track, profile, steps, 3, MORE_LEVELS, fastest, hardest
    speeds, _ = speed_profile(*rest)
    assert speeds is not None
    motion = assemble(field, track, profile, speeds, yaw_rate=limits.yaw_rate, spacing=0.25)
    assert not broken_limits(field, conditions, motion, finely=True)
    turned = yaw[0] + 2.2 * (yaw - yaw[0])
    tighter = YawProfile(turned, turned, 0.0)
    assert speed_profile(*rest[:2], tighter, *rest[3:])[0] is None
