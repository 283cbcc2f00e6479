"""The compiled part of dual_power: conjugates of motors' power, in closed form.

    fill_table(numbers, wheels, yaws, first, nodes, ..., table)    # least power by prices and load
    spent_at_rest(numbers, wheels, nodes, load, spent)         # by how much slow motion falls short

``numbers`` are those that NAMES lists; dual_power explains them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.compiled_code import njit
from planner.power.kernel_math import REST_SPEED, SLIDING_SPEED
from planner.power.kinematics import LOAD, RIM, ROLLER

LEVELS = (2.0, 4.0, 9.0, 30.0)
"""Widths of a smooth sign from which it is known to be closer to 1: short of it by 1/(2·width²)."""
NAMES = (
    *("geared", "coulomb", "stiffness", "forward", "backward", "rotor_torque"),
    *("rolling", "roller", "roller_viscous", "switching", "weight", "shift_x", "shift_y"),
    *("spin_mass", "speed", "yaw_rate", "quicker", "off_centre", "reach"),
)
"""Numbers that the compiled loops read, in this order."""
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
def motor_gain(
    numbers: Any, y: float, yr: float, s: float, q: float, width: float, spread: float
) -> float:
    """Most that one motor can earn at a price above the power that it draws, W.

    Args:
        numbers: of the model.
        y, yr: rad/s, price of the geared torque, and of the rotor's.
        s: rad/s of the motor, quickened for what viscous drag does to copper.
        q: N·m that its rotor's inertia takes or gives at most.
        width: rad/s by which s may be off.
        spread: share of s by which it may be off besides.
    """
    c, rho = numbers[_COULOMB], numbers[_STIFF]
    forward, backward = numbers[_FORWARD], numbers[_BACKWARD]
    if s < 0.0:
        y, yr, s = -y, -yr, -s
    gain = -np.inf
    for level in range(len(LEVELS)):
        if s * (1.0 + spread) < LEVELS[level] * REST_SPEED - width:
            break
        if level + 1 < len(LEVELS) and s * (1.0 - spread) > LEVELS[level + 1] * REST_SPEED + width:
            continue
        short = 0.5 / LEVELS[level] ** 2
        h = forward - (forward - backward) * short
        part = _branch(y, yr, s, h, c * (1.0 - 3.0 * short), rho, q)
        part = max(part, _branch(-y, -yr, -s, backward, -c * (1.0 - 3.0 * short), rho, q))
        part = max(part, _branch(-y, -yr, -s, backward, -c * (1.0 + short), rho, q))
        gain = max(gain, part - numbers[_SWITCHING] * (1.0 - 2.0 * short))
    if s * (1.0 - spread) <= LEVELS[0] * REST_SPEED + width:
        gain = max(gain, _gain_near_rest(numbers, y, yr, s, q))
    return gain


@njit(cache=True, error_model="numpy", inline="always")
def _gain_near_rest(numbers: Any, y: float, yr: float, s: float, q: float) -> float:
    """``motor_gain`` of a motor that may stand: static friction and smooth signs help to 1.25·c."""
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
def _rubbing(y: float, travel: float, width: float, spread: float) -> float:
    """Least price times smooth sign of the travel, for dry friction."""
    slow, quick = abs(travel) * (1.0 - spread) - width, abs(travel) * (1.0 + spread) + width
    price = y if travel > 0.0 else -y
    least = -abs(y) if slow <= LEVELS[0] * SLIDING_SPEED else np.inf
    for level in range(len(LEVELS)):
        if quick < LEVELS[level] * SLIDING_SPEED:
            break
        if level + 1 < len(LEVELS) and slow > LEVELS[level + 1] * SLIDING_SPEED:
            continue
        short = 0.5 / LEVELS[level] ** 2
        least = min(least, price * (1.0 - short) if price > 0.0 else price)
    return least


@njit(cache=True, error_model="numpy")
def _reaches(wheels: Any) -> Any:
    """Travel of each wheel's rim and rollers for a metre at most, (wheels, 2)."""
    reaches = np.empty((wheels.shape[0], 2))
    for i in range(wheels.shape[0]):
        reaches[i, 0] = math.hypot(wheels[i, RIM], wheels[i, RIM + 1])
        reaches[i, 1] = math.hypot(wheels[i, ROLLER], wheels[i, ROLLER + 1])
    return reaches


