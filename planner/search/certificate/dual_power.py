"""Least power of driving where force has a price: the local part of the certified lower bound.

While a robot drives, its motors put energy into height and speed. Let every newton that the wheels
supply be paid for at a price velocity Y (J per N·s), its multiplier. The rest of the power,

    Q = min over yaw, yaw rate, forces of   P - Σ_i (y_i·T_i + y'_i·q_i) + friction at these prices,

depends on neither slope nor acceleration: these enter the forces only, and the forces are free. It
is made of conjugate functions of the motors' power. With T the torque of a wheel seen from its
motor, q that of the rotor, s the motor's speed and y = n/r·(rim travel of Y) the price of T,

    P(T, s) = M·s + ρ·M²,   M = h·T + q + c·sgn s,   h = 1/η driving, 2 - 1/η driven,

and the largest y·T - P over T has a closed form (dual_kernel). Here Y is
(μ·v, ν·v) along and across the travel at the full speed v.

    priced = priced_power(conditions, steepest)      # a table for one model and its conditions
    priced.watts                                 # (shares, cross shares, 2) W, by μ, ν and load
    slower_power(priced, parts, turns=72)        # the same at parts of full speed

Q is concave in the prices for every yaw, so linear interpolation in the table errs to the safe
side. It is concave in yaw and yaw rate as well wherever no wheel or roller changes its direction;
the lines where one does are among the points that are looked at. docs/lower-bound.md has the proof.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.power.kinematics import LOAD, RIM, ROLLER
from planner.power.model import PowerModel
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.certificate.dual_kernel import NAMES, fill_table, spent_at_rest
from planner.search.certificate.quick_bound import parameter_value
from planner.search.conditions import OperatingConditions
from planner.search.second_core import CORE

KNOWN = frozenset(
    (
        *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
        *("copper_loss", "coulomb_drag", "driver_loss", "sensor_rate", "viscous_drag"),
        *("converter_efficiency", "regeneration_limit", "com_offset"),
    )
)
"""Effects whose formulas the bound knows; any other must be at its null values."""
STILL_ANGLES = 3
"""Angles to either side of one at which a wheel stands, within a step of the yaw angle."""
ALLOWANCE = 0.5
"""Share of what is left at rest that turning at twice the limit's rate is let off."""
RESERVE = 0.3
"""W kept back for speeds and angles between those at which slow motion is looked at."""
SLOWER_PRICES = (0, 2, 4, 7, 10, 12, 14, 17, 20)
"""Nodes of μ in the tables below full speed; both kinks of the gear are among them."""
NEVER = 1e9
"""W that no motion needs: the allowance of turns that are not looked at."""
SPEED, YAW_RATE = NAMES.index("speed"), NAMES.index("yaw_rate")
EXCESS = 1.1
"""Acceleration across a bend as a share of its limit, at most; see the speed profile."""


class Robot(NamedTuple):
    """Speed and masses of a robot, as compiled loops read them.

    Attributes:
        speed: m/s at most.
        weight: N.
        moving: kg that speeds up with the body, without the rotors.
        rotors: kg that the rotors stand for.
        efficiency: of the gear; the rotors' price follows from it.
        rotor_slack: W by which Q differs at most for each share that the rotors' price is off.
    """

    speed: float
    weight: float
    moving: float
    rotors: float
    efficiency: float
    rotor_slack: float


@dataclass(frozen=True)
class Motors:
    """Numbers that slower tables need as well.

    Attributes:
        numbers, wheels: of the model, as dual_kernel reads them.
        idle: W of electronics and sensors at a speed.
        drag, rolling: W at full speed by which power bends upwards with the speed: viscous drag,
            and at most that of the rollers.
    """

    numbers: Array
    wheels: Array
    idle: Callable[[float], float]
    drag: float
    rolling: float


