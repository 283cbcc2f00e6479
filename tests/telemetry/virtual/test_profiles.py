"""What the virtual robot is asked to drive: designs, slopes, attitudes."""

import numpy as np
import pytest

from planner.errors import InputError
from planner.telemetry.virtual import QUIET, VirtualRobot
from planner.telemetry.virtual.profiles import (
    DESIGNS,
    attitude,
    axes,
    profile,
    steady,
    tilting,
)


@pytest.fixture(scope="module")
def rich():
    """A small rich profile: four runs of 30 s."""
    return VirtualRobot("minibalance", seed=4).profile("rich", runs=4, rows=60)


def test_designs_tie_what_they_say(rich):
    vehicle = VirtualRobot("minibalance").vehicle
    full = profile("rich", vehicle, seed=1)
    assert full.motion.shape[0] == 24
    assert full.conditions.shape[1] == 300 * 5
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


def test_roll_and_pitch_are_those_of_the_plane():
    chance = np.random.default_rng(3)
    p, q = chance.uniform(-0.5, 0.5, (2, 50))
    yaw = chance.uniform(-np.pi, np.pi, 50)
    forward, left = axes(p, q, yaw)
    normal = np.stack([-p, -q, np.ones(50)]) / np.sqrt(1.0 + p**2 + q**2)
    for one, other in ((forward, left), (forward, normal), (left, normal)):
        np.testing.assert_allclose((one * other).sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.arctan2(forward[1], forward[0]), yaw)
    # Intrinsic yaw, pitch, roll (REP-103): third row of the rotation.
    roll, pitch = attitude(p, q, yaw)
    np.testing.assert_allclose(forward[2], -np.sin(pitch))
    np.testing.assert_allclose(left[2], np.cos(pitch) * np.sin(roll), atol=1e-12)
    np.testing.assert_allclose(normal[2], np.cos(pitch) * np.cos(roll))


def test_a_ramp_that_steepens_evenly_tilts_evenly():
    angle = np.linspace(0.0, 0.2, 11)
    found = tilting(np.tan(angle) * 0.6, np.tan(angle) * 0.8)
    np.testing.assert_allclose(found, 0.02 / 0.1)


def test_steady_profiles_take_one_number_a_run():
    drive = steady(vx=[0.1, 0.2, 0.3], roll=0.05, duration=2.0, settings={"payload": [0, 1, 2]})
    assert drive.motion.shape == (3, 21, 5)
    assert (drive.motion == drive.motion[:, :1]).all()
    np.testing.assert_array_equal(drive.motion[:, 0, 0], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(drive.motion[:, 0, 3], 0.05)
    np.testing.assert_array_equal(drive.starts[:, 0], [0, 1, 2])
    some = drive.runs([2, 0])
    assert some.labels == ("run02", "run00")
    np.testing.assert_array_equal(some.motion[:, 0, 0], [0.3, 0.1])


@pytest.mark.parametrize(
    "ask",
    [
        lambda vehicle: profile("poor", vehicle),
        lambda vehicle: profile("rich", vehicle, row=0.25),
        lambda _: steady(settings={"humidity": 0.5}),
    ],
)
def test_what_no_robot_can_be_asked_is_refused(ask):
    with pytest.raises(InputError):
        ask(VirtualRobot("minibalance").vehicle)


@pytest.mark.parametrize("design", DESIGNS)
def test_every_design_stays_within_what_the_robot_can_do(design):
    vehicle = VirtualRobot("minibalance").vehicle
    drive = profile(design, vehicle, seed=2, runs=6, rows=120)
    speed = np.hypot(drive.motion[:, :, 0], drive.motion[:, :, 1])
    assert speed.max() <= vehicle.limits.speed
    assert np.abs(drive.motion[:, :, 2]).max() <= vehicle.limits.yaw_rate
    # Commands change along ramps, from rest.
    assert (drive.motion[:, 0, :3] == 0.0).all()
    assert np.abs(np.diff(drive.motion[:, :, :2], axis=1)).max() / 0.1 < 1.5
    if design == "flat":
        assert (drive.motion[:, :, 3:] == 0.0).all()
    again = profile(design, vehicle, seed=2, runs=6, rows=120)
    np.testing.assert_array_equal(again.motion, drive.motion)
    assert len(drive.held_out) == 2
