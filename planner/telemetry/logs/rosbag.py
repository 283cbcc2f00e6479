"""A rosbag2 recording as a log: odometry, IMU and battery averaged over one common interval.

    nav_msgs/Odometry         vx, vy, wz      twist, in the frame of the body
    sensor_msgs/Imu           roll, pitch     of the orientation
                              ax, ay          linear acceleration + gravity in the body frame
    sensor_msgs/BatteryState  battery_voltage, battery_current (ROS: current < 0 discharges, so the
                              sign is turned)

Every channel is averaged over intervals of 0.1 s, or of the battery's own interval where that is
longer (``[rosbag] interval`` of the mapping file). Times are those of ``header.stamp``, when a
message was measured; where a topic has no stamps, the times of arrival are taken and a note says
so. An interval without a message takes the value between its neighbours if they are at most one
second apart, and is left empty otherwise; a battery without a message keeps its last value, and a
note says in how many rows. ``time`` is the end of the interval, from the first message on. One
recording is one run, named after the file.

Source
    REP-103 for axes, ROS documentation of the three messages for signs.
Left out
    topics of other kinds; covariances; an IMU whose frame is not that of the body.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.errors import LogError
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.logs.files import Block
from planner.telemetry.logs.mapping import Mapping

RESAMPLING_INTERVAL = 0.1
"""s that messages are averaged over."""
_LONGEST_BRIDGE = 1.0
"""s without a message over which values are interpolated."""
_MOST_INTERVALS = 5_000_000
"""Rows of a recording that are held in memory, see MOST_ROWS of log."""
_KINDS = {
    "odometry": "nav_msgs/msg/Odometry",
    "imu": "sensor_msgs/msg/Imu",
    "battery": "sensor_msgs/msg/BatteryState",
}
_COLUMNS = {
    "odometry": ("vx", "vy", "wz"),
    "imu": ("roll", "pitch", "ax", "ay"),
    "battery": ("battery_voltage", "battery_current"),
}
ACCEPTED = "a rosbag2 recording (.db3, .mcap or its folder) with odometry and battery topics"


def read_recording(path: Path, mapping: Mapping) -> tuple[list[str], Block, list[str]]:
    """Headings, one block with all rows, and notes on the topics.

    Raises:
        LogError: the extra ``rosbag`` is not installed, or the recording cannot be used.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise LogError(
            str(path),
            "is a ROS recording, and the package that reads them is not installed",
            accepted='pip install "joulepath[rosbag]"',
        ) from error
    where = str(path)
    try:
        store = get_typestore(Stores.ROS2_HUMBLE)
        with AnyReader([path], default_typestore=store) as reader:
            topics = _topics(reader, mapping, where)
            samples = {part: _samples(reader, part, topic) for part, topic in topics.items()}
    except LogError:
        raise
    except Exception as error:  # The reader passes on what SQLite, LZ4 and its parser raise.
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise LogError(where, f"cannot be read: {reason}", accepted=ACCEPTED) from error
    notes = [f"{part} from topic {topic}" for part, topic in topics.items()]
    tables = _on_one_clock(samples, notes)
    own = _usual_interval(tables.get("battery"))
    step = float(mapping.rosbag.get("interval", max(RESAMPLING_INTERVAL, round(own, 3))))
    columns = _resampled(tables, step, where)
    count = len(columns["time"])
    notes.append(f"averaged over intervals of {step:.4g} s")
    if own > 1.5 * step:
        notes.append(
            f"the battery sends a message every {own:.3g} s: its last value is held in "
            f"{1.0 - step / own:.0%} of the rows"
        )
    label = (np.zeros(count, np.int64), [path.stem])
    block = Block(columns, {"run": label}, np.arange(1, count + 1, dtype=np.int64))
    return ["run", *columns], block, notes


def _topics(reader: Any, mapping: Mapping, where: str) -> dict[str, str]:
    chosen = {}
    for part, kind in _KINDS.items():
        there = sorted({c.topic for c in reader.connections if c.msgtype == kind})
        wanted = mapping.rosbag.get(part)
        if wanted is not None and wanted not in there:
            raise LogError(
                f"{where}: {wanted}",
                f"no such topic of {kind}",
                accepted=", ".join(there) or "(the recording has none)",
            )
        if wanted is None and len(there) > 1:
            raise LogError(
                where,
                f"has several topics of {kind}",
                value=", ".join(there),
                accepted=f'one of them as {part} = "..." under [rosbag] of a mapping file',
            )
        if wanted is None and not there and part == "odometry":
            raise LogError(where, f"has no topic of {kind}", accepted=ACCEPTED)
        if wanted or there:
            chosen[part] = str(wanted or there[0])
    return chosen


