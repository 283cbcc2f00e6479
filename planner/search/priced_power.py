"""Least power of driving where force has a price: the local part of the certified lower bound.

While a robot drives, its motors put energy into height and speed. Let every newton that the wheels
supply be paid for at a price velocity Y (J per N·s). What is then left of the electric power,

    Q = min over yaw, yaw rate, forces of   P - Σ_i (y_i·T_i + y'_i·q_i) + friction at these prices,

depends on neither slope nor acceleration: these enter the forces only, and the forces are free. It
is made of conjugate functions of the motors' power. With T the torque of a wheel seen from its
motor, q that of the rotor, s the motor's speed and y = n/r·(rim travel of Y) the price of T,

    P(T, s) = M·s + ρ·M²,   M = h·T + q + c·sgn s,   h = 1/η driving, 2 - 1/η driven,

and the largest y·T - P over T has a closed form (``motor_gain``). Here Y is (μ·v, ν·v) along and
across the travel at the full speed v.

    priced = priced_power(around, steepest)      # a table for one model and its conditions
    priced.watts                                 # (shares, cross shares, 2) W, by μ, ν and load

Q is concave in the prices for every yaw, so linear interpolation in the table errs to the safe
side. It is concave in yaw and yaw rate as well wherever no wheel or roller changes its direction;
the lines where one does are among the points that are looked at. docs/lower-bound.md has the proof.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.power.kernel_math import SLIDING_SPEED
from planner.power.kinematics import LOAD, RIM, ROLLER
from planner.power.model import PowerModel
from planner.power.pipeline import REST_SPEED
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.bound import parameter_value
from planner.search.conditions import Circumstances

Array = NDArray[np.float64]

KNOWN = frozenset(
    (
        *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
        *("copper_loss", "coulomb_drag", "driver_loss", "sensor_rate", "viscous_drag"),
        *("converter_efficiency", "regeneration_limit", "com_offset"),
    )
)
"""Effects whose formulas the bound knows; any other must be at its null values."""
LEVELS = (2.0, 4.0, 9.0, 30.0)
"""Widths of a smooth sign at which it counts as nearer to complete: short of 1 by 1/(2·width²)."""
CLOSE = 10
"""Parts of a step of the yaw angle beside an angle at which a wheel stands."""
ALLOWANCE = 1.0
"""W that turning quicker than the limit is let off, out of what is left at rest."""
RESERVE = 0.3
"""W kept back for speeds and angles between those at which slow motion is looked at."""
EXCESS = 1.1
"""What the acceleration across a bend may be, as a share of the limit (planner.search.speed)."""

# Numbers that the compiled loops read, in this order.
_NAMES = (
    *("geared", "coulomb", "stiffness", "forward", "backward", "rotor_torque"),
    *("rolling", "roller", "roller_viscous", "switching", "weight", "shift_x", "shift_y"),
    *("spin_mass", "speed", "yaw_rate", "quicker", "off_centre", "reach"),
)
_GEARED, _COULOMB, _STIFF, _FORWARD, _BACKWARD, _ROTOR_TORQUE = range(6)
_ROLLING, _ROLLER, _ROLLER_VISCOUS, _SWITCHING, _WEIGHT, _SHIFT_X, _SHIFT_Y = range(6, 13)
_SPIN_MASS, _SPEED, _YAW_RATE, _QUICKER, _OFF_CENTRE, _REACH = range(13, 19)


@njit(cache=True, error_model="numpy", inline="always")
def _branch(y: float, yr: float, s: float, h: float, c: float, rho: float, q: float) -> float:
    """Largest y·T + yr·q' - M·s - ρ·M² over T ≥ 0 and |q'| ≤ q, with M = h·T + q' + c."""
    best = (y / h - s) / (2.0 * rho)
    if best + q - c >= 0.0:
        return rho * best * best - y / h * c + abs(y / h - yr) * q
    # No rotor's torque makes T > 0 worth while.
    m = min(max((yr - s) / (2.0 * rho), c - q), c + q)
    return yr * (m - c) - m * s - rho * m * m