@njit(cache=True, error_model="numpy")
def _left_over(
    numbers: Any,
    wheels: Any,
    reaches: Any,
    cx: float,
    cy: float,
    prices: Any,
    rate: float,
    turned: float,
    spread: float,
) -> tuple[float, float]:
    """W left of the motors' power at one direction of travel in the body and one yaw rate.

    ``reaches`` are those of the wheels, cx and cy the direction. ``prices`` holds the price along
    and across the travel, and the same for the rotors. The direction may be off by ``turned``, rad,
    and speeds by the share ``spread``. The second value is the dry friction's share for the full
    weight, to be added with the load as factor.
    """
    speed = numbers[_SPEED]
    yx, yy = prices[0] * cx - prices[1] * cy, prices[0] * cy + prices[1] * cx
    rx, ry = prices[2] * cx - prices[3] * cy, prices[2] * cy + prices[3] * cx
    # Turning is priced like driving; the prices of both add up to those of a rigid motion.
    y_turn, r_turn = prices[0] / speed * rate, prices[2] / speed * rate
    geared, quicker = numbers[_GEARED], numbers[_QUICKER]
    price = math.hypot(prices[0], prices[1])
    width = speed * turned
    total, bent, even, by_x, by_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(wheels.shape[0]):
        ax, ay, aw = wheels[i, RIM], wheels[i, RIM + 1], wheels[i, RIM + 2]
        bx, by, bw = wheels[i, ROLLER], wheels[i, ROLLER + 1], wheels[i, ROLLER + 2]
        rim, roll = speed * (ax * cx + ay * cy) + aw * rate, speed * (bx * cx + by * cy) + bw * rate
        y_rim, y_roll = ax * yx + ay * yy + aw * y_turn, bx * yx + by * yy + bw * y_turn
        reach = reaches[i, 0]
        y, s = geared * y_rim, quicker * geared * rim
        wide = quicker * geared * reach * width
        torque = numbers[_ROTOR_TORQUE] * reach
        y_rotor = geared * (ax * rx + ay * ry + aw * r_turn)
        total -= motor_gain(numbers, y, y_rotor, s, torque, wide, spread)
        # What a concave function of turning vectors bends by between two angles of the table.
        y_most, s_most = geared * reach * price, quicker * geared * reach * speed
        off = y_most * turned / numbers[_BACKWARD] + wide
        force = max(abs(y / numbers[_FORWARD] - s), abs(y / numbers[_BACKWARD] - s)) + off
        if abs(s) <= LEVELS[0] * REST_SPEED + wide:
            force = max(force, abs(y) / numbers[_BACKWARD] + off)
        held = 1.5 * numbers[_COULOMB] + 2.0 * torque
        force = force / (2.0 * numbers[_STIFF]) + held
        bent += force * (y_most / numbers[_BACKWARD] + s_most)
        drag = numbers[_ROLLING] * _rubbing(y_rim, rim, reach * width, spread)
        reach = reaches[i, 1]
        drag += numbers[_ROLLER] * _rubbing(y_roll, roll, reach * width, spread)
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
def fill_table(
    numbers: Any,
    wheels: Any,
    yaws: Any,
    first: int,
    spread: float,
    nodes: Any,
    allowances: Any,
    loads: Any,
    table: Any,
) -> None:
    """Least power (nodes, loads) over every second of the angles from ``first``, all yaw rates.

    ``spread`` is the share by which speeds may be off, so that what is found for two speeds holds
    for all between. ``allowances`` (nodes,) are the W that turning at twice the limit's rate is let
    off.
    """
    n = wheels.shape[0]
    speed, most = numbers[_SPEED], numbers[_YAW_RATE]
    quick = REST_SPEED / (numbers[_GEARED] * numbers[_QUICKER])
    rates = np.empty(3 + 24 * n * len(LEVELS))
    table[:] = np.inf
    reaches = _reaches(wheels)
    for turn in range(first, yaws.shape[0], 2):
        yaw = yaws[turn]
        before = yaw - yaws[turn - 1] if turn > 0 else yaw + math.pi - yaws[-1]
        after = yaws[turn + 1] - yaw if turn + 1 < yaws.shape[0] else yaws[0] + math.pi - yaw
        turned = max(before, after)
        width = speed * turned
        cx, cy = math.cos(yaw), math.sin(yaw)
        rates[0], rates[1], rates[2] = -most, 0.0, most
        count = 3
        for i in range(n):
            for part in (RIM, ROLLER):
                slope = wheels[i, part + 2]
                if slope == 0.0:
                    continue
                reach = reaches[i, 0 if part == RIM else 1] * width
                travel = speed * (wheels[i, part] * cx + wheels[i, part + 1] * cy)
                for level in range(len(LEVELS)):
                    for unit in (SLIDING_SPEED, quick):
                        if unit == quick and part == ROLLER:
                            continue
                        for side in (-1.0, 1.0):
                            for off in (-reach, reach):
                                scaled = 1.0 - spread if off > 0.0 else 1.0 + spread
                                if scaled <= 0.0:
                                    continue
                                at = side * (LEVELS[level] * unit + off) / scaled
                                rates[count] = (at - travel) / slope
                                count += 1
        for node in range(nodes.shape[0]):
            for k in range(count):
                # Quicker turns only stand for the same ones at lower speed.
                allowed = allowances[node] * max(0.0, abs(rates[k]) / most - 1.0)
                left, drag = _left_over(
                    numbers, wheels, reaches, cx, cy, nodes[node], rates[k], turned, spread
                )
                for at in range(loads.shape[0]):
                    value = left + loads[at] * drag + allowed
                    table[node, at] = min(table[node, at], value)


@njit(cache=True, error_model="numpy")
def spent_at_rest(numbers: Any, wheels: Any, nodes: Any, load: float, spent: Any) -> None:
    """W (nodes,) by which slow motion, where signs are smooth, may fall short of the straight line
    between nothing at rest and the table at full speed, over a grid of angles, turns and speeds."""
    scaled, reaches = numbers.copy(), _reaches(wheels)
    node = np.empty(4)
    for n in range(nodes.shape[0]):
        most = 0.0
        for turn in range(24):
            # Round the angles at which wheels or rollers stand, too.
            yaw = (turn // 3) * math.pi / 8.0 + (turn % 3 - 1) * 0.03
            cx, cy = math.cos(yaw), math.sin(yaw)
            for k in range(3):
                rate = (k - 1) * numbers[_YAW_RATE]
                left, drag = _left_over(numbers, wheels, reaches, cx, cy, nodes[n], rate, 0.0, 0.0)
                full = left + load * drag
                for part in range(1, 16):
                    t = (part / 16.0) ** 2
                    scaled[_SPEED] = t * numbers[_SPEED]
                    node[:] = t * nodes[n]
                    left, drag = _left_over(
                        scaled, wheels, reaches, cx, cy, node, t * rate, 0.0, 0.0
                    )
                    most = max(most, (t * full - left - load * drag) / (1.0 - t))
        spent[n] = most