@dataclass(frozen=True)
class PricedPower:
    """Least power at prices, tabulated.

    Attributes:
        shares: (a,) nodes of μ, the price along the travel as a share of the speed.
        cross: (b,) nodes of ν, the price across.
        loads: (2,) nodes of the load as a share of the weight.
        watts: (a, b, 2) W at full speed with everything but what depends on the slope.
        standing: (a, b) W that is left at rest for what changing prices take.
        robot: speed and masses.
        motors: for slower tables.
        centred: whether the centre of mass is known to be in the middle, so that turning lifts
            nothing.
        acceleration: m/s² at most.
    """

    shares: Array
    cross: Array
    loads: Array
    watts: Array
    standing: Array
    robot: Robot
    motors: Motors
    centred: bool
    acceleration: float


def rotor_share(share: Array, efficiency: float) -> Array:
    """The share of the speed at which the rotors' torque is paid, which stands before the gear."""
    backward = 2.0 - 1.0 / efficiency
    return np.minimum(1.0, share / backward) + np.maximum(0.0, share * efficiency - 1.0)


def _known(model: PowerModel) -> bool:
    """Whether all effects that act are among those that the bound knows."""
    for (effect, _, parameter, _), value in zip(model.slots, model.parameters, strict=True):
        if effect.slug not in KNOWN and parameter.null is not None and value != parameter.null:
            return False
    return all(effect.definition is None for effect in model.effects)


def _even(model: PowerModel) -> bool:
    """Whether the wheels' turning stores as much energy in every direction of travel."""
    rim = model.wheels[:, RIM : RIM + 3]
    stored = rim.T @ rim
    off = [stored[0, 1], stored[0, 2], stored[1, 2], stored[0, 0] - stored[1, 1]]
    return bool(np.abs(off).max() <= 1e-9 * stored[0, 0])


