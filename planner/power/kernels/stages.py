"""The power model's stages in the order of the physics: one function of one row.

    centre of mass → forces on the body → load of each wheel → rolling and roller drag
    → axle force of each wheel → hub torque → gear → motor → bridge → bus → source

``power`` is never called by planning. pipeline.py makes a compiled function of its text for each
set of effects (specialise.py). ``hooks`` marks the places where effects act, by these forms:

    for effect in hooks("slip"): ...                    once for each effect that acts there
        x = effect(locals())                            what its formula gives for the values so far
        effect.takes(x)                                 W in the balance of a base effect
    x = hooks.combine("bus", locals(), x=start)         parts of all effects there, as HOOKS says
    n = 2 if hooks.act("circulation") else 1            whether any effect acts there
    zero = hooks.zero                                   0 of the parameters' kind of number
    centre_x, centre_y = hooks.side(zero)               all that follows is done for each side
    x = hooks.parameter("wheel_rolling", "rolling")     value of a base effect's parameter
    hooks.book(gravity=x)                               W that take the place of base effects' own
    hooks.balance(account)                              writes what base effects take
    if hooks.printed: ...                               only for the paper's motors
    hooks.reading_b                                     whether that is their reading B

``w = wheels[wheel]`` shortens the names of a wheel's columns. With an object that does all this
the function runs as plain Python: the reference (tests/power/kernels/plain_hooks.py).

Signs: power is positive when it leaves the battery. Wheel fighting (``circulation``) acts with both
signs of its mode and counts their mean, since nobody knows which pair of wheels leads. A centre of
mass on an unknown side (``centre_spread``) counts the mean of the power over its sides, and the
worst side for the limits; per_wheel then shows one of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.power import kinematics as table
from planner.power.account import Account, Body, PerWheel
from planner.power.kernel_math import REST_SPEED, absolute, sign, smaller, still
from planner.power.kernels import printed
from planner.quantities import INDEX, STANDARD_GRAVITY

IDLE_TORQUE = 0.01
"""N·m at the wheel's axle below which a motor at rest holds nothing and its bridge may sleep."""