@njit(cache=True, error_model="numpy")
def motor_gain(numbers: Any, y: float, yr: float, s: float, q: float, width: float) -> float:
    """Most that one motor can earn at a price above the power that it draws, W.

    Args:
        numbers: of the model.
        y, yr: rad/s, price of the geared torque, and of the rotor's.
        s: rad/s of the motor, quickened for what viscous drag does to copper.
        q: N·m that its rotor's inertia takes or gives at most.
        width: rad/s by which s may be off.
    """
    c, rho = numbers[_COULOMB], numbers[_STIFF]
    forward, backward = numbers[_FORWARD], numbers[_BACKWARD]
    if s < 0.0:
        y, yr, s = -y, -yr, -s
    gain = -np.inf
    for level in range(len(LEVELS)):
        if s < LEVELS[level] * REST_SPEED - width:
            break
        if level + 1 < len(LEVELS) and s > LEVELS[level + 1] * REST_SPEED + width:
            continue
        short = 0.5 / LEVELS[level] ** 2
        h = forward - (forward - backward) * short
        part = _branch(y, yr, s, h, c * (1.0 - 3.0 * short), rho, q)
        part = max(part, _branch(-y, -yr, -s, backward, -c * (1.0 - 3.0 * short), rho, q))
        part = max(part, _branch(-y, -yr, -s, backward, -c * (1.0 + short), rho, q))
        gain = max(gain, part - numbers[_SWITCHING] * (1.0 - 2.0 * short))
    if s <= LEVELS[0] * REST_SPEED + width:
        gain = max(gain, _gain_near_rest(numbers, y, yr, s, q))
    return gain


@njit(cache=True, error_model="numpy", inline="always")
def _gain_near_rest(numbers: Any, y: float, yr: float, s: float, q: float) -> float:
    """The same for a motor that may stand: static friction and smooth signs help to 1.25·c."""
    rho, c = numbers[_STIFF], numbers[_COULOMB]
    back = y / numbers[_BACKWARD]
    gain: float = abs(back) * c + back * back / (4.0 * rho) + abs(back - yr) * q
    gain = max(gain, abs(back) * (c + q) + (abs(yr) + LEVELS[0] * REST_SPEED) * q)
    for side in (-1.0, 1.0):
        pull = max(0.0, side * (s - back))
        driven = max(-side * back, 0.0) * 1.25 * c + pull * pull / (4.0 * rho)
        gain = max(gain, driven + abs(back - yr) * q)
    return gain


@njit(cache=True, error_model="numpy", inline="always")
def _rubbing(y: float, travel: float, width: float) -> float:
    """Least price times smooth sign of the travel, for dry friction."""
    way = abs(travel)
    price = y if travel > 0.0 else -y
    least = -abs(y) if way <= LEVELS[0] * SLIDING_SPEED + width else np.inf
    for level in range(len(LEVELS)):
        if way < LEVELS[level] * SLIDING_SPEED - width:
            break
        if level + 1 < len(LEVELS) and way > LEVELS[level + 1] * SLIDING_SPEED + width:
            continue
        short = 0.5 / LEVELS[level] ** 2
        least = min(least, price * (1.0 - short) if price > 0.0 else price)
    return least


@njit(cache=True, error_model="numpy")
def _left_over(
    numbers: Any, wheels: Any, yaw: float, prices: Any, rate: float, width: float
) -> tuple[float, float]:
    """W left of the motors' power at one angle of the travel in the body and one yaw rate.

    ``prices`` holds the price along and across the travel, and the same for the rotors. The second
    value is the dry friction's share for the full weight, to be added with the load as factor.
    """
    speed = numbers[_SPEED]
    cx, cy = math.cos(yaw), math.sin(yaw)
    yx, yy = prices[0] * cx - prices[1] * cy, prices[0] * cy + prices[1] * cx
    rx, ry = prices[2] * cx - prices[3] * cy, prices[2] * cy + prices[3] * cx
    # Turning is priced like driving; the prices of both add up to those of a rigid motion.
    y_turn, r_turn = prices[0] / speed * rate, prices[2] / speed * rate
    geared, quicker = numbers[_GEARED], numbers[_QUICKER]
    price = math.hypot(prices[0], prices[1])
    turned = width / speed
    total, bent, even, by_x, by_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(wheels.shape[0]):
        ax, ay, aw = wheels[i, RIM], wheels[i, RIM + 1], wheels[i, RIM + 2]
        bx, by, bw = wheels[i, ROLLER], wheels[i, ROLLER + 1], wheels[i, ROLLER + 2]
        rim, roll = speed * (ax * cx + ay * cy) + aw * rate, speed * (bx * cx + by * cy) + bw * rate
        y_rim, y_roll = ax * yx + ay * yy + aw * y_turn, bx * yx + by * yy + bw * y_turn
        reach = math.sqrt(ax * ax + ay * ay)
        y, s = geared * y_rim, quicker * geared * rim
        wide = quicker * geared * reach * width
        torque = numbers[_ROTOR_TORQUE] * reach
        total -= motor_gain(numbers, y, geared * (ax * rx + ay * ry + aw * r_turn), s, torque, wide)
        # What a concave function of turning vectors bends by between two angles of the table.
        y_most, s_most = geared * reach * price, quicker * geared * reach * speed
        off = y_most * turned / numbers[_BACKWARD] + wide
        force = max(abs(y / numbers[_FORWARD] - s), abs(y / numbers[_BACKWARD] - s)) + off
        if abs(s) <= LEVELS[0] * REST_SPEED + wide:
            force = max(force, abs(y) / numbers[_BACKWARD] + off)
        held = 1.5 * numbers[_COULOMB] + 2.0 * torque
        force = force / (2.0 * numbers[_STIFF]) + held
        bent += force * (y_most / numbers[_BACKWARD] + s_most)
        drag = numbers[_ROLLING] * _rubbing(y_rim, rim, reach * width)
        reach = math.sqrt(bx * bx + by * by)
        drag += numbers[_ROLLER] * _rubbing(y_roll, roll, reach * width)
        bent += 4.0 * numbers[_ROLLER_VISCOUS] * reach * reach * price * speed
        total += numbers[_ROLLER_VISCOUS] * y_roll * roll
        even += wheels[i, LOAD] * drag
        by_x += wheels[i, LOAD + 1] * drag
        by_y += wheels[i, LOAD + 2] * drag
    drag = even - numbers[_SHIFT_X] * abs(by_x) - numbers[_SHIFT_Y] * abs(by_y)
    turning = min(max(rate, -numbers[_YAW_RATE]), numbers[_YAW_RATE])
    # The wheels' own inertia does not keep its direction when the body turns.
    spin = turning * speed * numbers[_SPIN_MASS] * prices[1]
    bent += numbers[_WEIGHT] * price * (numbers[_ROLLING] + numbers[_ROLLER]) * numbers[_REACH]
    total -= turned * turned / 8.0 * bent
    total -= abs(spin) + abs(turning) * numbers[_OFF_CENTRE] * prices[0] / speed
    return total, numbers[_WEIGHT] * drag


