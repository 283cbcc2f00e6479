"""Drives, bridges and battery of the virtual robot, motor by motor.

    mesh friction   F_t = share·|T|/n     share 1/η - 1, whichever way the power flows
    shaft torque    T/n + sgn(ω)·(F_t + τ_c) + b·ω + J·dω/dt
                    at rest dry friction carries what it can of the load
    current         I = torque/k_t(T_w)
    terminals       k_t·I·ω + R(T_w)·I²
    battery         V = V_0(charge) - R_b·I_b     with I_b·V the power at the terminals

T is the torque that the hub asks for, ω the motor's speed, n the ratio of the gear. Dry friction
changes sign as tanh(ω/1.5 rad/s). Heat flows winding → housing → air (two nodes, values of a small
ferrite motor).

Left out: inductance, the bridges' switching frequency, motors that differ.
"""

from __future__ import annotations

import math
from typing import Any

from planner.compiled_code import njit

WINDING_CAPACITY = 12.0  # J/K
HOUSING_CAPACITY = 95.0  # J/K
WINDING_TO_HOUSING = 5.0  # K/W
HOUSING_TO_AIR = 14.0  # K/W
REFERENCE_TEMPERATURE = 25.0  # °C, of resistance and torque constant as given
REST_MOTOR_SPEED = 1.5  # rad/s at the motor
EMPTY_SHARE = 0.86  # open-circuit voltage of an empty battery, share of that of a full one

# Columns of what one wheel draws.
CURRENT, VOLTAGE, TERMINAL, COPPER, MESH, FRICTION, DRIVER, REFUSED = range(8)
DRAWS = 8
"""How many columns these are."""


@njit(cache=True)
def drive_wheel(
    chassis: Any,
    hidden: Any,
    hub_torque: float,
    speed: float,
    speed_change: float,
    temperature: float,
    draw: Any,
) -> None:
    """Writes into ``draw`` (DRAWS,) what one motor draws to give ``hub_torque`` at its wheel.

    Args:
        chassis: constants of the robot.
        hidden: strengths of the effects.
        hub_torque: N·m at the wheel.
        speed: rad/s of the motor.
        speed_change: rad/s² of the motor.
        temperature: °C of the winding.
        draw: written.
    """
    motor = chassis.motors
    load = hub_torque / motor.gear_ratio
    share = motor.mesh_friction
    if hub_torque * speed <= 0.0:
        share = min(max(share - hidden.return_change, 0.0), 1.0)
    mesh = share * abs(load)
    idle = 0.0
    if hidden.drag_torque != 0.0:
        idle = hidden.drag_torque / motor.gear_ratio
        idle *= math.exp(-abs(hub_torque) / hidden.fading_torque)
    turning = math.tanh(speed / REST_MOTOR_SPEED)
    rest = 1.0 - abs(turning)
    held = min(max(load, -mesh - motor.coulomb_torque), mesh + motor.coulomb_torque)
    damping = hidden.viscous_torque
    if hidden.viscosity != 0.0:
        cold = REFERENCE_TEMPERATURE - temperature
        damping += hidden.viscosity * math.exp(hidden.temperature_rate * cold)
    own = turning * (motor.coulomb_torque + idle) + damping * speed
    torque = load + turning * mesh + own - rest * held + motor.rotor_inertia * speed_change
    rise = temperature - REFERENCE_TEMPERATURE
    resistance = motor.resistance * (1.0 + hidden.copper_coefficient * rise)
    weaker = hidden.magnet_coefficient * hidden.magnet_share * rise
    constant = motor.torque_constant * (1.0 + weaker)
    current = torque / constant
    copper = resistance * current * current * (1.0 + hidden.ripple_squared)
    terminal = constant * current * speed + copper
    idleness = rest * math.exp(-hub_torque * hub_torque / 1e-4)
    draw[CURRENT] = current
    draw[VOLTAGE] = resistance * current + constant * speed
    draw[TERMINAL] = terminal
    draw[COPPER] = copper
    draw[MESH] = (turning * mesh - rest * held) * speed
    draw[FRICTION] = own * speed
    draw[DRIVER] = (
        hidden.bridge_resistance * current * current
        + hidden.diode_voltage * abs(current)
        + hidden.switching_power * (1.0 - idleness)
    )
    draw[REFUSED] = (hidden.motor_share - 1.0) * min(terminal, 0.0)


@njit(cache=True)
def battery_state(chassis: Any, hidden: Any, watts: float, charge: float) -> tuple[float, float]:
    """Terminal voltage and current while ``watts`` leave the terminals, V and A.

    Args:
        chassis: constants of the robot.
        hidden: strengths of the effects; battery_sag's resistance takes the vehicle's place.
        watts: power at the terminals.
        charge: share that is left.
    """
    full = chassis.supply.voltage
    opened = full * (EMPTY_SHARE + (1.0 - EMPTY_SHARE) * charge)
    inside = hidden.internal_resistance
    if inside == 0.0:
        inside = chassis.supply.resistance
    # V² - V_0·V + R·P = 0; beyond the largest power the voltage stays at half.
    root = max(opened * opened - 4.0 * inside * watts, 0.0)
    voltage = 0.5 * (opened + math.sqrt(root))
    return voltage, watts / voltage
