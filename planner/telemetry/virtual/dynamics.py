"""Equations of motion of the virtual robot, integrated in time.

    m·(dv/dt + ω × v + …) = m·g + Σ contact forces + air          rigid body, mass off the centre
    I_w·dω_i/dt = hub torque - r·contact - rolling                 each wheel
    motors, bridges, battery                                       virtual.motors

A speed controller (proportional and integral, knowing the commanded acceleration) asks for an
acceleration; the contacts share the force that this takes like equal springs; each motor supplies
what its hub asks for. Where a motor would pass its voltage or current, the robot falls behind the
command until all stay inside. Every step is an implicit midpoint: forces act at the mean of old and
new velocity, so that the work adds up to the change of kinetic energy to rounding. Dry friction at
rims and rollers changes sign as tanh over 4 mm/s.

Signs: as in the log (x forward, y left, counter-clockwise; pitch > 0 nose down). Internal forces of
wheels that fight change their lead eight times a second.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.compiled_code import njit
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.virtual import motors
from planner.telemetry.virtual.motors import battery_state, drive_wheel

STEP = 0.005  # s
STEPS_PER_BIN = 20  # usual number: the kernel then writes means over 0.1 s
BIN = STEP * STEPS_PER_BIN

# Columns of the commands, per run and bin edge.
MOTION: tuple[str, ...] = ("vx", "vy", "wz", "roll", "pitch")
# Columns of the surroundings, per run and bin.
CONDITIONS: tuple[str, ...] = ("slope_rate", "wind_x", "wind_y", "sensor_rate", "surface")
CONDITIONS += ("motor_temp", "rolling_factor")
# Columns of what a run carries and starts with.
START = ("payload", "com_x", "com_y", "ambient", "winding", "housing", "charge", "odometer")
# Columns of the means over a bin, before one current a wheel.
MEANS: tuple[str, ...] = ("vx", "vy", "wz", "power", "roll", "pitch", "ax", "ay", "motor_temp")
MEANS += ("battery_voltage", "battery_current")
# Energies of a run, J: from the supply, into height and motion, into heat by place.
BOOK: tuple[str, ...] = ("supply", "gravity", "kinetic", "body", "rolling", "rollers", "slip")
BOOK += ("mesh", "friction", "copper", "driver", "refused", "electronics", "battery", "stored")
BOOK += ("given_off",)

(_SUPPLY, _GRAVITY, _KINETIC, _BODY, _ROLLING, _ROLLERS, _SLIP, _MESH, _FRICTION) = range(9)
(_COPPER, _DRIVER, _REFUSED, _ELECTRONICS, _BATTERY, _STORED, _GIVEN_OFF) = range(9, 16)
_BOOKED = 16
"""Flows of power that are booked: the names above."""

_PROPORTIONAL = 12.0  # 1/s
_INTEGRAL = 20.0  # 1/s²
_SLIDING = 0.004  # m/s
_SCRUBBING = 0.01  # rad/s
_FIGHT_STEPS = 25
"""Steps after which wheels that work against each other change sides."""
_TERMINAL, _COPPER_OF, _MESH_OF = motors.TERMINAL, motors.COPPER, motors.MESH
_FRICTION_OF, _DRIVER_OF, _REFUSED_OF = motors.FRICTION, motors.DRIVER, motors.REFUSED
_CURRENT, _VOLTAGE, _DRAWS = motors.CURRENT, motors.VOLTAGE, motors.DRAWS
_C_WINDING, _C_HOUSING = motors.WINDING_CAPACITY, motors.HOUSING_CAPACITY
_R_WINDING, _R_HOUSING = motors.WINDING_TO_HOUSING, motors.HOUSING_TO_AIR


def by_name(means: Array, conditions: Array, starts: Array) -> dict[str, Array]:
    """Values (runs, k) of every column of MEANS, CONDITIONS and START.

    Args:
        means: (runs, k, len(MEANS) or more); a name that conditions have too is taken from here.
        conditions: (runs, k, len(CONDITIONS)).
        starts: (runs, len(START)).
    """
    kept = np.repeat(starts[:, None], means.shape[1], axis=1)
    tables = (conditions, CONDITIONS), (kept, START), (means, MEANS)
    return {name: table[:, :, k] for table, names in tables for k, name in enumerate(names)}


@njit(cache=True)
def _wheels(
    chassis: Any, hidden: Any, v: Any, dv: Any, g: Any, conditions: Any, start: Any,
    odometer: float, lead: float, winding: Any, draws: Any, flows: Any
) -> float:  # fmt: skip
    """Fills ``draws`` (n, DRAWS) and ``flows`` (W by place); returns the worst limit's use."""
    body, wheels, contacts, motor, _ = chassis
    n = wheels.x.shape[0]
    mass = body.mass + start[0]
    cx = hidden.gain * start[1] + hidden.offset_x
    cy = hidden.gain * start[2] + hidden.offset_y
    flows[:] = 0.0
    # Centre of mass: its acceleration in an inertial frame, written in body axes.
    ax = dv[0] - dv[2] * cy - v[2] * (v[1] + v[2] * cx)
    ay = dv[1] + dv[2] * cx + v[2] * (v[0] - v[2] * cy)
    fx = mass * (ax - g[0])
    fy = mass * (ay - g[1])
    moment = body.yaw_inertia * dv[2] + cx * fy - cy * fx
    flows[_GRAVITY] = -mass * (g[0] * (v[0] - v[2] * cy) + g[1] * (v[1] + v[2] * cx))
    # Air, bumps, edges of ramps and scrub act on the body.
    speed = math.sqrt(v[0] * v[0] + v[1] * v[1])
    wind_x, wind_y = v[0] - conditions[1], v[1] - conditions[2]
    gust = 0.5 * hidden.air_density * hidden.drag_area * math.sqrt(wind_x**2 + wind_y**2)
    along = hidden.shaking_force + hidden.transition_drag * conditions[0]
    along *= math.tanh(speed / _SLIDING) / max(speed, 1e-9)
    body_x = gust * wind_x + along * v[0]
    body_y = gust * wind_y + along * v[1]
    scrub = hidden.scrub_moment * math.tanh(v[2] / _SCRUBBING)
    flows[_BODY] = body_x * v[0] + body_y * v[1] + scrub * v[2]
    fx += body_x
    fy += body_y
    moment += scrub
    # Suspension: plane of spring forces in equilibrium with the weight and its moments.
    weight = mass * g[2]
    tip_x = weight * cx + body.com_height * mass * (g[0] - ax)
    tip_y = weight * cy + body.com_height * mass * (g[1] - ay)
    z0 = body.spring_plane[0, 0] * weight
    z0 += body.spring_plane[0, 1] * tip_x + body.spring_plane[0, 2] * tip_y
    z1 = body.spring_plane[1, 0] * weight
    z1 += body.spring_plane[1, 1] * tip_x + body.spring_plane[1, 2] * tip_y
    z2 = body.spring_plane[2, 0] * weight
    z2 += body.spring_plane[2, 1] * tip_x + body.spring_plane[2, 2] * tip_y
    nominal = body.mass * STANDARD_GRAVITY / n
    ground = conditions[6] * (1.0 + hidden.surface_excess[int(conditions[4])])
    ground *= 1.0 + hidden.wear_rate * odometer
    for i in range(n):
        rim = wheels.rim[i, 0] * v[0] + wheels.rim[i, 1] * v[1] + wheels.rim[i, 2] * v[2]
        spin = wheels.spin[i, 0] * v[0] + wheels.spin[i, 1] * v[1] + wheels.spin[i, 2] * v[2]
        load = max(z0 + z1 * wheels.x[i] + z2 * wheels.y[i], 1e-3 * nominal)
        factor = ground * (1.0 + hidden.wheel_excess[i])
        if hidden.exponent != 0.0:
            factor *= math.exp(hidden.exponent * math.log(load / nominal))
        if hidden.strength != 0.0:
            creeping = (rim * rim + spin * spin) / hidden.stiction_speed**2
            factor *= 1.0 + hidden.strength * math.exp(-creeping)
        gripped = 1.0
        if hidden.presliding != 0.0:
            steep = hidden.presliding * abs(rim) / max(abs(spin), 1e-9)
            gripped -= steep * (1.0 - math.exp(-1.0 / max(steep, 1e-9)))
        held = (
            factor
            * gripped
            * (contacts.roller * load * math.tanh(spin / _SLIDING) + contacts.roller_viscous * spin)
        )
        rolled = contacts.rolling * load
        if hidden.compaction != 0.0:
            rolled += hidden.compaction * load * (load / nominal) ** (1.0 / 3.0)
        # Kept in the table until the force is shared out.
        draws[i, 0], draws[i, 1], draws[i, 2] = rim, spin, load
        draws[i, 3] = held
        draws[i, 4] = factor * rolled * math.tanh(rim / _SLIDING)
        fx += held * contacts.drag[i, 0]
        fy += held * contacts.drag[i, 1]
        moment += held * contacts.drag[i, 2]
    s = contacts.stiffness
    dx = s[0, 0] * fx + s[0, 1] * fy + s[0, 2] * moment
    dy = s[1, 0] * fx + s[1, 1] * fy + s[1, 2] * moment
    turn = s[2, 0] * fx + s[2, 1] * fy + s[2, 2] * moment
    inner = lead * math.sqrt(hidden.preload_squared)
    worst = 0.0
    for i in range(n):
        rim, spin, load, held = draws[i, 0], draws[i, 1], draws[i, 2], draws[i, 3]
        rolled = draws[i, 4]
        force = contacts.pull[i, 0] * dx + contacts.pull[i, 1] * dy + contacts.pull[i, 2] * turn
        force += inner * contacts.fight[i]
        change = wheels.rim[i, 0] * dv[0] + wheels.rim[i, 1] * dv[1] + wheels.rim[i, 2] * dv[2]
        # Under force the wheel runs ahead of the ground.
        ahead = hidden.creep * force / load * abs(rim) / contacts.axle_on_rim[i]
        hub = force * contacts.axle_on_rim[i] - held * contacts.drag_on_rim[i] + rolled
        hub = hub * wheels.radius + wheels.inertia * change / wheels.radius
        to_motor = motor.gear_ratio / wheels.radius
        flows[_ROLLING] += rolled * (rim + ahead)
        flows[_ROLLERS] += held * (spin - ahead * contacts.drag_on_rim[i])
        flows[_SLIP] += force * ahead * contacts.axle_on_rim[i]
        drive_wheel(
            chassis, hidden, hub, (rim + ahead) * to_motor, change * to_motor, winding[i], draws[i]
        )
        flows[_MESH] += draws[i, _MESH_OF]
        flows[_FRICTION] += draws[i, _FRICTION_OF]
        flows[_COPPER] += draws[i, _COPPER_OF]
        flows[_DRIVER] += draws[i, _DRIVER_OF]
        flows[_REFUSED] += draws[i, _REFUSED_OF]
        flows[_SUPPLY] += draws[i, _TERMINAL] + draws[i, _DRIVER_OF] + draws[i, _REFUSED_OF]
        use = abs(draws[i, _VOLTAGE]) / motor.highest_voltage
        worst = max(worst, use, abs(draws[i, _CURRENT]) / motor.highest_current)
    return worst


