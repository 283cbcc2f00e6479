"""What the virtual robot is made of: masses, wheels, motors and battery, from a vehicle's TOML.

Only numbers are taken over. How wheels and rollers turn, how the suspension carries the robot and
how contacts share a force is worked out here from the places and axles of the wheels:

    ground velocity under hub i      c = (vx - wz·y, vy + wz·x)
    wheel and roller                 c = s·e + u·p      e rolling direction, p free direction
    so, with z-components of cross products
    rim speed                        s = (c × p)/(e × p)
    roller speed                     u = (e × c)/(e × p)

Suspension: the chassis is a plane on n equal springs, so N_i = k·(z0 + z1·x_i + z2·y_i), with z
from equilibrium of force and moments. Contacts: n equal tangential springs along the roller axles
displaced by a common rigid motion δ, f_i = W_i·δ with Σ f_i·W_iᵀ = resultant; the stiffness
cancels. With four wheels one pattern of forces is left that moves nothing (``fight``).

Left out: unequal springs, wheel contact that wanders from roller to roller.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Array
from planner.power.vehicles import Vehicle, load_vehicle, wheel_values


class Body(NamedTuple):
    """Masses in kg, kg·m², m; (3, 3) plane of the springs from weight and its two moments."""

    mass: float
    yaw_inertia: float
    com_height: float
    spring_plane: Array


class Wheels(NamedTuple):
    """Radius in m, kg·m² of one wheel, and (n,) places of the hubs.

    ``rim`` and ``spin`` are (n, 3): speed of the rim, and of the contact roller's surface, for a
    body velocity (vx, vy, wz).
    """

    radius: float
    inertia: float
    x: Array
    y: Array
    rim: Array
    spin: Array


class Contacts(NamedTuple):
    """Drag coefficients, and how contacts share a force.

    Attributes:
        pull, drag: (n, 3) force and moment on the body of one newton along the roller's axle, and
            along its free direction.
        axle_on_rim, drag_on_rim: (n,) part of such a newton that the hub's torque has to hold.
        stiffness: (3, 3) rigid motion of the contacts from the resultant.
        fight: (n,) force along each roller's axle that adds up to nothing, one newton at the rim.
    """

    rolling: float
    roller: float
    roller_viscous: float
    pull: Array
    drag: Array
    axle_on_rim: Array
    drag_on_rim: Array
    stiffness: Array
    fight: Array


class Motors(NamedTuple):
    """One motor with its gear; ``even_heat`` gives all of them one temperature."""

    gear_ratio: float
    mesh_friction: float
    torque_constant: float
    resistance: float
    rotor_inertia: float
    coulomb_torque: float
    highest_voltage: float
    highest_current: float
    even_heat: bool


class Supply(NamedTuple):
    """W of the electronics; V, Ω and C of the battery."""

    electronics: float
    voltage: float
    resistance: float
    charge: float


class Chassis(NamedTuple):
    """Constants of one robot, SI."""

    body: Body
    wheels: Wheels
    contacts: Contacts
    motors: Motors
    supply: Supply


def build_chassis(vehicle: Vehicle, wheels: dict[str, Any], *, even_heat: bool) -> Chassis:
    """The chassis of a vehicle.

    Args:
        vehicle: its checked numbers.
        wheels: the table [wheels] of its TOML in SI, from wheel_values.
        even_heat: whether all motors share one temperature.
    """
    places, directions, axles = _wheels(wheels)
    n = len(places)
    free = np.stack([-axles[:, 1], axles[:, 0]], axis=1)
    ground = np.zeros((n, 2, 3))  # velocity of the ground point under a hub, per (vx, vy, wz)
    ground[:, 0, 0] = ground[:, 1, 1] = 1.0
    ground[:, 0, 2], ground[:, 1, 2] = -places[:, 1], places[:, 0]
    lever = _cross(directions, free)[:, None]
    rim = (ground[:, 0] * free[:, 1:] - ground[:, 1] * free[:, :1]) / lever
    spin = (directions[:, :1] * ground[:, 1] - directions[:, 1:] * ground[:, 0]) / lever
    pull = np.einsum("nk,nkj->nj", axles, ground)
    drag = np.einsum("nk,nkj->nj", free, ground)
    on_rim = np.sum(axles * directions, axis=1)
    plane = np.column_stack([np.ones(n), places])

    def number(slug: str, name: str) -> float:
        return float(vehicle.parameters[slug][name])

    springs = np.linalg.inv(plane.T @ plane)
    body = Body(vehicle.mass, number("inertia", "yaw_inertia"), vehicle.com_height, springs)
    hubs = Wheels(
        radius=_number(wheels, "radius"),
        inertia=number("inertia", "wheel_inertia"),
        x=np.ascontiguousarray(places[:, 0]),
        y=np.ascontiguousarray(places[:, 1]),
        rim=np.ascontiguousarray(rim),
        spin=np.ascontiguousarray(spin),
    )
    contacts = Contacts(
        rolling=number("wheel_rolling", "rolling"),
        roller=number("roller_drag", "roller"),
        roller_viscous=number("roller_drag", "roller_viscous"),
        pull=np.ascontiguousarray(pull),
        drag=np.ascontiguousarray(drag),
        axle_on_rim=on_rim,
        drag_on_rim=np.sum(free * directions, axis=1),
        stiffness=np.linalg.inv(pull.T @ pull),
        fight=_fighting_pattern(pull, on_rim),
    )
    motors = Motors(
        gear_ratio=vehicle.gear_ratio,
        mesh_friction=1.0 / number("gear_loss", "efficiency") - 1.0,
        torque_constant=number("copper_loss", "torque_constant"),
        resistance=number("copper_loss", "resistance"),
        rotor_inertia=number("inertia", "rotor_inertia"),
        coulomb_torque=number("coulomb_drag", "coulomb_torque"),
        highest_voltage=vehicle.limits.voltage,
        highest_current=vehicle.limits.current,
        even_heat=even_heat,
    )
    battery = vehicle.battery
    charge = battery.capacity / battery.voltage
    supply = Supply(number("electronics", "power"), battery.voltage, battery.resistance, charge)
    return Chassis(body, hubs, contacts, motors, supply)


def read_vehicle(name: str, *, even_heat: bool = False) -> tuple[Vehicle, Chassis]:
    """Vehicle and chassis of an installed name or a TOML file.

    Raises:
        VehicleError: there is no such vehicle, or its file cannot be used.
    """
    vehicle = load_vehicle(name)
    return vehicle, build_chassis(vehicle, wheel_values(name), even_heat=even_heat)


def _number(table: dict[str, Any], key: str, default: float = math.nan) -> float:
    return float(table.get(key, default))


def _wheels(table: dict[str, Any]) -> tuple[Array, Array, Array]:
    """Place, rolling direction and roller axle of every wheel, each (n, 2)."""
    if table["layout"] == "mecanum":
        a, b = _number(table, "half_wheelbase"), _number(table, "half_track")
        angle = _number(table, "roller_angle", math.pi / 4)
        corners = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)], dtype=float)
        # Lines of the contact rollers' axles pass round the centre like an O.
        axles = np.column_stack(
            [np.full(4, math.sin(angle)), -corners[:, 0] * corners[:, 1] * math.cos(angle)]
        )
        return corners * (a, b), np.tile([1.0, 0.0], (4, 1)), axles
    bearing = np.array(table["angles"], dtype=float)
    angle = _number(table, "roller_angle", math.pi / 2)
    outward = np.column_stack([np.cos(bearing), np.sin(bearing)])
    tangent = np.column_stack([-np.sin(bearing), np.cos(bearing)])
    axles = math.sin(angle) * tangent + math.cos(angle) * outward
    return _number(table, "base_radius") * outward, tangent, axles


def _cross(u: Array, v: Array) -> Array:
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def _fighting_pattern(pull: Array, on_rim: Array) -> Array:
    """Cofactors of the 4 × 3 table of pulls: orthogonal to each of its columns."""
    if len(pull) != 4:
        return np.zeros(len(pull))
    pattern = np.array(
        [(-1) ** i * np.linalg.det(np.delete(pull, i, axis=0)) for i in range(4)], dtype=float
    )
    largest = np.abs(pattern * on_rim).max()
    return pattern / largest if largest > 0.0 else pattern
