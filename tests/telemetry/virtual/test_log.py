"""The virtual robot's log: rows, noise, sensors that err, files, designs of experiments."""

import csv
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from planner.telemetry.virtual import QUIET, VirtualRobot
from planner.telemetry.virtual.profiles import steady


@pytest.fixture(scope="module")
def rich():
    """A small rich profile: four runs of 30 s."""
    return VirtualRobot("minibalance", seed=4).profile("rich", runs=4, rows=60)


def test_rows_are_means_that_end_at_their_time():
    robot = VirtualRobot("minibalance")
    drive = steady(vx=0.0, duration=6.0)
    edges = np.arange(drive.motion.shape[1]) * 0.1
    drive.motion[0, :, 0] = 0.1 + 0.1 * edges
    log = robot.drive(drive, noise=QUIET)
    np.testing.assert_allclose(log.columns["time"], np.arange(1, 13) * 0.5)
    # The mean of a ramp is its value half an interval before the row's time.
    np.testing.assert_allclose(
        log.columns["vx"], 0.1 + 0.1 * (log.columns["time"] - 0.25), atol=1e-4
    )
    np.testing.assert_allclose(log.columns["ax"], 0.1, atol=1e-3)
    # Energy of the rows is that of the run.
    assert log.columns["power"].sum() * 0.5 == pytest.approx(
        log.truth["energy"]["run00"]["supply"], rel=1e-9
    )


def test_acceleration_holds_the_centripetal_part():
    log = VirtualRobot("minibalance").drive(steady(vx=0.5, wz=0.8), noise=QUIET)
    np.testing.assert_allclose(log.columns["ay"], 0.4, rtol=1e-6)
    np.testing.assert_allclose(log.columns["ax"], 0.0, atol=1e-9)


def test_same_seed_same_log(rich):
    robot = VirtualRobot("minibalance", seed=9)
    first, second = robot.drive(rich), robot.drive(rich)
    for name, values in first.columns.items():
        np.testing.assert_array_equal(values, second.columns[name])
    other = robot.drive(rich, seed=10)
    assert not np.array_equal(first.columns["power"], other.columns["power"])
    np.testing.assert_array_equal(first.truth["clean_power"], other.truth["clean_power"])


def test_csv_and_parquet_hold_the_same(rich, tmp_path: Path):
    log = VirtualRobot("minibalance").drive(rich)
    log.write_csv(tmp_path / "log.csv")
    log.write_parquet(tmp_path / "log.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "log.parquet")
    with (tmp_path / "log.csv").open(encoding="utf-8") as file:
        names, *rows = list(csv.reader(file))
    assert names == table.column_names == list(log.columns)
    expected = "run,time,vx,vy,wz,power,roll,pitch,ax,ay,payload,com_x,com_y,motor_temp,"
    expected += "ambient_temp,battery_voltage,battery_current,surface,wind_x,wind_y,sensor_rate,"
    expected += "wheel_current_1,wheel_current_2,wheel_current_3,wheel_current_4"
    assert ",".join(names) == expected
    for column, name in enumerate(names):
        written = [row[column] for row in rows]
        if name not in ("run", "surface"):
            written = [float(value) for value in written]
        assert written == table[name].to_pylist() == log.columns[name].tolist()