@njit(cache=True)
def _electronics(chassis: Any, hidden: Any, v: Any, g: Any, conditions: Any, time: float) -> float:
    """W on the bus without the drives."""
    speed = math.sqrt(v[0] * v[0] + v[1] * v[1])
    rate = conditions[3]
    if math.isnan(rate):
        rate = min(hidden.base_rate + hidden.rate_per_speed * speed, hidden.top_rate)
    watts = (chassis.supply.electronics + hidden.energy_per_sample * rate) / hidden.efficiency
    off = (speed - hidden.resonance_speed) / hidden.resonance_width
    watts += hidden.resonance_power * math.exp(-0.5 * off * off)
    wave = math.cos(hidden.heading_ripple_harmonic * math.atan2(v[1], v[0]))
    watts += hidden.heading_ripple_power * math.tanh(speed / 0.03) * wave
    watts += hidden.start_decay_power * math.exp(-time / hidden.start_decay_time_constant)
    if speed > 1e-6:
        climb = math.asin(-(g[0] * v[0] + g[1] * v[1]) / (speed * STANDARD_GRAVITY))
        above = max(climb - hidden.slope_threshold_threshold, 0.0)
        watts += hidden.slope_threshold_power_per_rad * above
    return float(watts + hidden.yaw_speed_coefficient * abs(v[2]) * speed)


