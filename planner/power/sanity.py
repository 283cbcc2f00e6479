"""What a vehicle's file says: derived, assumed, odd, and what the model makes of it.

    report = check_vehicle(load_vehicle("my-robot.toml"))
    report.odd                 # ["copper_loss: 750 W in the windings at 1 m/s on level ground …"]
    report.motions             # level, 5° up, 5° down, sideways

A file can be wrong without being impossible: a torque constant in mN·m/A without its unit makes
a robot that heats its windings with hundreds of watts. Such values show in what a drive needs.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from planner.power.model import PowerModel
from planner.power.rows import gravity_columns, rows_from
from planner.power.vehicles import Vehicle
from planner.quantities import STANDARD_GRAVITY

BUILDING_SLOPE = 5.0
"""Degrees; the steepest ramp that accessible buildings have is 4.8° (1:12)."""
TRIED_SPEEDS = 400
"""Speeds tried up to the motor's no-load speed."""
SLOWEST_DRIVE = 0.02
"""Share of the no-load speed below which nothing drives: dry friction only begins there."""
ROUNDED_UP = 1.01
"""Sizes of a data sheet are rounded: wheels that end so much beyond the body do not count."""
FASTEST_TURN = 4.0 * math.pi
"""rad/s, two turns a second; a larger limit of the yaw rate was meant in degrees."""
ASSUMED = ("assumed", "prior", "estimated", "chosen")
"""First words of a source that is none."""
_MOTIONS = {
    "level": (0.0, 0.0),
    f"{BUILDING_SLOPE:g}° up": (-BUILDING_SLOPE, 0.0),
    f"{BUILDING_SLOPE:g}° down": (BUILDING_SLOPE, 0.0),
    "sideways": (0.0, 90.0),
}
"""Pitch and direction of motion in the body frame, degrees."""


@dataclass(frozen=True)
class Motion:
    """A steady motion at the vehicle's speed limit, or at the fastest speed that it reaches.

    Attributes:
        name: as ``level``.
        speed_m_s: of these figures, m/s.
        power_w: at the supply, W.
        winding_w: of that in the windings of all motors, W.
        current_a: largest of one motor, A.
        torque_share: largest torque of a motor over its continuous one; None without a limit.
        voltage_v: largest at one motor, V.
        reachable_m_s: fastest speed within voltage, current, continuous torque and traction, m/s.
        hours: that a full battery lasts; None where its capacity is not given or power comes back.
    """

    name: str
    speed_m_s: float
    power_w: float
    winding_w: float
    current_a: float
    torque_share: float | None
    voltage_v: float
    reachable_m_s: float
    hours: float | None


@dataclass(frozen=True)
class VehicleReport:
    """What check_vehicle found, in sentences and figures."""

    name: str
    title: str
    derived: tuple[str, ...]
    assumed: tuple[str, ...]
    without_source: tuple[str, ...]
    odd: tuple[str, ...]
    motions: tuple[Motion, ...]

    def document(self) -> dict[str, Any]:
        """Ready for strict JSON."""
        return asdict(self)


def check_vehicle(vehicle: Vehicle) -> VehicleReport:
    """What is derived, assumed and odd in a vehicle, and four motions of it.

    Args:
        vehicle: from load_vehicle.
    """
    model = PowerModel.from_vehicle(vehicle)
    motions = tuple(_motion(model, name, *how) for name, how in _MOTIONS.items())
    assumed = [
        f"{key}: {source}"
        for key, source in vehicle.provenance.sources.items()
        if source.removeprefix(f"motor {vehicle.provenance.motor}: ").lower().startswith(ASSUMED)
    ]
    return VehicleReport(
        name=vehicle.name,
        title=vehicle.title,
        derived=tuple(model.defaults_in_words()),
        assumed=tuple(assumed),
        without_source=vehicle.provenance.without_source,
        odd=tuple(_oddities(model, motions[0], motions[1])),
        motions=motions,
    )


def oddities(model: PowerModel) -> tuple[str, ...]:
    """What is odd in the values of a model's vehicle, in sentences that begin with a key."""
    level, up = (_motion(model, name, *_MOTIONS[name]) for name in list(_MOTIONS)[:2])
    return tuple(_oddities(model, level, up))


