"""The power model's stages in their physical order, written out as one compiled function.

``kernel_source`` takes the active effects and writes a plain Python module: the order of its lines
is the order of the physics, and each effect is called at the place that its hooks name::

    centre of mass → forces on the body → load of each wheel → rolling and roller drag
    → axle force of each wheel → hub torque → gear → motor → bridge → bus → source

numba can cache compiled code on disk only for functions that stand in a file, so the module is
written to a cache folder under a name that is the hash of everything it is made of
(``compile_kernel``). A model seen before so starts without compiling.

    evaluate(row, parameters, body, wheels, account, per_wheel) → W at the supply

    row         (ROW_LENGTH,) float64, quantities in the order of planner.quantities
    parameters  (P,) values of all effects' parameters; complex for derivatives
    body        (len(BODY),) float64, mass and geometry
    wheels      (n, COLUMNS) float64, planner.power.kinematics
    account     (ACCOUNT_LENGTH,) written: sums and limits, planner.power.account
    per_wheel   (n, len(PER_WHEEL)) written: what each wheel carries and draws; on the way the
                first columns keep what the rollers' lines found for the motors' lines

For blocks of rows (row_blocks.py) there are ``evaluate(columns, count, parameters, body,
wheels, found)`` with the power alone in ``found``, and with the power and the limits behind it.

Signs: power is positive when it leaves the battery. Wheel fighting (``circulation``) acts with both
signs of its mode and counts their mean, since nobody knows which pair of wheels leads. A centre of
mass on an unknown side (``centre_spread``) likewise counts the mean over its sides, and the worst
side for the limits; per_wheel then shows one of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.power.account import ACCOUNT, BASE_EFFECTS, Output
from planner.power.effect import Effect
from planner.power.kernel_math import REST_SPEED
from planner.power.kernels.writer import KernelWriter
from planner.quantities import INDEX


def kernel_source(
    effects: Sequence[type[Effect]],
    *,
    wheel_count: int,
    surface_count: int,
    number: str,
    printed: str | None = None,
    output: Output = "account",
) -> str:
    """Text of the module that evaluates a model of these effects.

    Args:
        effects: active effects in the order of the catalogue.
        wheel_count: number of wheels of the layout.
        surface_count: number of surface labels that the model tells apart.
        number: "float64" for planning, "complex128" for derivatives.
        printed: "A" or "B" puts the source paper's motor power (printed.py) in the place
            of the motors' and drivers' watts; loads and limits stay those of the sound model.
        output: "account" of one row; of a block of rows the "power", for loops over logs, or power
            and "limits", for loops over motions.
    """
    return _Pipeline(effects, wheel_count, surface_count, number, printed, output).module()


class _Pipeline(KernelWriter):
    def _stages(self) -> None:
        self._forces()
        self._loads_and_rollers()
        self._wheels_and_motors()
        if self.printed:
            self._printed_motors()
        self._bus_and_supply()

    def _inputs(self) -> None:
        put = self.put
        for name in ("vx", "vy", "wz", "ax", "ay", "yaw_acceleration"):
            put(f"{name} = row[{INDEX[name]}]")
        for name in ("gravity_x", "gravity_y", "gravity_normal"):
            put(f"{name} = row[{INDEX[name]}]")
        put("wheel_count = wheels.shape[0]; wheel_radius = body[2]; gear_ratio = body[3]")
        put("nominal_load = body[0] * 9.80665 / wheel_count")
        put(f"zero = {'0j' if self.number == 'complex128' else '0.0'}")
        self._switches()
        for effect in self.effects:
            for name, parameter in effect.parameters.items():
                if parameter.per == "wheel":
                    start = self.offset[effect.slug, name]
                    put(f"mean_{effect.slug}_{name} = zero")
                    with self.inside(f"for i in range({self.wheel_count}):"):
                        put(f"mean_{effect.slug}_{name} += parameters[{start} + i] / wheel_count")
        put("cold_resistance = zero; cold_constant = zero")
        self._each("winding_resistance", "cold_resistance += {call}")
        self._each("motor_constant", "cold_constant += {call}")
        put(f"mass = body[0] + row[{INDEX['payload']}]")
        put("weight = mass * gravity_normal")
        put("speed = np.sqrt(vx * vx + vy * vy)")
        # Wheels turn with the change of body velocity, not with inertial acceleration.
        put("change_x = ax + wz * vy; change_y = ay - wz * vx")
        put("circulation = zero")
        self._each("circulation", "circulation += {call}")

    def _forces(self) -> None:
        put = self.put
        if self.balanced:
            put(*(f"watts_{slug} = zero" for slug in BASE_EFFECTS))
        self._each("centre_of_mass", "dx, dy = {call}", "centre_x += dx; centre_y += dy")
        put("force_x = zero; force_y = zero; moment = zero")
        self._each(
            "body_force",
            "fx, fy, mz = {call}",
            "force_x += fx; force_y += fy; moment += mz",
            book="fx * vx + fy * vy + mz * wz",
        )

    def _loads_and_rollers(self) -> None:
        put = self.put
        put("press_x = centre_x + body[1] * (gravity_x - ax) / gravity_normal")
        put("press_y = centre_y + body[1] * (gravity_y - ay) / gravity_normal")
        with self.inside("for i in range(wheel_count):"):
            self._contact_speeds()
            put("load = weight * (wheels[i, 16] + wheels[i, 17] * press_x")
            put("                 + wheels[i, 18] * press_y)")
            put(f"factor = zero + row[{INDEX['rolling_factor']}]")
            self._each("contact_factor", "factor *= {call}")
            put("of_rollers = factor")
            self._each("roller_factor", "of_rollers *= {call}")
            put("roller_force = zero")
            self._each(
                "roller_drag",
                "part = of_rollers * {call}",
                "roller_force += part",
                book="part * roller_speed",
            )
            put("per_wheel[i, 0] = load; per_wheel[i, 1] = factor; per_wheel[i, 2] = roller_force")
            # Roller drag pushes against the motion; what it takes, the axles must supply as well.
            put("force_x += roller_force * wheels[i, 11]")
            put("force_y += roller_force * wheels[i, 12]")
            put("moment += roller_force * wheels[i, 13]")

    def _contact_speeds(self) -> None:
        self.put("wheel = i")
        self.put("rim_speed = wheels[i, 2] * vx + wheels[i, 3] * vy + wheels[i, 4] * wz")
        self.put("roller_speed = wheels[i, 5] * vx + wheels[i, 6] * vy + wheels[i, 7] * wz")

    def _wheels_and_motors(self) -> None:
        put = self.put
        put("terminal_watts = zero; driver_watts = zero")
        if self.balanced:
            put("shaft_watts = zero; copper_watts = zero")
        if self.limited:
            put("least_load = np.inf; most_current = 0.0; most_voltage = 0.0; most_torque = 0.0")
            put("slack_low = -np.inf; slack_high = np.inf; slack = np.inf; mode_size = 0.0")
            put(f"traction = body[4] * row[{INDEX['traction_factor']}]")
        with self.inside("for i in range(wheel_count):"):
            self._contact_speeds()
            put("load = per_wheel[i, 0]; factor = per_wheel[i, 1]; roller_force = per_wheel[i, 2]")
            put("drag = zero")
            put("rolling_sign = sign(rim_speed, SLIDING_SPEED)")
            self._each(
                "wheel_drag",
                "part = factor * {call}",
                "drag += part",
                book="part * rolling_sign * rim_speed",
            )
            put("axis_force_0 = (wheels[i, 8] * force_x + wheels[i, 9] * force_y")
            put("                + wheels[i, 10] * moment)")
            self._traction()
            put("axis_force = axis_force_0")
            put("slip = zero")
            # The rim runs ahead by more than the contact.
            self._each("slip", "slip += {call} / wheels[i, 14]")
            put("wheel_speed = rim_speed / wheel_radius * (1.0 + slip)")
            put("wheel_acceleration = (wheels[i, 2] * change_x + wheels[i, 3] * change_y")
            put("                      + wheels[i, 4] * yaw_acceleration) / wheel_radius")
            put("motor_speed = gear_ratio * wheel_speed")
            put("motor_acceleration = gear_ratio * wheel_acceleration")
            put(f"rest = still(motor_speed, {REST_SPEED})")
            fights = [e.slug for e in self.effects if "circulation" in e.hooks]
            if not fights:
                self._motor("")
                return
            acts = " or ".join(f"acts_{slug}" for slug in fights)
            put(f"sides_of_mode = 2 if {acts} else 1")
            put("share = 1.0 / sides_of_mode")
            with self.inside("for side_of_mode in range(sides_of_mode):"):
                put("leading = 1.0 - 2.0 * side_of_mode")
                put("axis_force = axis_force_0 + leading * circulation * wheels[i, 19]")
                self._motor("share * ")

    def _traction(self) -> None:
        if not self.limited:
            return
        put = self.put
        put("least_load = min(least_load, load.real)")
        put("grip = traction * load.real")
        put("mode = wheels[i, 19]")
        with self.inside("if mode != 0.0:"):
            put("mode_size = max(mode_size, abs(mode))")
            put("low = (-grip - axis_force_0.real) / mode")
            put("high = (grip - axis_force_0.real) / mode")
            put("slack_low = max(slack_low, min(low, high))")
            put("slack_high = min(slack_high, max(low, high))")
        with self.inside("if mode == 0.0:"):
            put("slack = min(slack, grip - abs(axis_force_0.real))")

    def _motor(self, share: str) -> None:
        put = self.put
        put("wheel_torque = wheel_radius * (axis_force * wheels[i, 14]")
        put("               - roller_force * wheels[i, 15] + drag * rolling_sign)")
        self._each(
            "axle_torque",
            "part = {call}",
            "wheel_torque += part",
            book=f"{share}part * wheel_speed",
        )
        put("gear_return = zero")
        self._each("gear_return", "gear_return += {call}")
        put("geared_torque = wheel_torque / gear_ratio")
        self._each(
            "gear",
            "geared_torque = {call}",
            book=f"{share}(gear_ratio * geared_torque - wheel_torque) * wheel_speed",
        )
        put("motor_torque_in = geared_torque")
        put("motor_torque = geared_torque")
        self._each(
            "static_torque",
            "part = -rest * smaller(absolute(geared_torque), {call})",
            "part = part if geared_torque.real >= 0.0 else -part",
            "motor_torque += part",
            book=f"{share}part * motor_speed",
        )
        self._each(
            "motor_torque",
            "part = {call}",
            "motor_torque += part",
            book=f"{share}part * motor_speed",
        )
        put("resistance_now = cold_resistance; torque_constant_now = cold_constant")
        self._each(
            "winding",
            "warm_resistance, warm_constant = {call}",
            "resistance_now *= warm_resistance; torque_constant_now *= warm_constant",
        )
        put("current = motor_torque / torque_constant_now")
        put("shaft_part = current * torque_constant_now * motor_speed")
        put("motor_watts = shaft_part")
        copper = [f"copper_watts += {share}part"] if self.balanced else []
        self._each(
            "motor_loss", "part = {call}", "motor_watts += part", *copper, book=f"{share}part"
        )
        self._each("motor_power", "motor_watts += {call}")
        put("active = 1.0 - rest * still(wheel_torque, 0.01)")
        self._each("driver", f"driver_watts += {share}{{call}}")
        put(f"terminal_watts += {share}motor_watts")
        if not self.limited:
            return
        put("voltage = current * resistance_now + torque_constant_now * motor_speed")
        put("most_current = max(most_current, abs(current.real))")
        put("most_voltage = max(most_voltage, abs(voltage.real))")
        # A data sheet's continuous torque leaves the shaft; the motor's own friction is inside it.
        put("most_torque = max(most_torque, abs(geared_torque.real))")
        if not self.balanced:
            return
        put(f"shaft_watts += {share}wheel_torque * wheel_speed")
        put("per_wheel[i, 1] = wheel_speed; per_wheel[i, 2] = roller_speed")
        values = ("axis_force", "wheel_torque", "motor_torque", "current", "voltage", "motor_watts")
        for column, value in enumerate(values, start=3):
            put(f"per_wheel[i, {column}] = {value}")

    def _printed_motors(self) -> None:
        put = self.put
        rolling = f"parameters[{self.offset['wheel_rolling', 'rolling']}]"
        roller = f"parameters[{self.offset['roller_drag', 'roller']}]"
        put("loads = zero; load_times_speed = zero; wheel_speeds = 0.0")
        with self.inside("for i in range(wheel_count):"):
            put("rim = abs(wheels[i, 2] * vx + wheels[i, 3] * vy + wheels[i, 4] * wz)")
            put("load = per_wheel[i, 0]")
            put("loads += load; wheel_speeds += rim; load_times_speed += load * rim")
        put(f"cosine, sine = printed.printed_direction(vx, vy, {self.printed == 'B'})")
        put("climbing, rubbing = printed.printed_forces(mass, gravity_x, gravity_y,")
        put(f"    gravity_normal, vx, vy, sine, {rolling})")
        put("cos_slope = gravity_normal / np.sqrt(")
        put("    gravity_x * gravity_x + gravity_y * gravity_y + gravity_normal * gravity_normal)")
        put("along = (ax * vx + ay * vy) / speed if speed > 0.0 else 0.0")
        put("copper_watts, iron, mechanical, watts_roller_drag = printed.printed_watts(")
        put("    climbing + rubbing, speed, cosine, cos_slope, load_times_speed, loads,")
        put(f"    wheel_speeds, along, row[{INDEX['time_since_start']}], {rolling}, {roller})")
        put("terminal_watts = copper_watts + iron + mechanical + watts_roller_drag")
        put("driver_watts = zero")
        if not self.balanced:
            return
        put("watts_inertia = zero")
        put("watts_gravity = climbing * speed; watts_wheel_rolling = rubbing * speed")
        put("watts_gear_loss = mechanical - (climbing + rubbing) * speed")
        put("watts_copper_loss = copper_watts; watts_coulomb_drag = zero + iron")

    def _bus_and_supply(self) -> None:
        put = self.put
        put("electronics_watts = zero")
        self._each("electronics", "part = {call}", "electronics_watts += part", book="part")
        self._each("converter", "electronics_watts += {call}")
        put("motors_watts = terminal_watts + driver_watts")
        put("bus_watts = motors_watts + electronics_watts")
        self._each("bus", "bus_watts += {call}")
        if self.balanced:
            put("account[1] = bus_watts")
        self._each("supply", "bus_watts += {call}")
        if not self.limited:
            return
        with self.inside("if mode_size > 0.0:"):
            put("slack = min(slack, 0.5 * mode_size * (slack_high - slack_low))")
        put("traction_left = slack / (traction * weight / wheel_count).real")
        if not self.balanced:
            return
        put("account[0] = bus_watts")
        written: tuple[str, ...] = ("terminal_watts", "shaft_watts", "copper_watts", "driver_watts")
        written += ("electronics_watts", "least_load", "most_current", "most_voltage")
        written += ("most_torque", "traction_left")
        for column, name in enumerate(written, start=2):
            put(f"account[{column}] = {name}")
        for column, slug in enumerate(BASE_EFFECTS, start=len(ACCOUNT)):
            put(f"account[{column}] = watts_{slug}")
