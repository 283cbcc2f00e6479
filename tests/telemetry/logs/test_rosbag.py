"""Recordings of ROS 2: what is read of them, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import LogError
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import column

PITCH = 0.2


def record(path: Path, *, late: float | None = None, battery_rate: int = 5) -> None:
    """Four seconds of a drive; with ``late`` messages are stamped and arrive so many s later."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds_of = store.types
    vector, stamp = kinds_of["geometry_msgs/msg/Vector3"], kinds_of["builtin_interfaces/msg/Time"]

    def header(t: float) -> Any:
        nanoseconds = 0 if late is None else 1_700_000_000 * 10**9 + round(1e9 * t)
        return kinds_of["std_msgs/msg/Header"](
            stamp(nanoseconds // 10**9, nanoseconds % 10**9), "base_link"
        )

    quaternion = kinds_of["geometry_msgs/msg/Quaternion"]
    pose = kinds_of["geometry_msgs/msg/Pose"](
        kinds_of["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), quaternion(0.0, 0.0, 0.0, 1.0)
    )
    nothing = np.zeros(36)

    def odometry(t: float) -> Any:
        twist = kinds_of["geometry_msgs/msg/Twist"](
            vector(0.5 * t, 0.1, 0.0), vector(0.0, 0.0, 0.3)
        )
        return kinds_of["nav_msgs/msg/Odometry"](
            header(t),
            "base_link",
            kinds_of["geometry_msgs/msg/PoseWithCovariance"](pose, nothing),
            kinds_of["geometry_msgs/msg/TwistWithCovariance"](twist, nothing),
        )

    def imu(t: float) -> Any:
        felt = vector(0.5 - STANDARD_GRAVITY * math.sin(PITCH), 0.0, 9.6)
        return kinds_of["sensor_msgs/msg/Imu"](
            header(t),
            quaternion(0.0, math.sin(PITCH / 2), 0.0, math.cos(PITCH / 2)),
            np.zeros(9),
            vector(0.0, 0.0, 0.3),
            np.zeros(9),
            felt,
            np.zeros(9),
        )

    battery_kind = kinds_of["sensor_msgs/msg/BatteryState"]

    def battery(t: float) -> Any:
        lists = np.zeros(0, np.float32)
        current = -2.0 - 0.5 * math.floor(t)
        return battery_kind(
            header(t), 24.0, 20.0, current, 1.0, 5.0, 5.0, 0.9, 2, 1, 1, True, lists, lists, "", ""
        )

    topics = (
        ("/odom", "nav_msgs/msg/Odometry", 50, odometry),
        ("/imu", "sensor_msgs/msg/Imu", 100, imu),
        ("/battery", "sensor_msgs/msg/BatteryState", battery_rate, battery),
    )
    with rosbag2.Writer(path, version=9) as writer:
        for topic, kind, rate, make in topics:
            connection = writer.add_connection(topic, kind, typestore=store)
            for k in range(4 * rate):
                t = k / rate
                raw = store.serialize_cdr(make(t), kind)
                # The network holds up every third message, so that they do not arrive evenly.
                delay = (late or 0.0) * (1.0 + (k % 3 == 0))
                arrival = (0 if late is None else 1_700_000_000 * 10**9) + int(1e9 * (t + delay))
                writer.write(connection, arrival, raw)


def sentences(log: Telemetry) -> str:
    return "\n".join(finding.sentence for finding in log.report)


def test_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "drive"
    record(path)
    log = Telemetry.read(path)
    assert log.run_names == ("drive",)
    # The battery sends five messages a second, so that shorter rows would repeat its value.
    assert np.allclose(log.interval, 0.2)
    assert np.allclose(log.power, 48.0 + 12.0 * np.floor(log.time - 0.1))
    # Ten messages of 50 Hz in an interval that ends at t have their mean 0.11 s before it.
    assert np.allclose(column(log, "vx"), 0.5 * (log.time - 0.11), atol=0.011)
    assert "times of arrival, because header.stamp is empty" in sentences(log)
    assert np.allclose(column(log, "ax"), 0.5)
    assert np.allclose(column(log, "gravity_x"), STANDARD_GRAVITY * math.sin(PITCH))
    file = next(path.glob("*.db3"))
    (tmp_path / "map.toml").write_text('[rosbag]\nodometry = "/elsewhere"\n')
    with pytest.raises(LogError, match="no such topic"):
        Telemetry.read(path, tmp_path / "map.toml")
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(LogError, match="cannot be read"):
        Telemetry.read(path)


def test_times_are_those_of_the_stamps(tmp_path: Path) -> None:
    record(tmp_path / "drive", late=0.3)
    log = Telemetry.read(tmp_path / "drive")
    # By arrival, a third of the messages would fall into rows 0.3 s behind their own.
    assert np.allclose(column(log, "vx"), 0.5 * (log.time - 0.11), atol=0.011)
    assert "times from header.stamp" in sentences(log)
    assert "odometry arrived 0.3 s after its stamps" in sentences(log)


def test_a_slow_battery_is_held_and_that_is_said(tmp_path: Path) -> None:
    record(tmp_path / "drive", late=0.0, battery_rate=2)
    assert np.allclose(Telemetry.read(tmp_path / "drive").interval, 0.5)
    (tmp_path / "map.toml").write_text("[rosbag]\ninterval = 0.1\n")
    log = Telemetry.read(tmp_path / "drive", tmp_path / "map.toml")
    assert np.allclose(log.interval, 0.1)
    # Only values that were sent: 48, 60, 72, 84 W, and nothing between them.
    assert {round(watts, 6) for watts in log.power.tolist()} == {48.0, 60.0, 72.0, 84.0}
    assert "every 0.5 s: its last value is held in 80% of the rows" in sentences(log)
