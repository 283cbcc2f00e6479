"""The yaw along a path on steep ground is one that some speed can keep, also while it changes."""

from __future__ import annotations

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.search.trajectory import Motion, motion_rows, move
from planner.search.trajectory.limit_checks import coarse_pieces
from planner.search.trajectory.track import lay_track, steps_of
from planner.search.trajectory.yaw import YawProfile, YawSearch
from tests.benchmarks.peers.case import case_of
from tests.search.maps import hills, terrain

SLOWER = 1.0 / 6.0
"""Factor on all velocities: what breaks a limit then does so for want of another yaw."""
TABLES_OFF = 0.02
"""Share of traction by which the tables of slope limits may be off between their entries."""


@pytest.mark.parametrize(("seed", "scale"), [(4, 8.0), (7, 8.0), (7, 1.0)])
def test_no_speed_is_needed_that_the_yaw_does_not_allow(seed: int, scale: float) -> None:
    """On hills as steep as a robot can drive, of its own size and of a large map's."""
    places = np.array([[3.0, 4.0], [20.0, 19.0]]) * scale
    start, goal = ({"x": x, "y": y} for x, y in places)
    relief = terrain(scale * hills(rms_degrees=11.0, seed=seed), cell=0.25 * scale)
    situation = case_of("test", {"start": start, "goal": goal}, relief).situation
    field, conditions = situation.field("energy"), situation.conditions
    path = situation.path("energy", field, *map(tuple, places))
    motion = move(field, conditions, [path], [None, None], checked=False)
    assert isinstance(motion, Motion)
    pieces = coarse_pieces(field, motion)
    rows, _, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
    for name in ("vx", "vy", "wz"):
        rows[:, INDEX[name]] *= SLOWER
    for name in ("ax", "ay", "yaw_acceleration", "slope_rate"):
        rows[:, INDEX[name]] = 0.0
    left = conditions.model.power_and_limits(rows)[:, 5]
    assert left.min() < 0.1, "nothing is near the limit"
    assert left.min() > -TABLES_OFF
    assert (left < 0.0).mean() < 1e-3


def test_the_few_angles_that_hold_on_steep_ground_are_found() -> None:
    """They lie within less than a state; without them, two of these paths have no yaw."""
    moving = []
    for seed in range(1, 13):
        start, goal = (24.0, 32.0), (160.0, 152.0)
        asked = {
            "start": dict(zip("xy", start, strict=True)),
            "goal": dict(zip("xy", goal, strict=True)),
        }
        relief = terrain(8.0 * hills(rms_degrees=15.0, seed=seed), cell=2.0)
        situation = case_of("test", asked, relief).situation
        field, conditions = situation.field("energy"), situation.conditions
        path = situation.path("energy", field, start, goal)
        if path is not None:
            motion = move(field, conditions, [path], [None, None], checked=False)
            moving.append(isinstance(motion, Motion))
    assert len(moving) > 8
    assert all(moving)


@pytest.mark.parametrize("alike", [True, False])
def test_an_angle_that_broke_a_limit_is_left_with_its_opposite(alike: bool) -> None:
    """Where both ends of a robot keep the same limits, half a turn is no remedy; else it is one."""
    asked = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 9.0, "y": 4.0}}
    situation = case_of("test", asked, terrain(np.zeros((60, 60)))).situation
    field, conditions = situation.field("energy"), situation.conditions
    if not alike:
        yaw_limit = field.yaw_limit.copy()
        yaw_limit[:, : yaw_limit.shape[1] // 2] *= 1.1
        field = field._replace(yaw_limit=yaw_limit)
    legs = [np.array([[3.0, 4.0], [9.0, 4.0]])]
    track = lay_track(field, legs, spacing=0.1, speed=0.7, acceleration=0.5)
    settings = {"start_yaw": None, "goal_yaw": None, "beside": 1}
    settings["most_waypoints"] = 240
    steps = steps_of(field, track)
    search = YawSearch(conditions, field, track, steps, **settings)
    plain = search.best()
    assert isinstance(plain, YawProfile)
    number = int(np.hypot(*(track.points - (6.0, 4.0)).T).argmin())
    angle = float(plain.leaving[number])
    shut = [(*track.points[number], angle)]
    other = search.best(shut)
    assert isinstance(other, YawProfile)
    turned = (other.leaving[number] - angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    if alike:
        assert abs(turned) > np.radians(8.0)
    else:
        assert abs(turned) < 1e-9
    # What it knew from before is what a search from nothing known works out.
    anew = YawSearch(conditions, field, track, steps, **settings)
    fresh = anew.best(shut)
    assert isinstance(fresh, YawProfile)
    assert other.cost == pytest.approx(fresh.cost, rel=1e-3)
    kept, price = search.pieces.price, anew.pieces.price
    both = np.isfinite(kept) & np.isfinite(price)
    assert both.mean() > 0.5 * np.isfinite(price).mean()
    np.testing.assert_array_equal(kept[both], price[both])
