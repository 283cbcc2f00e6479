"""A second power model, in plain numpy, for one state of a four-wheeled Mecanum robot.

It shares no code and no numbers with ``planner.power``: Mecanum closed forms instead of a pseudo-
inverse, sharp signs instead of smooth ones, wheel by wheel in one pass. Only the robot of the
source paper can be computed, with the numbers of docs/physics.md, section "Parameters".

    wheels  front left, front right, rear left, rear right
    frames  body x forward, y left; gravity is the vector g seen in these axes
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FRONT = np.array([1.0, 1.0, -1.0, -1.0])
LEFT = np.array([1.0, -1.0, 1.0, -1.0])
ROLLER = -FRONT * LEFT  # the roller axle is (1, ROLLER)/√2
YAW = -LEFT
G = 9.80665


@dataclass(frozen=True)
class Robot:
    """Numbers of the robot; SI."""

    mass: float = 12.0
    half_wheelbase: float = 0.214
    half_track: float = 0.247
    radius: float = 0.076
    height: float = 0.12
    yaw_inertia: float = 1.01
    wheel_inertia: float = 0.0023
    rolling: float = 0.035
    roller: float = 0.045
    roller_viscous: float = 0.0
    exponent: float = 0.0
    drag_area: float = 0.0
    air_density: float = 1.2
    ratio: float = 26.85
    efficiency: float = 0.8
    constant: float = 0.0373
    resistance: float = 3.94
    coulomb: float = 4.2e-3
    viscous: float = 2.3e-6
    rotor: float = 3.2e-6
    copper_rise: float = 0.00393
    magnet_rise: float = -0.0020
    bridge: float = 0.03
    switching: float = 0.15
    board: float = 2.5 + 4 * 0.2 + 2.0
    sample: float = 0.02
    slow_rate: float = 10.0
    rate_slope: float = 40.0
    fast_rate: float = 50.0
    converter: float = 0.88
    source_share: float = 0.0


@dataclass(frozen=True)
class State:
    """Motion, slope and load; a and alpha are inertial, offset is the centre of mass."""

    velocity: tuple[float, float, float]
    gravity: tuple[float, float, float] = (0.0, 0.0, G)  # along x, along y, into the surface
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
    offset: tuple[float, float] = (0.0, 0.0)
    payload: float = 0.0
    winding_temp: float = 25.0
    magnet_temp: float = 25.0
    preload: float = 0.0
    wind: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Answer:
    """W, and what every wheel carries (arrays of four)."""

    supply: float
    terminal: float
    shaft: float
    copper: float
    iron: float
    gear: float
    load: Array
    torque: Array
    current: Array


def _sign(speed: Array) -> Array:
    """Sharp sign; what is left of a difference of equal numbers counts as rest."""
    return np.sign(np.where(np.abs(speed) < 1e-9, 0.0, speed))


def evaluate(robot: Robot, state: State) -> Answer:
    """Power of one state."""
    a, b, r = robot.half_wheelbase, robot.half_track, robot.radius
    vx, vy, wz = state.velocity
    ax, ay, alpha = state.acceleration
    gx, gy, gn = state.gravity
    xc, yc = state.offset
    m = robot.mass + state.payload

    spin = (vx + ROLLER * vy + YAW * (a + b) * wz) / r
    # Body velocity changes by what is left of inertial acceleration in turning axes.
    spin_up = (ax + wz * vy + ROLLER * (ay - wz * vx) + YAW * (a + b) * alpha) / r
    slide = np.sqrt(2.0) * (vy + wz * FRONT * a)

    press_x = xc + robot.height * (gx - ax) / gn
    press_y = yc + robot.height * (gy - ay) / gn
    load = m * gn / 4.0 * (1.0 + FRONT * press_x / a + LEFT * press_y / b)
    stiffer = (load / (robot.mass * G / 4.0)) ** robot.exponent

    against = stiffer * (robot.roller * load * _sign(slide) + robot.roller_viscous * slide)
    free_x, free_y = -ROLLER / np.sqrt(2.0), 1.0 / np.sqrt(2.0)
    relative = np.array([vx - state.wind[0], vy - state.wind[1]])
    air = 0.5 * robot.air_density * robot.drag_area * np.hypot(*relative) * relative
    pull_x, pull_y = m * (ax - gx), m * (ay - gy)
    need_x = pull_x + air[0] + np.sum(against * free_x)
    need_y = pull_y + air[1] + np.sum(against * free_y)
    arm = FRONT * a * free_y - LEFT * b * free_x
    need_m = robot.yaw_inertia * alpha + xc * pull_y - yc * pull_x + np.sum(against * arm)

    rim = 0.25 * (need_x + ROLLER * need_y + YAW * need_m / (a + b)) + state.preload * FRONT
    rim_drag = stiffer * robot.rolling * load * _sign(spin)
    torque = r * (rim - against * free_x + rim_drag) + robot.wheel_inertia * spin_up

    driving = torque * spin >= 0.0
    back = 2.0 - 1.0 / robot.efficiency
    teeth = torque / robot.ratio * np.where(driving, 1.0 / robot.efficiency, back)
    motor_spin = robot.ratio * spin
    friction = robot.coulomb * _sign(motor_spin) + robot.viscous * motor_spin
    shaft_torque = teeth + friction + robot.rotor * robot.ratio * spin_up
    constant = robot.constant * (1.0 + robot.magnet_rise * (state.magnet_temp - 25.0))
    ohm = robot.resistance * (1.0 + robot.copper_rise * (state.winding_temp - 25.0))
    current = shaft_torque / constant
    terminal = np.sum(ohm * current**2 + constant * motor_spin * current)
    drivers = np.sum(robot.bridge * current**2 + robot.switching)

    rate = min(robot.slow_rate + robot.rate_slope * np.hypot(vx, vy), robot.fast_rate)
    electronics = (robot.board + robot.sample * rate) / robot.converter
    bus = terminal + drivers + electronics
    return Answer(
        supply=float(bus if bus >= 0.0 else robot.source_share * bus),
        terminal=float(terminal),
        shaft=float(np.sum(torque * spin)),
        copper=float(np.sum(ohm * current**2)),
        iron=float(np.sum(friction * motor_spin)),
        gear=float(np.sum((robot.ratio * teeth - torque) * spin)),
        load=load,
        torque=torque,
        current=current,
    )


def gravity_on(slope_x: float, slope_y: float, yaw: float) -> tuple[float, float, float]:
    """Gravity along body x, body y and into the surface, on a plane of gradient (slope_x, slope_y).

    The body's x axis lies in the plane above the direction ``yaw`` of the map.
    """
    normal = np.array([-slope_x, -slope_y, 1.0]) / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    ahead = np.array([np.cos(yaw), np.sin(yaw), slope_x * np.cos(yaw) + slope_y * np.sin(yaw)])
    ahead /= np.linalg.norm(ahead)
    left = np.cross(normal, ahead)
    return -G * ahead[2], -G * left[2], G * normal[2]