def _motion(model: PowerModel, name: str, pitch: float, heading: float) -> Motion:
    vehicle = model.vehicle
    limits, battery = vehicle.limits, vehicle.battery
    speeds = _fastest(vehicle) * np.linspace(SLOWEST_DRIVE, 1.0, TRIED_SPEEDS)
    account = _account(model, speeds, pitch, heading)
    allowed = _allowed(account, vehicle)
    reachable = float(speeds[allowed].max(initial=0.0))
    speed = min(limits.speed, reachable) or limits.speed
    here = {
        key: float(v[0]) for key, v in _account(model, np.array([speed]), pitch, heading).items()
    }
    endless = math.isinf(battery.capacity) or here["supply"] <= 0.0
    torque = here["motor_torque"] / limits.continuous_torque
    return Motion(
        name,
        speed,
        power_w=here["supply"],
        winding_w=here["copper"],
        current_a=here["current"],
        torque_share=None if math.isinf(limits.continuous_torque) else torque,
        voltage_v=here["voltage"],
        reachable_m_s=reachable,
        hours=None if endless else battery.capacity / here["supply"] / 3600.0,
    )


def _account(model: PowerModel, speeds: Any, pitch: float, heading: float) -> dict[str, Any]:
    gravity = gravity_columns(0.0, math.radians(pitch), gravity=STANDARD_GRAVITY)
    angle = math.radians(heading)
    return model.account(
        rows_from(vx=speeds * math.cos(angle), vy=speeds * math.sin(angle), **gravity)
    )


def _fastest(vehicle: Vehicle) -> float:
    """Speed at which the back-EMF takes the whole voltage, m/s."""
    volts = min(vehicle.limits.voltage, vehicle.battery.voltage)
    constant = vehicle.parameters["copper_loss"]["torque_constant"]
    return float(volts / constant / vehicle.gear_ratio * vehicle.layout.radius)


def _oddities(model: PowerModel, level: Motion, up: Motion) -> list[str]:
    vehicle = model.vehicle
    motor, limits, battery = vehicle.parameters["copper_loss"], vehicle.limits, vehicle.battery
    revolutions = battery.voltage / motor["torque_constant"] * 30.0 / math.pi
    stalled = battery.voltage / motor["resistance"]
    rotors = vehicle.parameters["inertia"]["rotor_inertia"] * vehicle.gear_ratio**2
    turning = vehicle.layout.wheel_count * rotors / vehicle.layout.radius**2
    plate = vehicle.mass / 12.0 * (vehicle.length**2 + vehicle.width**2)
    yaw = vehicle.parameters["inertia"]["yaw_inertia"]
    rolling = vehicle.layout.rolling
    light = float(_account(model, np.array([level.speed_m_s]), 0.0, 0.0)["least_load"][0])
    rims = vehicle.layout.radius * np.abs([np.cos(rolling), np.sin(rolling)])
    along, across = (np.abs(vehicle.layout.table[:, :2]).T + rims).max(axis=1)
    floor_load = vehicle.mass / (vehicle.length * vehicle.width)
    # Causes come before what follows from them: a refusal quotes the first.
    findings = {
        f"drive.gear_ratio: {vehicle.gear_ratio:g} revolutions of the motor for one of the wheel; "
        f"is it {1.0 / vehicle.gear_ratio:.4g}?": vehicle.gear_ratio < 1.0,
        f"body.mass: {vehicle.mass:g} kg on {vehicle.length:g} by {vehicle.width:g} m is "
        f"{floor_load:,.0f} kg/m²; usual are 5 to 3,000": not 5.0 <= floor_load <= 3000.0,
        "drive.resistance, drive.torque_constant: "
        f"{level.winding_w:.0f} W of {level.power_w:.0f} W heat the windings "
        f"at {level.speed_m_s:.2g} m/s on level ground; is a unit missing?": (_hot(level)),
        f"drive.torque_constant: {revolutions:,.0f} 1/min without load at {battery.voltage:g} V; "
        "usual are 1,000 to 20,000": not 1000.0 <= revolutions <= 20000.0,
        f"drive.resistance: {stalled:.3g} A at a standstill with {battery.voltage:g} V; usual are "
        "0.5 to 300 A": not 0.5 <= stalled <= 300.0,
        f"limits.speed: {limits.speed:g} m/s, but the drive reaches {level.reachable_m_s:.3g} m/s "
        "on level ground": level.reachable_m_s < limits.speed and light > 0.0,
        f"limits.yaw_rate: {limits.yaw_rate:g} rad/s is {limits.yaw_rate / math.tau:.2g} turns a "
        "second; is it in degrees?": limits.yaw_rate > FASTEST_TURN,
        "wheels: one carries nothing on level ground; the centre of mass is not between them": (
            light <= 0.0
        ),
        f"drive: {BUILDING_SLOPE:g}° up cannot be driven within voltage, current, continuous "
        "torque and traction": up.reachable_m_s == 0.0 < level.reachable_m_s,
        f"drive.rotor_inertia: the rotors act like {turning:.3g} kg, the robot has "
        f"{vehicle.mass:g} kg": turning > 2.0 * vehicle.mass,
        f"body.yaw_inertia: {yaw:.3g} kg·m², a plate of this mass and size has {plate:.3g}": (
            not plate / 4.0 <= yaw <= 4.0 * plate
        ),
        f"body.length: {vehicle.length:g} m, but the wheels end {along:.3g} m from the centre": (
            2.0 * along > ROUNDED_UP * vehicle.length
        ),
        f"body.width: {vehicle.width:g} m, but the wheels end {across:.3g} m from the centre": (
            2.0 * across > ROUNDED_UP * vehicle.width
        ),
        "limits.continuous_torque: not given, so that motors climb however hot they get; "
        f"{up.winding_w:.0f} W of {up.power_w:.0f} W heat the windings {BUILDING_SLOPE:g}° up": (
            math.isinf(limits.continuous_torque) and _hot(up) and not _hot(level)
        ),
        f"wheels.radius: {vehicle.layout.radius:g} m in a body {vehicle.length:g} m long": (
            2.0 * vehicle.layout.radius > vehicle.length
        ),
        f"body.com_height: {vehicle.com_height:g} m is more than the body is long": (
            vehicle.com_height > max(vehicle.length, vehicle.width)
        ),
        f"limits.voltage: {limits.voltage:g} V is more than the battery's {battery.voltage:g} V": (
            battery.voltage < limits.voltage < math.inf
        ),
        f"battery.capacity: a full battery lasts {level.hours or 0.0:.2g} h on level ground; "
        "a number without a unit is in J": (
            level.hours is not None and not 0.1 <= level.hours <= 48.0
        ),
    }
    return [sentence for sentence, holds in findings.items() if holds]


