"""The robot's geometry, against places and axles of its wheels."""

import math

import numpy as np
import pytest

from planner.telemetry.virtual.chassis import read_vehicle

ROBOTS = {name: read_vehicle(name) for name in ("minibalance", "robotino")}


def test_rolling_forward_turns_no_roller_of_an_ordinary_wheel():
    _, chassis = ROBOTS["minibalance"]
    # Mecanum forward: every rim runs at the robot's speed, and every roller stands.
    np.testing.assert_allclose(chassis.wheels.rim @ [0.5, 0.0, 0.0], 0.5)
    np.testing.assert_allclose(chassis.wheels.spin @ [0.5, 0.0, 0.0], 0.0, atol=1e-12)
    # Sideways: as fast, with opposite signs on the two diagonals.
    rims = chassis.wheels.rim @ [0.0, 0.5, 0.0]
    np.testing.assert_allclose(np.abs(rims), 0.5)
    np.testing.assert_allclose(rims[[0, 1]], -rims[[2, 3]])
    # Turning: half the sum of wheelbase and track is the lever.
    lever = np.abs(chassis.wheels.x) + np.abs(chassis.wheels.y)
    np.testing.assert_allclose(np.abs(chassis.wheels.rim @ [0.0, 0.0, 1.0]), lever)


def test_an_omni_robot_turns_with_all_rims_alike():
    _, chassis = ROBOTS["robotino"]
    rims = chassis.wheels.rim @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(rims, np.hypot(chassis.wheels.x, chassis.wheels.y))
    # Velocities of the three sides add up to nothing.
    assert (chassis.wheels.rim @ [0.3, 0.4, 0.0]).sum() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_work_of_a_contact_force_is_that_of_rim_and_roller(name):
    """A force on the body does the work that hub torque and rollers do at their own speeds."""
    _, chassis = ROBOTS[name]
    velocity = np.array([0.3, -0.2, 0.7])
    rim, spin = chassis.wheels.rim @ velocity, chassis.wheels.spin @ velocity
    # Along the axle the free direction does no work.
    np.testing.assert_allclose(chassis.contacts.pull @ velocity, chassis.contacts.axle_on_rim * rim)
    np.testing.assert_allclose(
        chassis.contacts.drag @ velocity, chassis.contacts.drag_on_rim * rim + spin
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_springs_carry_weight_and_its_moments(name):
    _, chassis = ROBOTS[name]
    weight, mx, my = 120.0, 5.0, -3.0
    plane = chassis.body.spring_plane @ [weight, mx, my]
    loads = plane[0] + plane[1] * chassis.wheels.x + plane[2] * chassis.wheels.y
    assert loads.sum() == pytest.approx(weight)
    assert loads @ chassis.wheels.x == pytest.approx(mx)
    assert loads @ chassis.wheels.y == pytest.approx(my)


@pytest.mark.parametrize("name", ROBOTS)
def test_contacts_share_a_force_like_springs(name):
    _, chassis = ROBOTS[name]
    wanted = np.array([20.0, -7.0, 3.0])
    forces = chassis.contacts.pull @ (chassis.contacts.stiffness @ wanted)
    np.testing.assert_allclose(chassis.contacts.pull.T @ forces, wanted)
    # Of all ways to share, that of least squares.
    other = forces + 0.5 * chassis.contacts.fight
    np.testing.assert_allclose(chassis.contacts.pull.T @ other, wanted, atol=1e-9)
    assert np.linalg.norm(other) >= np.linalg.norm(forces)


def test_wheels_that_fight_move_nothing():
    _, chassis = ROBOTS["minibalance"]
    np.testing.assert_allclose(chassis.contacts.fight @ chassis.contacts.pull, 0.0, atol=1e-12)
    assert np.abs(chassis.contacts.fight * chassis.contacts.axle_on_rim).max() == pytest.approx(1.0)
    assert not ROBOTS["robotino"][1].contacts.fight.any()


def test_mesh_friction_follows_from_the_efficiency():
    vehicle, chassis = ROBOTS["minibalance"]
    efficiency = vehicle.parameters["gear_loss"]["efficiency"]
    assert 1.0 / (1.0 + chassis.motors.mesh_friction) == pytest.approx(efficiency)
    charge = chassis.supply.charge * chassis.supply.voltage
    assert math.isclose(charge, vehicle.battery.capacity)
