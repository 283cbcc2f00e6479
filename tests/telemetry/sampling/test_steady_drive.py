"""Speeds of steady drives are averaged, those of motions that change are left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.sampling.steady_drive import at_steady_speeds, stretches
from planner.telemetry.virtual import Noise, VirtualRobot
from tests.telemetry.rows import plain_log

SPEEDS = [INDEX[name] for name in ("vx", "vy", "wz")]
RATES = [INDEX[name] for name in ("ax", "ay", "yaw_acceleration")]
NOISE = np.array([0.001, 0.001, 0.003])


def driven(speeds, runs=1):
    """A log with these velocities (n, 3), odometry's noise on them, in runs of equal length."""
    log = plain_log([len(speeds) // runs] * runs)
    log.rows[:, SPEEDS] = speeds + NOISE * np.random.default_rng(1).standard_normal(speeds.shape)
    return log


def steady(*, rows=60, vx=0.3, vy=-0.1, wz=0.2):
    return np.tile([vx, vy, wz], (rows, 1))


def test_a_steady_drive_has_one_speed_and_the_acceleration_of_its_turn():
    log = driven(steady())
    log = replace(log, present=log.present - {"ax", "ay", "yaw_acceleration"})
    calm = at_steady_speeds(log).rows
    assert calm[:, SPEEDS] == pytest.approx(np.tile(log.rows[:, SPEEDS].mean(0), (60, 1)))
    vx, vy, wz = calm[0, SPEEDS]
    assert calm[:, INDEX["ax"]] == pytest.approx(-wz * vy)
    assert calm[:, INDEX["ay"]] == pytest.approx(wz * vx)
    assert np.all(calm[:, INDEX["yaw_acceleration"]] == 0.0)


def test_a_measured_acceleration_counts_where_the_speed_changes():
    speeds = np.concatenate([steady(rows=20), steady(rows=20)])
    speeds[20:, 0] += 0.3 * np.sin(np.arange(20.0))
    log = driven(speeds)
    log.rows[:, RATES] = 0.01 * np.random.default_rng(2).standard_normal((40, 3))
    log = replace(log, present=log.present | {"ax", "ay", "yaw_acceleration"})
    calm = at_steady_speeds(log)
    vx, vy, wz = calm.rows[:, SPEEDS].T
    along, _, turning = calm.rows[:, RATES].T
    assert along[:19] == pytest.approx(-(wz * vy)[:19], abs=1e-12)
    raw = log.rows[:, SPEEDS].T
    expected = log.rows[:, INDEX["ax"]] + raw[2] * raw[1] - wz * vy
    assert along[21:] == pytest.approx(expected[21:], abs=1e-12)
    assert calm.rows[:, INDEX["ay"]] == pytest.approx(wz * vx, abs=1e-12)
    assert turning == pytest.approx(0.0)
    rest = [k for k in range(log.rows.shape[1]) if k not in SPEEDS + RATES]
    assert np.array_equal(calm.rows[:, rest], log.rows[:, rest], equal_nan=True)
    assert calm.power is log.power


def test_what_cannot_be_told_from_rest_is_rest():
    speeds = steady(vy=0.0, wz=0.0)
    found = at_steady_speeds(driven(speeds)).rows[:, SPEEDS]
    assert np.all(found[:, 1:] == 0.0)
    assert np.all(found[:, 0] > 0.29)
    # Five millimetres a second are a motion: four standard errors of 60 rows are half of one.
    speeds[:, 1] = 0.005
    assert at_steady_speeds(driven(speeds)).rows[:, INDEX["vy"]] == pytest.approx(0.005, abs=5e-4)


def test_noise_that_lasts_is_rest_and_a_slow_swing_is_motion():
    """Rows of 0.05 s: noise behind a filter of 0.1 s is another one four rows later."""
    keep, random = np.exp(-0.05 / 0.1), np.random.default_rng(4)
    speeds = steady(rows=400, vy=0.0)
    for k in range(1, 400):
        speeds[k, 1] = keep * speeds[k - 1, 1] + 0.004 * np.sqrt(1.0 - keep**2) * random.normal()
    lasting = plain_log([400])
    lasting.rows[:, SPEEDS] = speeds
    as_white, as_lasting = (at_steady_speeds(lasting, 4 * k, apart=k).rows for k in (1, 4))
    assert np.mean(as_white[:, INDEX["vy"]] == 0.0) < 0.8
    assert np.mean(as_lasting[:, INDEX["vy"]] == 0.0) > 0.9
    speeds[:, 1] = 0.008 * np.sin(np.arange(400) / 60.0)  # over 19 s
    swinging = at_steady_speeds(driven(speeds), 16, apart=4).rows[:, INDEX["vy"]]
    assert swinging == pytest.approx(speeds[:, 1], abs=0.004)


def test_runs_are_steady_each_by_itself():
    two = driven(np.concatenate([steady(vx=0.300), steady(vx=0.304)]), runs=2)
    found = at_steady_speeds(two).rows[:, INDEX["vx"]]
    means = [two.rows[two.run == k, INDEX["vx"]].mean() for k in (0, 1)]
    assert found == pytest.approx(np.repeat(means, 60))


@pytest.mark.parametrize("rate", [0.0003, 0.001, 0.01])
def test_a_slow_ramp_is_followed_to_within_the_noise(rate):
    speeds = steady()
    speeds[:, 0] += rate * np.arange(60)
    found = at_steady_speeds(driven(speeds)).rows[:, SPEEDS]
    assert np.sqrt(np.mean((found - speeds)[:, 0] ** 2)) < 1.5 * NOISE[0]


def test_a_step_within_the_error_of_odometry_is_seen():
    speeds = steady()
    speeds[30:, 0] += 0.6 * Telemetry.SPEED_ERROR[0]
    found = at_steady_speeds(driven(speeds)).rows[:, INDEX["vx"]]
    assert found[:25] == pytest.approx(speeds[:25, 0], abs=NOISE[0])
    assert found[-25:] == pytest.approx(speeds[-25:, 0], abs=NOISE[0])


def test_a_motion_that_swings_is_left_alone():
    speeds = steady()
    speeds[:, 0] += 0.05 * np.sin(np.arange(60.0))
    log = driven(speeds)
    found = at_steady_speeds(log).rows[:, INDEX["vx"]]
    assert found == pytest.approx(log.rows[:, INDEX["vx"]], abs=0.5 * Telemetry.SPEED_ERROR[0])


def test_a_simulator_without_noise_keeps_its_motion():
    speeds = steady(wz=0.0)
    speeds[:, 1] = 0.004 * np.sin(0.4 * np.arange(60.0))
    log = plain_log([60])
    log.rows[:, SPEEDS] = speeds
    found = at_steady_speeds(log).rows[:, INDEX["vy"]]
    assert np.sqrt(np.mean((found - speeds[:, 1]) ** 2)) < 0.1 * 0.004


def test_what_the_controller_answers_is_no_cause_of_the_power():
    # Bumps that cost power slow the robot by a little; the power does not depend on the speed.
    rng = np.random.default_rng(3)
    levels = np.repeat(rng.uniform(0.1, 0.4, 40), 20)
    bump = rng.standard_normal(800)
    log = plain_log([20] * 40)
    log.rows[:, INDEX["vx"]] = levels - 0.001 * bump
    after = at_steady_speeds(log).rows[:, INDEX["vx"]]

    def slope(speed):
        """W per m/s of the bumps on the speed within runs that are told apart."""
        within = speed - levels
        return (within @ bump) / len(bump) / np.std(bump) / 0.001

    assert slope(log.rows[:, INDEX["vx"]]) == pytest.approx(-1.0, abs=0.05)
    assert abs(slope(after)) < 0.1


def test_each_speed_is_steady_by_itself():
    # A robot that speeds up straight ahead still does not drive sideways.
    speeds = steady(vy=0.0, wz=0.0)
    speeds[:, 0] = 0.2 + 0.15 * np.sin(0.5 * np.arange(60.0))
    log = driven(speeds)
    log = replace(log, present=log.present - {"ax", "ay", "yaw_acceleration"})
    log.rows[:, INDEX["ax"]] = np.gradient(log.rows[:, INDEX["vx"]], 0.5) - np.prod(
        log.rows[:, SPEEDS[1:]], axis=1
    )
    found = at_steady_speeds(log)
    assert np.ptp(found.rows[:, SPEEDS[1:]], axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    swinging = found.rows[:, INDEX["vx"]]
    assert np.sqrt(np.mean((swinging - speeds[:, 0]) ** 2)) < 1.2 * NOISE[0]
    # What the acceleration says of the speed that changes is kept, of the others it is nothing.
    turning = np.prod(found.rows[:, SPEEDS[1:]], axis=1)
    rate = np.gradient(log.rows[:, INDEX["vx"]], 0.5)
    kept = found.rows[:, INDEX["ax"]] + turning
    assert np.all((kept == 0.0) | (np.abs(kept - rate) < 1e-12))
    assert np.count_nonzero(kept == 0.0) < 6  # at the crests at most
    assert found.rows[:, INDEX["ay"]] == pytest.approx(
        found.rows[:, INDEX["wz"]] * swinging, abs=1e-12
    )


def test_stretches_are_the_rows_that_share_a_mean():
    speeds = np.concatenate([steady(rows=20), steady(rows=20)])
    speeds[20:, 0] = 0.5 * np.sin(np.arange(20.0))
    log = at_steady_speeds(driven(speeds))
    number, count, _ = stretches(log, "vx")
    assert np.all(number[:20] == 0)
    assert np.all(count[:20] == 20)
    assert np.array_equal(number[20:], np.arange(1, 21))
    assert np.all(count[20:] == 1)
    assert np.all(stretches(log, "vy")[1] == 40)
    # The same speed in two runs is two stretches.
    number, count, _ = stretches(replace(log, run=np.repeat([0, 1], [10, 30])), "vx")
    assert set(count[:20]) == {10}
    assert number[9] != number[10]


def test_an_empty_log_stays_empty():
    assert len(at_steady_speeds(plain_log([10]).take(slice(0, 0)))) == 0


def test_the_true_model_is_missed_by_less_where_rollers_stand(tmp_path):
    """Odometry's noise sends the rollers of straight drives to and fro, only in the model."""
    robot = VirtualRobot("minibalance", seed=3)
    drive = robot.profile("one_heading", runs=6, rows=100)
    robot.drive(drive, noise=Noise(level=0.01)).write_csv(tmp_path / "ahead.csv")
    log = Telemetry.read(tmp_path / "ahead.csv")
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=())
    as_logged, at_means = (
        float(np.sqrt(np.mean((log.power - predict(model, seen)) ** 2)))
        for seen in (log, at_steady_speeds(log))
    )
    assert at_means < 0.5 * as_logged