def _samples(reader: Any, part: str, topic: str) -> Array:
    """(n, 2 + channels): time of arrival and of measurement in s, then the values.

    Arrival counts from the recording's start. Both count in whole ns first: a float of s since 1970
    has steps of 0.2 µs.
    """
    extract = {"odometry": _of_odometry, "imu": _of_imu, "battery": _of_battery}[part]
    connections = [c for c in reader.connections if c.topic == topic]
    rows = []
    for connection, arrival, raw in reader.messages(connections=connections):
        message = reader.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp
        stamped = stamp.sec * 10**9 + stamp.nanosec
        measured = 1e-9 * (stamped - reader.start_time) if stamped else np.nan
        rows.append((1e-9 * (arrival - reader.start_time), measured, *extract(message)))
    return np.array(rows, float).reshape(-1, 2 + len(_COLUMNS[part]))


def _on_one_clock(samples: dict[str, Array], notes: list[str]) -> dict[str, Array]:
    """(n, 1 + channels) of every part: s from the first message on, in the order of time."""
    without = [part for part, t in samples.items() if len(t) and np.isnan(t[:, 1]).any()]
    place = 0 if without else 1
    if without:
        notes.append(f"times of arrival, because header.stamp is empty in: {', '.join(without)}")
    else:
        notes.append("times from header.stamp")
        for part, table in samples.items():
            late = float(np.median(table[:, 0] - table[:, 1])) if len(table) else 0.0
            if 0.05 < abs(late) < 3600.0:
                notes.append(f"{part} arrived {late:.3g} s after its stamps")
    first = min((float(t[:, place].min()) for t in samples.values() if len(t)), default=0.0)
    tables = {}
    for part, table in samples.items():
        ordered = table[np.argsort(table[:, place], kind="stable")]
        tables[part] = np.column_stack([ordered[:, place] - first, ordered[:, 2:]])
    return tables


def _usual_interval(table: Array | None) -> float:
    """Median distance of messages, s; 0 where there are none."""
    return 0.0 if table is None or len(table) < 2 else float(np.median(np.diff(table[:, 0])))


def _of_odometry(message: Any) -> tuple[float, ...]:
    twist = message.twist.twist
    return twist.linear.x, twist.linear.y, twist.angular.z


def _of_imu(message: Any) -> tuple[float, ...]:
    q = message.orientation
    size = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if size < 0.5 or message.orientation_covariance[0] == -1:  # ROS: no orientation is known
        return np.nan, np.nan, np.nan, np.nan
    roll = np.arctan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
    pitch = np.arcsin(np.clip(2.0 * (q.w * q.y - q.z * q.x), -1.0, 1.0))
    gravity_x = STANDARD_GRAVITY * np.sin(pitch)
    gravity_y = -STANDARD_GRAVITY * np.cos(pitch) * np.sin(roll)
    felt = message.linear_acceleration
    return roll, pitch, felt.x + gravity_x, felt.y + gravity_y


def _of_battery(message: Any) -> tuple[float, ...]:
    return message.voltage, -message.current


def _resampled(samples: dict[str, Array], step: float, where: str) -> dict[str, Array]:
    ends = [table[-1, 0] for table in samples.values() if len(table)]
    last = max(ends, default=0.0)
    count = int(last / step)
    if not 1 <= count <= _MOST_INTERVALS:
        raise LogError(
            where,
            f"{last:.4g} s of messages make {count} intervals of {step:g} s",
            accepted=f"1 to {_MOST_INTERVALS} intervals; [rosbag] interval sets their length",
        )
    columns: dict[str, Array] = {"time": step * np.arange(1.0, count + 1.0)}
    for part, table in samples.items():
        for place, name in enumerate(_COLUMNS[part], start=1):
            held = part == "battery"
            values = _averages(table[:, 0], table[:, place], step, count, held=held)
            if not np.isnan(values).all():
                columns[name] = values
    return columns


def _averages(time: Array, values: Array, step: float, count: int, *, held: bool) -> Array:
    good = np.isfinite(values)
    place = (time[good] / step).astype(np.int64)
    inside = (place >= 0) & (place < count)
    place, values = place[inside], values[good][inside]
    number = np.bincount(place, minlength=count)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean: Array = np.bincount(place, values, minlength=count) / number
    known = np.flatnonzero(number)
    empty = np.flatnonzero(number == 0)
    if len(known) and len(empty):
        after = np.searchsorted(known, empty)
        left = known[np.maximum(after - 1, 0)]
        right = known[np.minimum(after, len(known) - 1)]
        near = (left < empty) & (right > empty) & ((right - left) * step <= _LONGEST_BRIDGE)
        between = mean[left] if held else np.interp(empty, known, mean[known])
        mean[empty[near]] = between[near]
    return mean
