"""Shares of the limits against a second model that reads the finer poses of an answer alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from planner import plan_route
from planner.power.limits import LIMIT_NAMES
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.situation.traversability import driving_ground
from planner.search.trajectory import move
from planner.search.trajectory.limit_checks import limit_shares
from planner.search.trajectory.limit_use import LIMITS_USED, limits_used
from planner.search.trajectory.motion import motion_rows, pieces_of
from tests.benchmarks.peers.case import case_of
from tests.power.reference import ROLLER, YAW, Robot, State, evaluate, gravity_on
from tests.search.maps import drawn, hills, terrain

ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 18.0, "y": 15.0}}


def shares(route) -> dict[str, float]:
    return {use.limit: use.share for use in route.limits}


def with_limits(**limits: float) -> PowerModel:
    vehicle = load_vehicle("minibalance")
    return PowerModel.from_vehicle(replace(vehicle, limits=replace(vehicle.limits, **limits)))


@pytest.fixture(scope="module")
def on_hills():
    """A robot on steep hills, its answer in poses every 10 ms."""
    relief = terrain(hills(rms_degrees=9.0, seed=2))
    return relief, plan_route(terrain=relief, poses_every_s=0.01, **ASKED)


def gear_torques_by_hand(relief, arrays) -> np.ndarray:
    """(n, 4) N·m that gears take between two poses, by the second model."""
    ground = driving_ground(relief, load_vehicle("minibalance"))
    (x0, y0), (dx, dy) = ground.origin, ground.cell
    ny, nx = ground.heights.shape
    spline = RectBivariateSpline(y0 + dy * np.arange(ny), x0 + dx * np.arange(nx), ground.heights)
    robot = Robot()
    t, speed = arrays["t"], arrays["speed"]
    torques = []
    for k in range(len(t) - 1):
        seconds = t[k + 1] - t[k]
        px, py = (0.5 * (arrays[name][k] + arrays[name][k + 1]) for name in ("x", "y"))
        slope_x, slope_y = (float(spline.ev(py, px, *d)) for d in ((0, 1), (1, 0)))
        yaw = 0.5 * (arrays["yaw"][k] + arrays["yaw"][k + 1])
        along = np.array([arrays[name][k + 1] - arrays[name][k] for name in ("x", "y")])
        reach = math.hypot(*along)
        velocity, push = (0.0, 0.0), (0.0, 0.0)
        if reach > 1e-9:
            ahead = math.atan2(along[1], along[0]) - yaw
            pace = 0.5 * (speed[k] + speed[k + 1])
            velocity = pace * math.cos(ahead), pace * math.sin(ahead)
            change = (speed[k + 1] - speed[k]) / seconds
            push = change * math.cos(ahead), change * math.sin(ahead)
        rate = (arrays["yaw"][k + 1] - arrays["yaw"][k]) / seconds
        state = State(
            velocity=(*velocity, rate),
            gravity=gravity_on(slope_x, slope_y, yaw),
            acceleration=(*push, 0.0),
        )
        wheel = evaluate(robot, state)
        arm = robot.half_wheelbase + robot.half_track
        spin = velocity[0] + ROLLER * velocity[1] + YAW * arm * rate
        driving = wheel.torque * spin >= 0.0
        back = 2.0 - 1.0 / robot.efficiency
        teeth = wheel.torque / robot.ratio * np.where(driving, 1.0 / robot.efficiency, back)
        torques.append(np.abs(teeth))
    return np.array(torques)


def test_the_torques_of_an_answer_are_those_of_a_second_model(on_hills):
    relief, answer = on_hills
    route = answer.routes[0]
    torques = gear_torques_by_hand(relief, route.arrays)
    seconds = np.diff(route.arrays["t"])
    heat = np.vstack([np.zeros(4), np.cumsum(torques**2 * seconds[:, None], axis=0)])
    ends = np.append(0.0, np.cumsum(seconds))
    window = [np.interp(ends - 60.0, ends, column) for column in heat.T]
    rms = math.sqrt((heat - np.stack(window, axis=1)).max() / 60.0)
    used = shares(route)
    # The second model leaves out sideways forces on bends, which the path hardly has.
    assert used["torque rms"] == pytest.approx(rms / 0.033, rel=0.02)
    assert used["torque peak"] == pytest.approx(torques.max() / 0.066, rel=0.05)


def test_speed_acceleration_and_turning_follow_from_the_poses(on_hills):
    _, answer = on_hills
    route = answer.routes[0]
    arrays, used = route.arrays, shares(route)
    assert set(used) == set(LIMITS_USED)
    seconds = np.diff(arrays["t"])
    assert seconds.max() <= 0.01 * (1.0 + 1e-9)
    steps = np.column_stack([np.diff(arrays[name]) for name in ("x", "y", "z")])
    speed = np.linalg.norm(steps, axis=1) / seconds
    assert speed.max() / 1.2 == pytest.approx(used["speed"], rel=2e-3)
    assert (np.abs(np.diff(arrays["yaw"])) / seconds).max() == pytest.approx(
        used["yaw rate"], rel=5e-3
    )
    level = plan_route(terrain=terrain(np.zeros((96, 96))), poses_every_s=0.005, via=[
        {"x": 8.0, "y": 18.0}], **ASKED)  # fmt: skip
    arrays = level.routes[0].arrays
    seconds = np.diff(arrays["t"])
    velocity = np.column_stack([np.diff(arrays[name]) for name in ("x", "y")]) / seconds[:, None]
    middle = 0.5 * (seconds[1:] + seconds[:-1])
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / middle
    assert change.max() <= 1.0 + 1e-3
    assert shares(level.routes[0])["acceleration"] <= 1.0 + 1e-3


@pytest.mark.parametrize("seed", [2, 3])
def test_shares_are_those_on_the_arcs_of_bends_at_least(seed):
    """Nobody drives the corners between the chords of a bend."""
    relief = terrain(hills(rms_degrees=8.0, seed=seed))
    situation = case_of("test", ASKED, relief).situation
    field, conditions = situation.field("energy"), situation.conditions
    path = np.array([[3.0, 4.0], [10.0, 5.0], [11.0, 14.0], [18.0, 15.0]])
    motion = move(field, conditions, [path], [None, None], checked=False)
    inputs = field, motion, conditions.class_rows, conditions.wind
    pieces = pieces_of(field, motion, 0.05)
    rows, _, owner = motion_rows(*inputs, pieces, on_arcs=True)
    on_bends = motion.curvatures[owner] != 0.0
    most = limit_shares(conditions, conditions.model.power_and_limits(rows[on_bends])).max(axis=0)
    used = {use.limit: use.share for use in limits_used(field, conditions, motion)}
    for name, share in zip(LIMIT_NAMES, most, strict=True):
        assert used[name] >= share * (1.0 - 0.003), name


def test_the_clearance_share_is_clearance_over_distance():
    rows = ["." * 60] * 14 + ["#" * 60] * 6
    ends = {"start": {"x": 1.0, "y": 1.0, "yaw": 0.0}, "goal": {"x": 5.0, "y": 1.0, "yaw": 0.0}}
    answer = plan_route(terrain=drawn("\n".join(rows), cell=0.1), **ends)
    uses = {use.limit: use for use in answer.routes[0].limits}
    # From the wall, whose cells end at y = 0.55, to a body half as wide as 0.52 m.
    assert uses["clearance"].share == pytest.approx(0.05 / (1.0 - 0.55 - 0.26), rel=0.02)


def step_of(metres: float, slope: float) -> np.ndarray:
    """Level ground, a slope along x in the middle of so many m, and level ground again."""
    x = 0.25 * np.arange(96)
    begun = 12.0 - 0.5 * metres
    return np.repeat(slope * np.clip(x - begun, 0.0, metres)[None, :], 40, axis=0)


UP = {"start": {"x": 6.0, "y": 5.0}, "goal": {"x": 18.0, "y": 5.0}}


def test_a_short_step_is_taken_and_a_long_climb_is_not():
    """16.4° is what motors give for good; a slope beyond it may be driven for a while."""
    steep = math.tan(math.radians(19.0))
    short = plan_route(terrain=terrain(step_of(2.0, steep)), **UP)
    assert short.status == "ok"
    used = shares(short.routes[0])
    assert 0.5 < used["torque peak"] < 1.0
    assert used["torque rms"] < 0.6
    model = with_limits(thermal_time=1.0)
    refused = plan_route(terrain=terrain(step_of(6.0, steep)), model=model, **UP)
    assert refused.status == "no_route"
    assert refused.cause["limit"] == "torque rms"
    assert refused.cause["value"] > refused.cause["allowed"] == pytest.approx(0.033)


def test_motors_that_get_too_warm_ask_for_another_path():
    """A gentler pass lies beside the direct climb; it costs more and keeps motors cool."""
    heights = step_of(5.0, math.tan(math.radians(18.5)))
    x = 0.25 * np.arange(96)
    gentle = heights.max() * np.clip((x - 6.0) / 12.0, 0.0, 1.0)
    share = np.clip((np.arange(120) - 40.0) / 30.0, 0.0, 1.0)[:, None]
    wide = (1.0 - share) * np.vstack([heights, heights, heights]) + share * gentle[None, :]
    ends = {"start": {"x": 4.5, "y": 4.0}, "goal": {"x": 20.0, "y": 4.0}}
    direct = plan_route(terrain=terrain(wide), **ends)
    cool = plan_route(terrain=terrain(wide), model=with_limits(thermal_time=2.0), **ends)
    assert direct.status == cool.status == "ok"
    assert shares(cool.routes[0])["torque rms"] <= 1.0
    assert cool.routes[0].arrays["y"].max() > direct.routes[0].arrays["y"].max() + 0.5
    for name, baseline in cool.baselines.items():
        assert shares(baseline.route)["torque rms"] <= 1.0, name