def priced_power(
    conditions: OperatingConditions,
    steepest: float,
    *,
    turns: int = 180,
) -> PricedPower | None:
    """The table for a model and its conditions; None where the bound cannot follow the model.

    Args:
        conditions: model and conditions.
        steepest: largest tan(slope) that is driven.
        turns: steps of the yaw angle in half a turn; there are more where a wheel stands still.
    """
    model = conditions.model
    if model.kind != "sound" or not _known(model) or not _even(model):
        return None
    acting = {effect.slug for effect in model.effects}

    def value(slug: str, name: str) -> float:
        return parameter_value(model, slug, name) if slug in acting else 0.0

    vehicle, wheels = model.vehicle, model.wheels
    geared = vehicle.gear_ratio / vehicle.layout.radius
    efficiency = value("gear_loss", "efficiency")
    stiff = value("copper_loss", "resistance") + value("driver_loss", "bridge_resistance")
    stiff /= value("copper_loss", "torque_constant") ** 2
    coulomb = value("coulomb_drag", "coulomb_torque")
    viscous = value("viscous_drag", "viscous_torque")
    rotor = value("inertia", "rotor_inertia")
    speed, mass = float(conditions.limits[0]), conditions.mass
    yaw_rate = float(conditions.limits[6]) * (1.0 + 1e-6)
    most = vehicle.limits.acceleration * (1.0 + 1e-6)
    fastest_change = math.hypot(1.0, EXCESS) * most
    cosine = math.cos(math.atan(steepest))
    # Load moves with the slope and with acceleration along and across.
    pull = steepest + math.hypot(1.0, EXCESS) * most / (STANDARD_GRAVITY * cosine)
    offset = np.zeros(2)
    if "com_offset" in acting:
        gain = abs(value("com_offset", "gain"))
        for axis, name in enumerate("xy"):
            known = np.nan_to_num(conditions.class_rows[:, INDEX[f"com_{name}"]])
            offset[axis] = gain * float(np.abs(known).max())
            offset[axis] += math.sqrt(value("com_offset", f"offset_{name}_squared"))
    shift = offset + vehicle.com_height * pull
    reach = np.hypot(wheels[:, RIM], wheels[:, RIM + 1])
    rolling = np.hypot(wheels[:, ROLLER], wheels[:, ROLLER + 1])
    slide = max(float(reach.max()), float(rolling.max()))
    quicker = 1.0 + 2.0 * stiff * viscous
    # A metre turns the wheels by as much in every direction.
    rims = float((reach**2).sum()) / 2.0
    wheel_mass = rims * value("inertia", "wheel_inertia") / vehicle.layout.radius**2
    rotor_mass = rims * rotor * geared**2
    backward = 2.0 - 1.0 / efficiency
    lightest = wheels[:, LOAD] - np.abs(wheels[:, LOAD + 1 : LOAD + 3]) @ shift
    if backward < 0.1 or lightest.min() < 0.0:
        return None
    named = {
        "geared": geared,
        "coulomb": coulomb,
        "stiffness": stiff,
        "forward": 1.0 / efficiency,
        "backward": backward,
        "rotor_torque": rotor * geared * (fastest_change + yaw_rate * speed),
        "rolling": value("wheel_rolling", "rolling"),
        "roller": value("roller_drag", "roller"),
        "roller_viscous": value("roller_drag", "roller_viscous"),
        "switching": value("driver_loss", "switching_power"),
        "weight": mass * STANDARD_GRAVITY,
        "shift_x": float(shift[0]),
        "shift_y": float(shift[1]),
        "spin_mass": wheel_mass + rotor_mass,
        "speed": speed,
        "yaw_rate": yaw_rate,
        "quicker": quicker,
        "off_centre": mass * float(np.hypot(*offset)) * (STANDARD_GRAVITY * pull),
        # Loads on all wheels add up to the weight, and shift by no more than once again.
        "reach": 2.0 * slide,
    }
    numbers = np.array([named[name] for name in NAMES])
    factors = conditions.class_rows[:, INDEX["rolling_factor"]]
    loads = np.array([float(factors.min()) * cosine, float(factors.max())])
    # Nodes at the prices at which driven and driving gears are paid off.
    forward = 1.0 / efficiency
    along = np.concatenate(
        [
            np.linspace(0.3 * backward, backward, 5),
            np.linspace(backward, forward, 7)[1:],
            forward * np.linspace(1.0, 1.8, 11)[1:],
        ]
    )
    across = 0.4 * np.linspace(0.0, 1.0, 10) ** 1.5
    if not _mirrored(wheels):
        across = np.concatenate([-across[:0:-1], across])
    shape = (len(along), len(across))
    nodes = _nodes(along, across, speed, efficiency)
    idle = partial(_idle, conditions, value)
    drag = viscous * (1.0 + stiff * viscous) * geared**2 * rims * speed**2
    roll = float((wheels[:, ROLLER : ROLLER + 2] ** 2).sum()) * named["roller_viscous"]
    roll *= speed**2 * float(along[-1] + across[-1])
    standing = np.empty(len(nodes))
    spent_at_rest(numbers, wheels, nodes, float(loads[0]), standing)
    standing = idle(0.0) - drag - roll - RESERVE - standing
    standing -= named["off_centre"] * yaw_rate * along[-1]
    allowances = ALLOWANCE * np.maximum(standing, 0.0)
    table = _least(numbers, wheels, turns, 0.0, nodes, allowances, loads)
    rotor_slack = named["rotor_torque"] * geared * speed * float((reach**2).sum())
    return PricedPower(
        along,
        across,
        loads,
        (table + idle(speed) + drag).reshape(*shape, 2),
        (standing - allowances).reshape(shape),
        Robot(speed, named["weight"], mass + wheel_mass, rotor_mass, efficiency, rotor_slack),
        Motors(numbers, wheels, idle, drag, roll),
        not offset.any(),
        most,
    )


def _nodes(along: Array, across: Array, speed: float, efficiency: float) -> Array:
    """Prices (nodes, 4) along and across, and of the rotors, at a speed."""
    share, cross = (g.ravel() for g in np.meshgrid(along, across, indexing="ij"))
    rotors = rotor_share(share, efficiency), cross * efficiency
    return speed * np.column_stack([share, cross, *rotors])


def _least(
    numbers: Array,
    wheels: Array,
    turns: int,
    spread: float,
    nodes: Array,
    allowances: Array,
    loads: Array,
) -> Array:
    """Least power (nodes, loads) of the motors, on two cores."""
    halves = np.empty((2, len(nodes), len(loads)))
    common = numbers, wheels, _yaws(wheels, turns)
    rest = nodes, allowances, loads
    CORE.all([partial(fill_table, *common, k, spread, *rest, halves[k]) for k in range(2)])
    return np.asarray(halves.min(axis=0))


