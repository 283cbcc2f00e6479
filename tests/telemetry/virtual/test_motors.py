"""One motor and the battery, against balances and formulas written out here."""

import math

import numpy as np
import pytest

from planner.telemetry.virtual.chassis import read_vehicle
from planner.telemetry.virtual.hidden import Hidden
from planner.telemetry.virtual.motors import (
    COPPER,
    CURRENT,
    DRAWS,
    DRIVER,
    FRICTION,
    MESH,
    REFERENCE_TEMPERATURE,
    REFUSED,
    TERMINAL,
    VOLTAGE,
    battery_state,
    drive_wheel,
)

_, CHASSIS = read_vehicle("minibalance")
FAST = 80.0  # rad/s, where dry friction has its full size
SOUND = Hidden(wheel_excess=np.zeros(4), surface_excess=np.zeros(3))


def drawn(hub, speed, *, change=0.0, temperature=REFERENCE_TEMPERATURE, **hidden):
    """What one motor draws."""
    draw = np.full(DRAWS, np.nan)
    known = SOUND._replace(**hidden)
    drive_wheel(CHASSIS, known, hub, speed, change, temperature, draw)
    return draw


@pytest.mark.parametrize("hub", [-3.0, -0.2, 0.0, 0.2, 3.0])
@pytest.mark.parametrize("speed", [-FAST, -5.0, -0.4, 0.4, 5.0, FAST])
@pytest.mark.parametrize("temperature", [0.0, 25.0, 80.0])
def test_power_at_the_terminals_goes_to_the_hub_the_rotor_and_heat(hub, speed, temperature):
    hidden = {"viscous_torque": 1e-5, "copper_coefficient": 0.0039, "magnet_coefficient": -0.002}
    change = 7.0
    draw = drawn(hub, speed, change=change, temperature=temperature, **hidden)
    useful = hub / CHASSIS.motors.gear_ratio * speed
    rotor = CHASSIS.motors.rotor_inertia * change * speed
    heat = draw[COPPER] + draw[MESH] + draw[FRICTION]
    assert draw[TERMINAL] == pytest.approx(useful + rotor + heat, rel=1e-12, abs=1e-12)
    assert draw[VOLTAGE] * draw[CURRENT] == pytest.approx(draw[TERMINAL], rel=1e-12, abs=1e-12)
    assert draw[COPPER] >= 0.0
    assert draw[FRICTION] >= 0.0


def test_a_fast_motor_has_the_torque_of_the_closed_form():
    # Driving: load, its loss in the mesh, dry friction.
    hub, n = 2.0, CHASSIS.motors.gear_ratio
    torque = hub / n * (1.0 + CHASSIS.motors.mesh_friction) + CHASSIS.motors.coulomb_torque
    draw = drawn(hub, FAST)
    assert draw[CURRENT] == pytest.approx(torque / CHASSIS.motors.torque_constant)
    assert draw[COPPER] == pytest.approx(CHASSIS.motors.resistance * draw[CURRENT] ** 2)
    # Driven: the mesh takes its share of what comes back.
    torque = -hub / n * (1.0 - CHASSIS.motors.mesh_friction) + CHASSIS.motors.coulomb_torque
    assert drawn(-hub, FAST)[CURRENT] == pytest.approx(torque / CHASSIS.motors.torque_constant)


def test_backwards_is_forwards_turned_round():
    here, there = drawn(1.5, 20.0, change=3.0), drawn(-1.5, -20.0, change=-3.0)
    for place in (CURRENT, VOLTAGE):
        assert there[place] == pytest.approx(-here[place])
    for place in (TERMINAL, COPPER, MESH, FRICTION):
        assert there[place] == pytest.approx(here[place])


def test_friction_holds_a_small_load_at_rest_without_current():
    held = (CHASSIS.motors.coulomb_torque * CHASSIS.motors.gear_ratio) * 0.9
    assert drawn(held, 0.0)[CURRENT] == pytest.approx(0.0, abs=1e-12)
    assert drawn(3.0 * held, 0.0)[CURRENT] > 0.0


def test_a_warm_winding_resists_more():
    cold, warm = (drawn(2.0, FAST, temperature=t, copper_coefficient=0.0039) for t in (25.0, 75.0))
    assert warm[CURRENT] == pytest.approx(cold[CURRENT])
    assert warm[COPPER] / cold[COPPER] == pytest.approx(1.0 + 0.0039 * 50.0)


def test_bridges_lose_by_resistance_and_diode_and_refuse_their_share():
    draw = drawn(2.0, FAST, bridge_resistance=0.1, diode_voltage=0.5)
    assert draw[DRIVER] == pytest.approx(0.1 * draw[CURRENT] ** 2 + 0.5 * abs(draw[CURRENT]))
    assert draw[REFUSED] == 0.0
    back = drawn(-1.5, 4.0 * FAST, motor_share=0.25)
    assert back[TERMINAL] < 0.0
    assert back[REFUSED] == pytest.approx(0.75 * -back[TERMINAL])


@pytest.mark.parametrize("charge", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("watts", [-40.0, 0.0, 60.0])
def test_the_battery_sags_by_its_resistance(charge, watts):
    voltage, current = battery_state(CHASSIS, SOUND, watts, charge)
    assert voltage * current == pytest.approx(watts)
    opened, _ = battery_state(CHASSIS, SOUND, 0.0, charge)
    assert voltage == pytest.approx(opened - CHASSIS.supply.resistance * current)
    assert opened <= CHASSIS.supply.voltage


def test_a_battery_gives_no_more_than_its_largest_power():
    hidden = SOUND._replace(internal_resistance=0.5)
    full, _ = battery_state(CHASSIS, hidden, 0.0, 1.0)
    largest = full**2 / (4.0 * 0.5)
    for watts in (largest, 2.0 * largest):
        voltage, _ = battery_state(CHASSIS, hidden, watts, 1.0)
        assert voltage == pytest.approx(0.5 * full, rel=1e-6)
    assert math.isclose(full, CHASSIS.supply.voltage)