def power(row: Any, body: Any, wheels: Any, account: Any, per_wheel: Any, hooks: Any) -> Any:
    """W at the supply; writes ``account`` and ``per_wheel``.

    Args:
        row: (ROW_LENGTH,) quantities in the order of planner.quantities.
        body: (len(Body),) mass, geometry and what a second is worth.
        wheels: (n, COLUMNS) table of planner.power.kinematics.
        account: (ACCOUNT_LENGTH,) sums and limits, planner.power.account.
        per_wheel: (n, len(PerWheel)) what each wheel carries and draws.
        hooks: effects that act, with their parameters.
    """
    vx = row[INDEX["vx"]]
    vy = row[INDEX["vy"]]
    wz = row[INDEX["wz"]]
    ax = row[INDEX["ax"]]
    ay = row[INDEX["ay"]]
    yaw_acceleration = row[INDEX["yaw_acceleration"]]
    gravity_x = row[INDEX["gravity_x"]]
    gravity_y = row[INDEX["gravity_y"]]
    gravity_normal = row[INDEX["gravity_normal"]]
    wheel_count = wheels.shape[0]
    wheel_radius = body[Body.WHEEL_RADIUS]
    gear_ratio = body[Body.GEAR_RATIO]
    sliding_speed = body[Body.SLIDING_SPEED]
    nominal_load = body[Body.MASS] * STANDARD_GRAVITY / wheel_count
    zero = hooks.zero
    cold_resistance = hooks.combine("winding_resistance", locals(), cold_resistance=zero)
    cold_constant = hooks.combine("motor_constant", locals(), cold_constant=zero)
    mass = body[Body.MASS] + row[INDEX["payload"]]
    weight = mass * gravity_normal
    speed = np.sqrt(vx * vx + vy * vy)
    # Wheels turn with the change of body velocity, not with inertial acceleration.
    vx_change = ax + wz * vy
    vy_change = ay - wz * vx
    circulation = hooks.combine("circulation", locals(), circulation=zero)

    # Forces on the body.
    centre_x, centre_y = hooks.side(zero)
    centre_x, centre_y = hooks.combine(
        "centre_of_mass", locals(), centre_x=centre_x, centre_y=centre_y
    )
    force_x = force_y = moment = zero
    for effect in hooks("body_force"):
        fx, fy, mz = effect(locals())
        force_x += fx
        force_y += fy
        moment += mz
        effect.takes(fx * vx + fy * vy + mz * wz)

    # Loads of the wheels, and drag of their rollers.
    press_x = centre_x + body[Body.CENTRE_HEIGHT] * (gravity_x - ax) / gravity_normal
    press_y = centre_y + body[Body.CENTRE_HEIGHT] * (gravity_y - ay) / gravity_normal
    for wheel in range(wheel_count):
        w = wheels[wheel]
        rim_speed = w[table.RIM_VX] * vx + w[table.RIM_VY] * vy + w[table.RIM_WZ] * wz
        roller_speed = w[table.ROLLER_VX] * vx + w[table.ROLLER_VY] * vy + w[table.ROLLER_WZ] * wz
        load = weight * (
            w[table.LOAD_SHARE] + w[table.LOAD_X] * press_x + w[table.LOAD_Y] * press_y
        )
        factor = zero + row[INDEX["rolling_factor"]]
        factor = hooks.combine("contact_factor", locals(), factor=factor)
        roller_factor = hooks.combine("roller_factor", locals(), roller_factor=factor)
        roller_force = zero
        for effect in hooks("roller_drag"):
            part = roller_factor * effect(locals())
            roller_force += part
            effect.takes(part * roller_speed)
        per_wheel[wheel, PerWheel.LOAD] = load
        per_wheel[wheel, PerWheel.ROLLING_FACTOR] = factor
        per_wheel[wheel, PerWheel.ROLLER_FORCE] = roller_force
        # Roller drag pushes against the motion; what it takes, the axles must supply as well.
        force_x += roller_force * w[table.DRAG_FX]
        force_y += roller_force * w[table.DRAG_FY]
        moment += roller_force * w[table.DRAG_MZ]

    # Axle, gear, motor and bridge of each wheel.
    terminal_watts = driver_watts = shaft_watts = copper_watts = zero
    loads = load_times_speed = zero
    most_current = most_voltage = most_torque = mode_size = 0.0
    least_load = slack_high = slack = np.inf
    slack_low = -np.inf
    traction = body[Body.TRACTION] * row[INDEX["traction_factor"]]
    for wheel in range(wheel_count):
        w = wheels[wheel]
        rim_speed = w[table.RIM_VX] * vx + w[table.RIM_VY] * vy + w[table.RIM_WZ] * wz
        roller_speed = w[table.ROLLER_VX] * vx + w[table.ROLLER_VY] * vy + w[table.ROLLER_WZ] * wz
        load = per_wheel[wheel, PerWheel.LOAD]
        factor = per_wheel[wheel, PerWheel.ROLLING_FACTOR]
        roller_force = per_wheel[wheel, PerWheel.ROLLER_FORCE]
        loads += load
        load_times_speed += load * abs(rim_speed)
        drag = zero
        rolling_sign = sign(rim_speed, sliding_speed)
        for effect in hooks("wheel_drag"):
            part = factor * effect(locals())
            drag += part
            effect.takes(part * rolling_sign * rim_speed)
        needed_force = (
            w[table.AXIS_FX] * force_x + w[table.AXIS_FY] * force_y + w[table.AXIS_MZ] * moment
        )

        # Traction: a null mode may shift force from one wheel to another until one slides.
        least_load = min(least_load, load.real)
        grip = traction * load.real
        mode = w[table.NULL]
        if mode != 0.0:
            mode_size = max(mode_size, abs(mode))
            low = (-grip - needed_force.real) / mode
            high = (grip - needed_force.real) / mode
            slack_low = max(slack_low, min(low, high))
            slack_high = min(slack_high, max(low, high))
        if mode == 0.0:
            slack = min(slack, grip - abs(needed_force.real))

        axis_force = needed_force
        slip = zero
        for effect in hooks("slip"):
            # The rim runs ahead by more than the contact.
            slip += effect(locals()) / w[table.AXIS_LEVER]
        wheel_speed = rim_speed / wheel_radius * (1.0 + slip)
        wheel_acceleration = (
            w[table.RIM_VX] * vx_change
            + w[table.RIM_VY] * vy_change
            + w[table.RIM_WZ] * yaw_acceleration
        ) / wheel_radius
        motor_speed = gear_ratio * wheel_speed
        motor_acceleration = gear_ratio * wheel_acceleration
        rest = still(motor_speed, REST_SPEED)
        gear_torque = 0.0
        sides_of_mode = 2 if hooks.act("circulation") else 1
        share = 1.0 / sides_of_mode
        for side_of_mode in range(sides_of_mode):
            leading = 1.0 - 2.0 * side_of_mode
            axis_force = needed_force + leading * circulation * w[table.NULL]
            wheel_torque = wheel_radius * (
                axis_force * w[table.AXIS_LEVER]
                - roller_force * w[table.DRAG_LEVER]
                + drag * rolling_sign
            )
            for effect in hooks("axle_torque"):
                part = effect(locals())
                wheel_torque += part
                effect.takes(share * part * wheel_speed)
            gear_return = hooks.combine("gear_return", locals(), gear_return=zero)
            geared_torque = wheel_torque / gear_ratio
            for effect in hooks("gear"):
                geared_torque = effect(locals())
                effect.takes(share * (gear_ratio * geared_torque - wheel_torque) * wheel_speed)
            motor_torque_in = geared_torque
            motor_torque = geared_torque
            for effect in hooks("static_torque"):
                part = -rest * smaller(absolute(geared_torque), effect(locals()))
                part = part if geared_torque.real >= 0.0 else -part
                motor_torque += part
                effect.takes(share * part * motor_speed)
            for effect in hooks("motor_torque"):
                part = effect(locals())
                motor_torque += part
                effect.takes(share * part * motor_speed)
            resistance_now, torque_constant_now = hooks.combine(
                "winding",
                locals(),
                resistance_now=cold_resistance,
                torque_constant_now=cold_constant,
            )
            current = motor_torque / torque_constant_now
            motor_watts = current * torque_constant_now * motor_speed
            for effect in hooks("motor_loss"):
                part = effect(locals())
                motor_watts += part
                copper_watts += share * part
                effect.takes(share * part)
            motor_watts = hooks.combine("motor_power", locals(), motor_watts=motor_watts)
            active = 1.0 - rest * still(wheel_torque, IDLE_TORQUE)
            for effect in hooks("driver"):
                driver_watts += share * effect(locals())
            terminal_watts += share * motor_watts
            shaft_watts += share * wheel_torque * wheel_speed
            voltage = current * resistance_now + torque_constant_now * motor_speed
            most_current = max(most_current, abs(current.real))
            most_voltage = max(most_voltage, abs(voltage.real))
            # A data sheet's continuous torque leaves the shaft; the motor's own friction is in it.
            gear_torque = max(gear_torque, abs(geared_torque.real))
            most_torque = max(most_torque, abs(geared_torque.real))
            per_wheel[wheel, PerWheel.WHEEL_SPEED] = wheel_speed
            per_wheel[wheel, PerWheel.ROLLER_SPEED] = roller_speed
            per_wheel[wheel, PerWheel.AXIS_FORCE] = axis_force
            per_wheel[wheel, PerWheel.WHEEL_TORQUE] = wheel_torque
            per_wheel[wheel, PerWheel.MOTOR_TORQUE] = motor_torque
            per_wheel[wheel, PerWheel.CURRENT] = current
            per_wheel[wheel, PerWheel.VOLTAGE] = voltage
            per_wheel[wheel, PerWheel.MOTOR_WATTS] = motor_watts
            per_wheel[wheel, PerWheel.GEAR_TORQUE] = gear_torque

    if hooks.printed:
        # The source paper's motors take the place of the watts; loads and limits stay.
        rolling = hooks.parameter("wheel_rolling", "rolling")
        roller = hooks.parameter("roller_drag", "roller")
        cosine, sine = printed.printed_direction(vx, vy, hooks.reading_b)
        climbing, rubbing = printed.printed_forces(
            mass, gravity_x, gravity_y, gravity_normal, vx, vy, sine, rolling
        )
        cos_slope = gravity_normal / np.sqrt(
            gravity_x * gravity_x + gravity_y * gravity_y + gravity_normal * gravity_normal
        )
        force = climbing + rubbing
        copper_watts, mechanical, friction = printed.printed_watts(
            force, speed, cosine, cos_slope, load_times_speed, loads, rolling, roller
        )
        terminal_watts = copper_watts + mechanical + friction
        driver_watts = zero
        hooks.book(
            gravity=climbing * speed,
            inertia=zero,
            wheel_rolling=rubbing * speed,
            roller_drag=friction,
            gear_loss=mechanical - force * speed,
            copper_loss=copper_watts,
            coulomb_drag=zero,
        )

    # Bus and source.
    electronics_watts = zero
    for effect in hooks("electronics"):
        part = effect(locals())
        electronics_watts += part
        effect.takes(part)
    electronics_watts = hooks.combine("converter", locals(), electronics_watts=electronics_watts)
    motors_watts = terminal_watts + driver_watts
    bus_watts = motors_watts + electronics_watts
    bus_watts = hooks.combine("bus", locals(), bus_watts=bus_watts)
    account[Account.BUS] = bus_watts
    bus_watts = hooks.combine("supply", locals(), bus_watts=bus_watts)
    # Behind everything else: no loss or limit of the supply changes what a second is worth.
    bus_watts += body[Body.TIME_WEIGHT]
    if mode_size > 0.0:
        slack = min(slack, 0.5 * mode_size * (slack_high - slack_low))
    traction_left = slack / (traction * weight / wheel_count).real
    account[Account.SUPPLY] = bus_watts
    account[Account.TERMINAL] = terminal_watts
    account[Account.SHAFT] = shaft_watts
    account[Account.COPPER] = copper_watts
    account[Account.DRIVER] = driver_watts
    account[Account.ELECTRONICS] = electronics_watts
    account[Account.LEAST_LOAD] = least_load
    account[Account.CURRENT] = most_current
    account[Account.VOLTAGE] = most_voltage
    account[Account.MOTOR_TORQUE] = most_torque
    account[Account.TRACTION_LEFT] = traction_left
    hooks.balance(account)
    return bus_watts
