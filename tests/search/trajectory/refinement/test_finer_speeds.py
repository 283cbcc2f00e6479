"""Speeds between the levels cost less, by the account and by physics, and keep all limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.power.vehicles import load_vehicle
from planner.search.requests import PlanRequest
from planner.search.situation import situation_of
from planner.search.trajectory import drive
from planner.search.trajectory.heat import overheated
from planner.search.trajectory.limit_checks import Broken, broken_limits
from planner.search.trajectory.motion import Motion, motion_rows, pieces_of
from planner.search.trajectory.refinement import finer_speeds, rounds
from tests.power.states import changed
from tests.search.maps import hills, terrain

PATH = np.array([[3.0, 4.0], [9.0, 5.0], [13.0, 10.0], [14.0, 16.0], [20.0, 18.0]])
CORNERS = np.array([[3, 4], [5, 8], [9, 8], [9, 12], [13, 12], [13, 18], [20, 18]], float)
LEVEL = terrain(np.zeros((96, 96)))
ROBOT = PowerModel.from_vehicle(load_vehicle("minibalance"))


def circumstances(relief, model=ROBOT, **asked):
    """Field and conditions of a request."""
    ends = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 18.0}}
    request = PlanRequest.from_json({"map": "test", **ends, **asked})
    situation = situation_of(request, terrain=relief, model=model)
    return situation.field("energy"), situation.conditions


def on_levels(monkeypatch, field, conditions, legs, yaws) -> Motion:
    """The motion whose speeds are levels of the profile."""
    with monkeypatch.context() as patch:
        patch.setattr(rounds, "finer_speeds", lambda field, conditions, motion: motion)
        motion = drive.move(field, conditions, legs, yaws)
    assert isinstance(motion, Motion)
    return motion


def accounted(field, conditions, motion) -> float:
    """J, row by row through the kernel of the account, at ten times as many rows."""
    pieces = pieces_of(field, motion, 0.05)
    rows, seconds, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
    return float(conditions.model.watts(rows) @ seconds)


@pytest.fixture(
    scope="module",
    params=[(PATH, 8.0, 6.0), (CORNERS, 8.0, 6.0), (CORNERS, 0.0, 0.0)],
    ids=["loaded on hills", "loaded round corners", "round corners on the level"],
)
def driven(request):
    """Field, conditions, and motions before and after; hills of some degrees, kg of load."""
    path, degrees, mass = request.param
    relief = terrain(hills(96, rms_degrees=degrees)) if degrees else LEVEL
    field, conditions = circumstances(relief, payload={"mass": mass, "x": 0.0, "y": 0.0})
    with pytest.MonkeyPatch.context() as patch:
        before = on_levels(patch, field, conditions, [path], (None, None))
    after = drive.move(field, conditions, [path], (None, None))
    return field, conditions, before, after


def test_finer_speeds_cost_less_along_the_same_poses_within_limits(driven) -> None:
    field, conditions, before, after = driven
    for name in ("x", "y", "heights", "yaw"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    first, last = (accounted(field, conditions, motion) for motion in (before, after))
    assert last < 0.9995 * first
    assert not broken_limits(field, conditions, after, finely=True)
    assert overheated(field, conditions, after) is None
    assert after.speed.max() <= conditions.model.vehicle.limits.speed * (1.0 + 1e-6)


def test_time_and_speeds_of_a_motion_agree(driven) -> None:
    *_, motion = driven
    chords = np.hypot(np.diff(motion.x), np.diff(motion.y))
    metres = np.hypot(chords, np.diff(motion.heights))
    mean = 0.5 * (motion.speed[1:] + motion.speed[:-1])
    np.testing.assert_allclose(np.diff(motion.time) * mean, metres, rtol=1e-9)


def saved_by_chance(field, conditions, motion) -> float:
    """Share of the energy that 200 small random changes of the speeds save within all limits."""
    random = np.random.default_rng(7)
    along, top = np.arange(len(motion.x)), float(conditions.limits[0])
    first = least = accounted(field, conditions, motion)
    for _ in range(200):
        wide = random.uniform(0.5, 12.0)
        bump = np.maximum(1.0 - np.abs(along - random.uniform(0.0, along[-1])) / wide, 0.0)
        squared = motion.speed**2 + random.normal(0.0, 0.02) * top**2 * bump * (motion.speed > 0.0)
        if squared[1:-1].min() < (0.05 * top) ** 2 or squared.max() > top**2:
            continue
        speed = np.sqrt(squared)
        seconds = np.diff(motion.time) * (motion.speed[1:] + motion.speed[:-1])
        time = np.append(0.0, np.cumsum(seconds / (speed[1:] + speed[:-1])))
        other = replace(motion, speed=speed, time=time)
        joules = accounted(field, conditions, other)
        if joules < least and not broken_limits(field, conditions, other, finely=True):
            motion, least = other, joules
    return (first - least) / first


def test_chance_saves_hardly_more(driven) -> None:
    field, conditions, before, after = driven
    left = saved_by_chance(field, conditions, after)
    assert left < 5e-4
    assert left < 0.3 * saved_by_chance(field, conditions, before)


def test_the_cruising_speed_is_that_of_least_power_over_speed(monkeypatch) -> None:
    """On level ground, with bearings so stiff that full speed is not the best."""
    stiff = {"viscous_drag__viscous_torque": 2.3e-5, "electronics__power": 5.3}
    vehicle = load_vehicle("minibalance")
    model = changed(PowerModel.from_vehicle(vehicle, effects=("viscous_drag",)), **stiff)
    field, conditions = circumstances(LEVEL, model)
    speeds = np.linspace(0.05, 1.0, 2000) * float(conditions.limits[0])
    rows = np.repeat(conditions.class_rows[:1], len(speeds), axis=0)
    for row, speed in zip(rows, speeds, strict=True):
        set_motion(row, 0.0, 0.0, 0.0, 0.0, speed)
    best = float(speeds[np.argmin(model.watts(rows) / speeds)])
    assert best < 0.9 * speeds[-1]
    legs = [np.array([[2.0, 4.0], [21.0, 4.0]])]
    plain = on_levels(monkeypatch, field, conditions, legs, (None, None))
    motion = drive.move(field, conditions, legs, (None, None))
    cruising = (motion.x > 6.0) & (motion.x < 17.0)
    assert np.abs(plain.speed[cruising] / best - 1.0).min() > 0.01, "a level is as good"
    np.testing.assert_allclose(motion.speed[cruising], best, rtol=0.01)


def test_the_robot_stops_where_it_did_and_turns_as_long(monkeypatch) -> None:
    field, conditions = circumstances(terrain(hills(96, rms_degrees=5.0)))
    legs, yaws = [PATH[:3], PATH[2:]], (0.3, (0.5, 2.5), -1.0)
    before = on_levels(monkeypatch, field, conditions, legs, yaws)
    after = drive.move(field, conditions, legs, yaws)
    assert not np.array_equal(after.speed, before.speed)
    np.testing.assert_array_equal(after.speed == 0.0, before.speed == 0.0)
    turning = (before.speed[1:] == 0.0) & (before.speed[:-1] == 0.0)
    assert turning.sum() > 8
    lasting = np.diff(before.time)[turning]
    np.testing.assert_allclose(np.diff(after.time)[turning], lasting, rtol=1e-9)
    slowest = 0.05 * conditions.model.vehicle.limits.speed
    assert after.speed[after.speed > 0.0].min() >= 0.999 * min(
        slowest, before.speed[before.speed > 0.0].min()
    )


def test_speeds_stay_on_a_step_where_a_limit_would_break(driven, monkeypatch) -> None:
    field, conditions, before, after = driven
    step = int(np.abs(after.speed - before.speed)[:-1].argmax())
    asked = []

    def once(field, conditions, motion, **how):
        asked.append(motion)
        broken = np.zeros(1) if len(asked) == 1 else np.zeros(0)
        steps = np.full(len(broken), step)
        return Broken(steps, steps, broken, broken, broken > 0.0, broken, broken)

    monkeypatch.setattr(finer_speeds, "broken_limits", once)
    finer = finer_speeds.finer_speeds(field, conditions, before)
    assert len(asked) == 2
    np.testing.assert_array_equal(finer.speed[[step, step + 1]], before.speed[[step, step + 1]])
    assert not np.array_equal(finer.speed, before.speed)


def test_a_motion_stays_where_no_other_speeds_keep_all_limits(driven, monkeypatch) -> None:
    field, conditions, before, _ = driven
    at = np.full(1, 5)
    always = Broken(at, at, 0.0 * at, 0.0 * at, at < 0, 0.0 * at, 0.0 * at)
    monkeypatch.setattr(finer_speeds, "broken_limits", lambda *given, **how: always)
    assert finer_speeds.finer_speeds(field, conditions, before) is before
