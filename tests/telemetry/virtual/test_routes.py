"""Planned routes, driven by the virtual robot."""

import math

import numpy as np
import pytest

from planner.errors import InputError
from planner.telemetry.virtual import VirtualLog, VirtualRobot
from planner.telemetry.virtual.routes import planned_route
from planner.terrain.heightmap import GroundClass, Terrain

SLOPE_10 = math.radians(10.0)
AIR = {"air_drag": {"drag_area": 0.18}}


def route_of(points, speed):
    """Poses of a straight drive through (x, y, z, yaw), as a ROUTE.json has them."""
    poses, t = [], 0.0
    for k, (x, y, z, yaw) in enumerate(points):
        if k:
            t += math.dist((x, y, z), points[k - 1][:3]) / speed
        pose = {"x": x, "y": y, "z": z, "yaw": yaw, "t": t, "speed": speed, "energy_j": 0.0}
        poses.append(pose)
    return {"poses": poses}


def test_routes_are_driven():
    robot = VirtualRobot("minibalance", effects="active", hidden=AIR)
    # 30 s to the left at 0.5 m/s, facing north: the robot drives forward. Physics page: 13.9 W.
    flat = route_of([(0.0, 0.5 * k, 0.0, math.pi / 2) for k in range(31)], 0.5)
    energy, log = robot.drive_route(flat)
    assert energy == pytest.approx(13.9 * 30.0, rel=0.02)
    np.testing.assert_allclose(log.columns["vx"][2:-2], 0.5, atol=0.01)
    # The same way on a ramp of 10 degrees that rises to the north: 33.8 W; sideways 42.8 W.
    rise = math.tan(SLOPE_10)
    points = [(0.0, 0.4 * k, 0.4 * k * rise, math.pi / 2) for k in range(31)]
    energy, log = robot.drive_route({"routes": [route_of(points, 0.5)]})
    duration = 12.0 / math.cos(SLOPE_10) / 0.5
    assert energy == pytest.approx(33.8 * duration, rel=0.02)
    assert log.columns["pitch"][10] == pytest.approx(-SLOPE_10, abs=0.003)
    points = [(x, y, z, 0.0) for x, y, z, _ in points]
    # The same ramp as a map, with heights that the poses' own cannot tell from a cross-slope.
    y = np.linspace(-1.0, 13.0, 57)
    ramp = np.tile((rise * y)[:, None], (1, 12))
    kinds = (GroundClass("hard"), GroundClass("gravel", rolling=2.0))
    plane = Terrain.from_arrays(ramp, cell=(0.25, 0.25), origin=(-1.375, -1.0))
    energy, _ = robot.drive_route(route_of(points, 0.5), terrain=plane)
    assert energy == pytest.approx(42.8 * duration, rel=0.02)
    # Ground that rolls twice as badly takes the rolling work of 12 kg over 12 m once more.
    gravel = Terrain.from_arrays(
        ramp,
        cell=(0.25, 0.25),
        origin=(-1.375, -1.0),
        ground=np.ones_like(ramp, dtype=np.uint8),
        ground_classes=kinds,
    )
    straight = route_of([(x, y, z, math.pi / 2) for x, y, z, _ in points], 0.5)
    _, hard = robot.drive_route(straight, terrain=plane)
    _, rough = robot.drive_route(straight, terrain=gravel)
    more = rough.truth["energy"]["route"]["rolling"] - hard.truth["energy"]["route"]["rolling"]
    # Horizontal length times weight: the load is m·g·cos, the path 12 m/cos.
    assert more == pytest.approx(0.035 * 12.0 * 9.80665 * 12.0, rel=0.02)
    assert set(rough.columns["surface"]) == {"gravel"}


def test_corners_of_a_route_are_rounded():
    # North, then east, at 0.5 m/s: the turn takes longer than one moment, and no way is lost.
    corner = [(0.0, 0.25 * k, 0.0, 0.0) for k in range(21)]
    corner += [(0.25 * k, 5.0, 0.0, 0.0) for k in range(1, 21)]
    drive = planned_route(route_of(corner, 0.5), row=0.1)
    vx, vy = drive.motion[0, :, 0], drive.motion[0, :, 1]
    at = int(np.argmin(np.abs(vx - vy)))
    assert np.hypot(vx[at], vy[at]) < 0.45
    assert np.abs(np.diff(vx)).max() < 0.5 * 0.5
    for speed in (vx, vy):
        assert 0.1 * (speed[1:] + speed[:-1]).sum() / 2.0 == pytest.approx(5.0, abs=0.1)


def test_logs_are_joined_as_runs():
    robot = VirtualRobot("minibalance")
    _, out = robot.drive_route(route_of([(0.0, 0.5 * k, 0.0, 0.0) for k in range(9)], 0.5))
    _, back = robot.drive_route(route_of([(0.0, -0.5 * k, 0.0, 0.0) for k in range(7)], 0.5))
    both = VirtualLog.joined({"out": out, "back": back})
    assert set(both.columns["run"]) == {"out", "back"}
    for name, log in (("out", out), ("back", back)):
        part = both.select([name])
        np.testing.assert_array_equal(part.columns["power"], log.columns["power"])
    short = VirtualLog({"power": out.columns["power"]}, {})
    with pytest.raises(InputError, match="different columns"):
        VirtualLog.joined({"out": out, "short": short})