@njit(cache=True)
def _kinetic(chassis: Any, hidden: Any, v: Any, start: Any) -> float:
    """J of the body, its wheels and rotors."""
    body, wheels, _, motor, _ = chassis
    x = v[0] - v[2] * (hidden.gain * start[2] + hidden.offset_y)
    y = v[1] + v[2] * (hidden.gain * start[1] + hidden.offset_x)
    energy = (body.mass + start[0]) * (x * x + y * y) + body.yaw_inertia * v[2] * v[2]
    rotating = wheels.inertia + motor.gear_ratio**2 * motor.rotor_inertia
    for i in range(wheels.x.shape[0]):
        rim = wheels.rim[i, 0] * v[0] + wheels.rim[i, 1] * v[1] + wheels.rim[i, 2] * v[2]
        energy += rotating * (rim / wheels.radius) ** 2
    return float(0.5 * energy)


@njit(cache=True)
def integrate(
    chassis: Any, hidden: Any, motion: Any, conditions: Any, starts: Any, means: Any, book: Any,
    steps: int
) -> None:  # fmt: skip
    """Drives all runs.

    Args:
        chassis: constants of the robot.
        hidden: strengths of the effects.
        motion: (runs, bins + 1, len(MOTION)) commands at bin edges, linear between.
        conditions: (runs, bins, len(CONDITIONS)); NaN lets sensor_rate follow the speed and
            motor_temp the heat balance.
        starts: (runs, len(START)).
        means: (runs, bins, len(MEANS) + n) written: means over each bin.
        book: (runs, len(BOOK)) written: energies of each run, J.
        steps: of STEP seconds in a bin.
    """
    n = chassis.wheels.x.shape[0]
    length = steps * STEP
    draws = np.zeros((n, _DRAWS))
    flows = np.zeros(_BOOKED)
    winding, housing = np.zeros(n), np.zeros(n)
    v, middle, dv = np.zeros(3), np.zeros(3), np.zeros(3)
    asked, error_sum, g = np.zeros(3), np.zeros(3), np.zeros(3)
    for run in range(motion.shape[0]):
        start = starts[run]
        winding[:], housing[:] = start[4], start[5]
        charge, odometer = start[6], start[7]
        v[0], v[1], v[2] = motion[run, 0, 0], motion[run, 0, 1], motion[run, 0, 2]
        error_sum[:] = 0.0
        book[run, :] = 0.0
        book[run, _KINETIC] = -_kinetic(chassis, hidden, v, start)
        for b in range(conditions.shape[1]):
            nearby = conditions[run, b]
            imposed = not math.isnan(nearby[5])
            out = means[run, b]
            out[:] = 0.0
            for step in range(steps):
                share = (step + 0.5) / steps
                time = (b + share) * length
                roll = (1.0 - share) * motion[run, b, 3] + share * motion[run, b + 1, 3]
                pitch = (1.0 - share) * motion[run, b, 4] + share * motion[run, b + 1, 4]
                g[0] = STANDARD_GRAVITY * math.sin(pitch)
                g[1] = -STANDARD_GRAVITY * math.cos(pitch) * math.sin(roll)
                g[2] = STANDARD_GRAVITY * math.cos(pitch) * math.cos(roll)
                for k in range(3):
                    wanted = motion[run, b, k]
                    slope = motion[run, b + 1, k] - wanted
                    lag = wanted + slope * (share - 0.5 / steps) - v[k]
                    asked[k] = slope / length + _PROPORTIONAL * lag + _INTEGRAL * error_sum[k]
                    error_sum[k] += lag * STEP
                if imposed:
                    winding[:] = nearby[5]
                    housing[:] = nearby[5]
                lead = 1.0 - 2.0 * (((b * steps + step) // _FIGHT_STEPS) % 2)
                low, high, worst = 0.0, 1.0, 0.0
                for attempt in range(10):
                    # A motor at its limit: less acceleration, down to giving way altogether.
                    give = 0.0 if attempt == 0 else 0.5 * (low + high)
                    if attempt == 9:
                        give = high
                    for k in range(3):
                        dv[k] = (1.0 - give) * asked[k] - give * 2.0 * v[k]
                        middle[k] = v[k] + 0.5 * STEP * dv[k]
                    worst = _wheels(
                        chassis, hidden, middle, dv, g, nearby, start, odometer, lead, winding,
                        draws, flows
                    )  # fmt: skip
                    if attempt == 0 and worst <= 1.0:
                        break
                    if worst > 1.0:
                        low = give
                    else:
                        high = give
                    if attempt == 0:
                        error_sum[:] *= 0.98
                flows[_ELECTRONICS] = _electronics(chassis, hidden, middle, g, nearby, time)
                bus = flows[_SUPPLY] + flows[_ELECTRONICS]
                lost = (hidden.source_share - 1.0) * min(bus, 0.0)
                flows[_REFUSED] += lost
                terminals = bus + lost
                voltage, current = battery_state(chassis, hidden, terminals, charge)
                flows[_BATTERY] = hidden.internal_resistance * current * current
                flows[_SUPPLY] = terminals + flows[_BATTERY]
                charge -= current * STEP / chassis.supply.charge
                warmth = 0.0
                for i in range(n):
                    warmth += winding[i] / n
                    out[11 + i] += draws[i, _CURRENT] / steps
                    if not imposed:
                        inward = (winding[i] - housing[i]) / _R_WINDING
                        outward = (housing[i] - start[3]) / _R_HOUSING
                        heat, drag = draws[i, _COPPER_OF], draws[i, _FRICTION_OF]
                        if chassis.motors.even_heat:
                            heat, drag = flows[_COPPER] / n, flows[_FRICTION] / n
                        warming = heat - inward
                        winding[i] += STEP * warming / _C_WINDING
                        housing[i] += STEP * (inward + drag - outward) / _C_HOUSING
                        book[run, _STORED] += STEP * (warming + inward + drag - outward)
                        book[run, _GIVEN_OFF] += STEP * outward
                for k in range(3):
                    out[k] += middle[k] / steps
                    v[k] += STEP * dv[k]
                out[3] += flows[_SUPPLY] / steps
                out[4] += roll / steps
                out[5] += pitch / steps
                out[6] += (dv[0] - middle[2] * middle[1]) / steps
                out[7] += (dv[1] + middle[2] * middle[0]) / steps
                out[8] += warmth / steps
                out[9] += voltage / steps
                out[10] += current / steps
                odometer += STEP * math.sqrt(middle[0] ** 2 + middle[1] ** 2)
                for k in range(_STORED):
                    if k != _KINETIC:
                        book[run, k] += STEP * flows[k]
        book[run, _KINETIC] += _kinetic(chassis, hidden, v, start)
