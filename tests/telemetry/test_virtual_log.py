"""The virtual robot's log: rows, noise, sensors that err, files, designs of experiments."""

import csv
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from planner.telemetry.virtual_robot import QUIET, Noise, Sensors, VirtualRobot, profile, steady


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


def test_noise_is_as_large_and_as_slow_as_stated():
    robot = VirtualRobot("minibalance")
    flat = steady(vx=[0.2] * 20, duration=150.0)
    quiet = robot.drive(flat, noise=QUIET).columns["power"]

    def scatter(**noise):
        return (robot.drive(flat, noise=Noise(**noise)).columns["power"] - quiet).reshape(20, 300)

    white = scatter(level=0.03, autocorrelated=0.0)
    assert white.std() == pytest.approx(0.03 * quiet.mean(), rel=0.03)
    mixed = scatter(level=0.03, autocorrelated=0.5, correlation=0.8)
    assert mixed.std() == pytest.approx(0.03 * quiet.mean(), rel=0.06)
    neighbours = np.mean(mixed[:, 1:] * mixed[:, :-1]) / np.mean(mixed**2)
    assert neighbours == pytest.approx(0.5 * 0.8, abs=0.04)
    wild = scatter(level=0.03, outliers=0.01)
    share = np.mean(np.abs(wild) > 5.5 * 0.03 * quiet.mean())
    assert share == pytest.approx(0.01, abs=0.003)


def test_sensors_err_as_told(rich):
    robot = VirtualRobot("minibalance")
    right = robot.drive(rich, noise=QUIET).columns

    def wrong(**faults):
        return robot.drive(rich, noise=QUIET, sensors=Sensors(**faults)).columns

    np.testing.assert_allclose(wrong(slope_offset=0.03)["pitch"] - right["pitch"], 0.03)
    np.testing.assert_allclose(wrong(speed_scale=1.05)["vy"], 1.05 * right["vy"])
    np.testing.assert_allclose(
        wrong(power_scale=1.1, power_offset=2.0)["power"], 1.1 * right["power"] + 2.0
    )
    turned = wrong(heading_misalignment=0.1)
    angle = np.arctan2(turned["vy"], turned["vx"]) - np.arctan2(right["vy"], right["vx"])
    moving = np.hypot(right["vx"], right["vy"]) > 0.05
    np.testing.assert_allclose(np.angle(np.exp(1j * (angle - 0.1)))[moving], 0.0, atol=1e-12)
    # A lag of one whole row moves power down by one row within each run.
    late = wrong(delay=0.5)["power"].reshape(4, 60)
    np.testing.assert_allclose(late[:, 1:], right["power"].reshape(4, 60)[:, :-1], rtol=1e-9)
    fewer = wrong(dropouts=0.2, absent=("wind_x", "surface"))
    assert len(fewer["time"]) == pytest.approx(0.8 * 240, abs=20)
    assert "wind_x" not in fewer
    assert "surface" not in fewer


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


def test_designs_tie_what_they_say(rich):
    vehicle = VirtualRobot("minibalance").vehicle
    full = profile("rich", vehicle, seed=1)
    assert full.motion.shape[0] == 24
    assert full.around.shape[1] == 300 * 5
    assert len(full.held_out) == 8
    tied = VirtualRobot("minibalance").drive(
        profile("speed_heats_motor", vehicle, runs=3), noise=QUIET
    )
    pace = np.hypot(tied.columns["vx"], tied.columns["vy"])
    assert np.corrcoef(pace, tied.columns["motor_temp"])[0, 1] > 0.999
    straight = profile("one_heading", vehicle, runs=3)
    assert (straight.motion[:, :, 1:3] == 0.0).all()
    assert (straight.motion[:, :, 0] >= 0.0).all()
    empty = profile("one_load", vehicle, runs=3)
    assert (empty.starts[:, :3] == 0.0).all()
    log = VirtualRobot("minibalance").drive(rich)
    train, held = log.split()
    assert set(held.columns["run"]) == {"run03"}
    assert len(train.columns["time"]) + len(held.columns["time"]) == 240