@njit(cache=True, error_model="numpy", nogil=True)
def _fill(numbers: Any, wheels: Any, yaws: Any, nodes: Any, loads: Any, table: Any) -> None:
    """Least power (nodes, loads) over all angles and yaw rates."""
    n = wheels.shape[0]
    speed, most = numbers[_SPEED], numbers[_YAW_RATE]
    quick = REST_SPEED / (numbers[_GEARED] * numbers[_QUICKER])
    rates = np.empty(3 + 24 * n * len(LEVELS))
    table[:] = np.inf
    for turn in range(yaws.shape[0]):
        yaw = yaws[turn]
        before = yaw - yaws[turn - 1] if turn > 0 else yaw + math.pi - yaws[-1]
        after = yaws[turn + 1] - yaw if turn + 1 < yaws.shape[0] else yaws[0] + math.pi - yaw
        width = speed * max(before, after)
        cx, cy = math.cos(yaw), math.sin(yaw)
        rates[0], rates[1], rates[2] = -most, 0.0, most
        count = 3
        for i in range(n):
            for first in (RIM, ROLLER):
                slope = wheels[i, first + 2]
                if slope == 0.0:
                    continue
                reach = math.hypot(wheels[i, first], wheels[i, first + 1]) * width
                travel = speed * (wheels[i, first] * cx + wheels[i, first + 1] * cy)
                for level in range(len(LEVELS)):
                    for unit in (SLIDING_SPEED, quick):
                        if unit == quick and first == ROLLER:
                            continue
                        for side in (-1.0, 1.0):
                            for off in (-reach, reach):
                                at = side * (LEVELS[level] * unit + off)
                                rates[count] = (at - travel) / slope
                                count += 1
        for node in range(nodes.shape[0]):
            for k in range(count):
                # Quicker turns only stand for the same ones at lower speed.
                allowed = ALLOWANCE * max(0.0, abs(rates[k]) / most - 1.0)
                left, drag = _left_over(numbers, wheels, yaw, nodes[node], rates[k], width)
                for at in range(loads.shape[0]):
                    value = left + loads[at] * drag + allowed
                    table[node, at] = min(table[node, at], value)