@dataclass(frozen=True)
class SlowerPower:
    """Least power at prices below full speed.

    Attributes:
        shares, cross: nodes of the prices, some of those at full speed.
        watts: (parts, a, b, 2) W; between two parts it is not below the straight line.
    """

    shares: Array
    cross: Array
    watts: Array


def slower_power(priced: PricedPower, parts: Sequence[float], *, turns: int) -> SlowerPower:
    """The table at parts of full speed.

    Args:
        priced: the table at full speed.
        parts: rising shares of full speed, first 0, then each below twice the one before.
        turns: steps of the yaw angle in half a turn.
    """
    shares, cross = priced.shares[list(SLOWER_PRICES)], priced.cross[::3]
    robot, motors = priced.robot, priced.motors
    shape = len(shares), len(cross), 2
    # Between rest and the first part a turn may be quicker than the limit allows there.
    quick = ALLOWANCE * motors.idle(0.0)
    found = [np.full(shape, motors.idle(0.0) - quick)]
    for k in range(1, len(parts)):
        before, part, after = parts[k - 1], parts[k], parts[min(k + 1, len(parts) - 1)]
        change = max(after - part, part - before)
        numbers = motors.numbers.copy()
        numbers[SPEED] *= part
        if k > 1:
            # A turn at the limit's rate becomes quicker with the speed on the same bend.
            numbers[YAW_RATE] *= part / before
        nodes = _nodes(shares, cross, part * robot.speed, robot.efficiency)
        let_off = np.full(len(nodes), quick if k == 1 else NEVER)
        watts = _least(numbers, motors.wheels, turns, change / part, nodes, let_off, priced.loads)
        bent = part**2 * motors.drag - change**2 / 4.0 * (motors.drag + motors.rolling)
        watts += motors.idle(part * robot.speed) + bent
        found.append(watts.reshape(shape))
    return SlowerPower(shares, cross, np.array(found))


def _idle(
    conditions: OperatingConditions, value: Callable[[str, str], float], speed: float
) -> float:
    """W of electronics and sensors at a speed: concave in it."""
    watts = value("electronics", "power")
    per_sample = value("sensor_rate", "energy_per_sample")
    if per_sample > 0.0:
        rate = float(conditions.class_rows[0, INDEX["sensor_rate"]])
        if math.isnan(rate):
            rate = (
                value("sensor_rate", "base_rate") + value("sensor_rate", "rate_per_speed") * speed
            )
            rate = min(rate, value("sensor_rate", "top_rate"))
        watts += per_sample * rate
    efficiency = value("converter_efficiency", "efficiency")
    return watts / efficiency if efficiency > 0.0 else watts


def _yaws(wheels: Array, turns: int) -> Array:
    """Angles of the travel in the body over half a turn, close where a wheel or roller stands."""
    angles = [math.pi * np.arange(turns) / turns]
    for first in (RIM, ROLLER):
        still = np.arctan2(-wheels[:, first], wheels[:, first + 1])
        for part in range(-STILL_ANGLES, STILL_ANGLES + 1):
            angles.append(np.remainder(still + part / STILL_ANGLES * math.pi / turns, math.pi))
    found = np.sort(np.concatenate(angles))
    return np.asarray(found[np.append(True, np.diff(found) > 1e-9)])


def _mirrored(wheels: Array) -> bool:
    """Whether the layout looks the same in a mirror along the body."""
    columns = wheels[:, [RIM, RIM + 1, RIM + 2, ROLLER, ROLLER + 1, ROLLER + 2]]
    seen = columns * [1.0, -1.0, -1.0, 1.0, -1.0, -1.0]

    def alike(a: Array, b: Array) -> bool:
        signs = ([p, p, p, r, r, r] for p in (1.0, -1.0) for r in (1.0, -1.0))
        return any(np.allclose(a, b * sign, atol=1e-12) for sign in signs)

    return all(any(alike(a, b) for b in seen) for a in columns)
