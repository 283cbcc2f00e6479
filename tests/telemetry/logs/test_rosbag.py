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


def test_a_recording(tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds_of = store.types
    vector, stamp = kinds_of["geometry_msgs/msg/Vector3"], kinds_of["builtin_interfaces/msg/Time"]
    header = kinds_of["std_msgs/msg/Header"](stamp(0, 0), "base_link")
    quaternion = kinds_of["geometry_msgs/msg/Quaternion"]
    pose = kinds_of["geometry_msgs/msg/Pose"](
        kinds_of["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), quaternion(0.0, 0.0, 0.0, 1.0)
    )
    nothing = np.zeros(36)
    pitch = 0.2

    def odometry(t: float) -> Any:
        twist = kinds_of["geometry_msgs/msg/Twist"](
            vector(0.5 * t, 0.1, 0.0), vector(0.0, 0.0, 0.3)
        )
        return kinds_of["nav_msgs/msg/Odometry"](
            header,
            "base_link",
            kinds_of["geometry_msgs/msg/PoseWithCovariance"](pose, nothing),
            kinds_of["geometry_msgs/msg/TwistWithCovariance"](twist, nothing),
        )

    def imu(t: float) -> Any:
        felt = vector(0.5 - STANDARD_GRAVITY * math.sin(pitch), 0.0, 9.6)
        return kinds_of["sensor_msgs/msg/Imu"](
            header,
            quaternion(0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2)),
            np.zeros(9),
            vector(0.0, 0.0, 0.3),
            np.zeros(9),
            felt,
            np.zeros(9),
        )

    battery_kind = kinds_of["sensor_msgs/msg/BatteryState"]

    def battery(t: float) -> Any:
        lists = np.zeros(0, np.float32)
        current = -2.0
        return battery_kind(
            header, 24.0, 20.0, current, 1.0, 5.0, 5.0, 0.9, 2, 1, 1, True, lists, lists, "", ""
        )

    path = tmp_path / "drive"
    topics = (
        ("/odom", "nav_msgs/msg/Odometry", 50, odometry),
        ("/imu", "sensor_msgs/msg/Imu", 100, imu),
        ("/battery", "sensor_msgs/msg/BatteryState", 5, battery),
    )
    with rosbag2.Writer(path, version=9) as writer:
        for topic, kind, rate, make in topics:
            connection = writer.add_connection(topic, kind, typestore=store)
            for k in range(4 * rate):
                t = k / rate
                raw = store.serialize_cdr(make(t), kind)
                writer.write(connection, int(1e9 * t), raw)
    log = Telemetry.read(path)
    assert log.run_names == ("drive",)
    assert np.allclose(log.interval, 0.1)
    assert np.allclose(log.power, 48.0)
    # Five messages of 50 Hz in an interval that ends at t have their mean 0.06 s before it.
    assert np.allclose(column(log, "vx"), 0.5 * (log.time - 0.06), atol=0.011)
    assert np.allclose(column(log, "ax"), 0.5)
    assert np.allclose(column(log, "gravity_x"), STANDARD_GRAVITY * math.sin(pitch))
    file = next(path.glob("*.db3"))
    (tmp_path / "map.toml").write_text('[rosbag]\nodometry = "/elsewhere"\n')
    with pytest.raises(LogError, match="no such topic"):
        Telemetry.read(path, tmp_path / "map.toml")
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(LogError, match="cannot be read"):
        Telemetry.read(path)