@dataclass(frozen=True)
class PricedPower:
    """Least power at prices, tabulated.

    Attributes:
        shares: (a,) nodes of μ, the price along the travel as a share of the speed.
        cross: (b,) nodes of ν, the price across.
        loads: (2,) nodes of the load as a share of the weight.
        watts: (a, b, 2) W at full speed with everything but what depends on the slope.
        standing: (a, b) W that is left at rest for what changing prices take.
        speed: m/s.
        weight: N.
        moving: kg that speeds up with the body, without the rotors.
        rotors: kg that the rotors stand for.
        efficiency: of the gear; the rotors' price follows from it.
        rotor_slack: W by which Q differs at most for each share that the rotors' price is off.
    """

    shares: Array
    cross: Array
    loads: Array
    watts: Array
    standing: Array
    speed: float
    weight: float
    moving: float
    rotors: float
    efficiency: float
    rotor_slack: float
    centred: bool
    """Whether the centre of mass is known to be in the middle, so that turning lifts nothing."""


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
    around: Circumstances,
    steepest: float,
    *,
    turns: int = 180,
) -> PricedPower | None:
    """The table for a model and its conditions; None where the bound cannot follow the model.

    Args:
        around: model and conditions.
        steepest: largest tan(slope) that is driven.
        turns: steps of the yaw angle in half a turn; there are more where a wheel stands still.
    """
    model = around.model
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
    speed, mass = float(around.limits[0]), around.mass
    yaw_rate = float(around.limits[6]) * (1.0 + 1e-6)
    most = vehicle.limits.acceleration * (1.0 + 1e-6)
    fastest_change = math.hypot(1.0, EXCESS) * most
    cosine = math.cos(math.atan(steepest))
    # Load moves with the slope and with acceleration along and across.
    pull = steepest + math.hypot(1.0, EXCESS) * most / (STANDARD_GRAVITY * cosine)
    offset = np.zeros(2)
    if "com_offset" in acting:
        gain = abs(value("com_offset", "gain"))
        for axis, name in enumerate("xy"):
            known = np.nan_to_num(around.class_rows[:, INDEX[f"com_{name}"]])
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
    numbers = np.array([named[name] for name in _NAMES])
    factors = around.class_rows[:, INDEX["rolling_factor"]]
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
    share, cross = (g.ravel() for g in np.meshgrid(along, across, indexing="ij"))
    nodes = speed * np.column_stack(
        [share, cross, rotor_share(share, efficiency), cross * efficiency]
    )
    table = np.full((len(nodes), len(loads)), np.inf)
    _fill(numbers, wheels, _yaws(wheels, turns), nodes, loads, table)
    idle, at_rest = _idle(around, speed, value), _idle(around, 0.0, value)
    drag = viscous * (1.0 + stiff * viscous) * geared**2 * rims * speed**2
    roll = float((wheels[:, ROLLER : ROLLER + 2] ** 2).sum()) * named["roller_viscous"]
    spent = np.empty(len(nodes))
    _spent_at_rest(numbers, wheels, nodes, float(loads[0]), spent)
    standing = at_rest - drag - 2.5 * roll * speed**2 - ALLOWANCE - RESERVE
    standing -= named["off_centre"] * yaw_rate * along[-1]
    return PricedPower(
        along,
        across,
        loads,
        (table + idle + drag).reshape(*shape, 2),
        standing - spent.reshape(shape),
        speed,
        named["weight"],
        mass + wheel_mass,
        rotor_mass,
        efficiency,
        named["rotor_torque"] * geared * speed * float((reach**2).sum()),
        not offset.any(),
    )


def _idle(around: Circumstances, speed: float, value: Callable[[str, str], float]) -> float:
    """W of electronics and sensors at a speed: concave in it."""
    watts = value("electronics", "power")
    per_sample = value("sensor_rate", "energy_per_sample")
    if per_sample > 0.0:
        rate = float(around.class_rows[0, INDEX["sensor_rate"]])
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
        for part in range(-CLOSE, CLOSE + 1):
            angles.append(np.remainder(still + part / CLOSE * math.pi / turns, math.pi))
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


@njit(cache=True, error_model="numpy")
def _spent_at_rest(numbers: Any, wheels: Any, nodes: Any, load: float, spent: Any) -> None:
    """W (nodes,) by which slow motion, where signs are smooth, may fall short of the straight line
    between nothing at rest and the table at full speed, over a grid of angles, turns and speeds."""
    scaled = numbers.copy()
    node = np.empty(4)
    for n in range(nodes.shape[0]):
        most = 0.0
        for turn in range(24):
            # Round the angles at which wheels or rollers stand, too.
            yaw = (turn // 3) * math.pi / 8.0 + (turn % 3 - 1) * 0.03
            for k in range(3):
                rate = (k - 1) * numbers[_YAW_RATE]
                left, drag = _left_over(numbers, wheels, yaw, nodes[n], rate, 0.0)
                full = left + load * drag
                for part in range(1, 16):
                    t = (part / 16.0) ** 2
                    scaled[_SPEED] = t * numbers[_SPEED]
                    node[:] = t * nodes[n]
                    left, drag = _left_over(scaled, wheels, yaw, node, t * rate, 0.0)
                    most = max(most, (t * full - left - load * drag) / (1.0 - t))
        spent[n] = most