def _hot(motion: Motion) -> bool:
    """Whether most of the power heats the windings, as when a unit of the motor is missing."""
    return motion.winding_w > max(5.0, 0.5 * motion.power_w)


def steepest_slopes(model: PowerModel) -> dict[str, float]:
    """Steepest slopes that a vehicle drives slowly within its limits, tan of the angle.

    Returns:
        "up", the steeper of lengthwise and sideways; "down", the same; 0 where none is driven.
    """
    angles = np.arange(0.5, 45.0, 0.5)
    speed = np.full(len(angles), 0.05 * model.vehicle.limits.speed)
    found = {}
    for name, sign in (("up", -1.0), ("down", 1.0)):
        steepest = 0.0
        for heading in (0.0, 90.0):
            # Sideways the same slope is a roll: the body's y climbs where its x did.
            pitch, roll = (sign * angles, 0.0) if heading == 0.0 else (0.0, -sign * angles)
            gravity = gravity_columns(
                np.radians(roll) + 0.0 * angles, np.radians(pitch), gravity=STANDARD_GRAVITY
            )
            turn = math.radians(heading)
            account = model.account(
                rows_from(vx=speed * math.cos(turn), vy=speed * math.sin(turn), **gravity)
            )
            bad = ~_allowed(account, model.vehicle)
            first = int(bad.argmax()) if bad.any() else len(angles)
            steepest = max(steepest, 0.0 if first == 0 else float(angles[first - 1]))
        found[name] = math.tan(math.radians(steepest))
    return found


def _allowed(account: dict[str, Any], vehicle: Vehicle) -> Any:
    """Where a steady motion keeps the limits of the vehicle, (n,)."""
    limits = vehicle.limits
    return (
        (account["voltage"] <= min(limits.voltage, vehicle.battery.voltage))
        & (account["current"] <= limits.current)
        & (account["motor_torque"] <= limits.continuous_torque)
        & (account["traction_left"] >= 0.0)
        & (account["least_load"] > 0.0)
    )
