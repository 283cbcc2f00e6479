"""Inertia: the force that accelerates body, wheels and rotors.

    F = m·a        M = I_z·dω_z/dt + x_c·F_y - y_c·F_x
    wheel hub  I_w·dω/dt        motor shaft  J·n·dω/dt

Sign
    positive when the robot speeds up. Kinetic energy is an exchange; losses on the way appear as
    copper and gear losses.
Source
    Newton and Euler; a rotor's inertia counts n² times at the wheel. With a 1:27 gear, 12 kg behave
    like 15 kg (own calculation).
Holds for
    accelerations in an inertial frame: a turn at speed v contains ω_z·v. The wheels follow the
    change of velocity in the body frame.
Left out
    gyroscopic moments; offset of the centre of mass in centripetal terms (second order).
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class Inertia(Effect):
    """Mass, yaw inertia and everything that rotates with the wheels."""

    slug = "inertia"
    title = "acceleration"
    base = True
    exchange = True

    yaw_inertia = Parameter(unit="kg·m²", default=1.0, bounds=(1e-4, 1e4))
    """Of the body about the vertical."""
    wheel_inertia = Parameter(unit="kg·m²", default=0.0023, bounds=(0.0, 50.0))
    """Of one wheel; a fit puts all rotating mass here."""
    rotor_inertia = Parameter(unit="kg·m²", default=3.2e-6, bounds=(0.0, 1.0), fitted=False)
    """Of one motor's rotor."""

    @staticmethod
    def body_force(mass, ax, ay, yaw_acceleration, centre_x, centre_y, yaw_inertia):
        """N, N, N·m that accelerate the body."""
        fx = mass * ax
        fy = mass * ay
        return fx, fy, yaw_inertia * yaw_acceleration + centre_x * fy - centre_y * fx

    @staticmethod
    def axle_torque(wheel_inertia, wheel_acceleration):
        """N·m that accelerate one wheel."""
        return wheel_inertia * wheel_acceleration

    @staticmethod
    def motor_torque(rotor_inertia, motor_acceleration):
        """N·m that accelerate one rotor."""
        return rotor_inertia * motor_acceleration

    examples = (
        WorkedExample(
            "body_force",
            {
                "mass": 12,
                "ax": 0.5,
                "ay": -0.25,
                "yaw_acceleration": 2,
                "centre_x": 0.1,
                "centre_y": 0.2,
                "yaw_inertia": 1.5,
            },
            (6.0, -3.0, 1.5),
            "12·0.5; -12·0.25; 1.5·2 + 0.1·(-3) - 0.2·6",
        ),
        WorkedExample(
            "axle_torque", {"wheel_inertia": 0.002, "wheel_acceleration": 3}, 0.006, "0.002·3"
        ),
        WorkedExample(
            "motor_torque", {"rotor_inertia": 3e-6, "motor_acceleration": 80}, 2.4e-4, "3e-6·80"
        ),
    )
