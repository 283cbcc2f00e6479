"""Coulomb drag: bearings, brushes and hysteresis, a constant torque at the motor's shaft.

    τ = τ_c·sgn(ω_m)        P = Σ τ_c·|ω_m|

Sign
    a loss. At rest the same friction helps to hold a load; current flows only for the excess.
Source
    no-load current of the motor's data sheet (0.113 A · 0.0373 N·m/A = 4.2 mN·m).
Holds for
    a motor that turns; the sign is smooth within 2 rad/s of the shaft.
Left out
    the part that grows with speed (viscous_drag).
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import sign


class CoulombDrag(Effect):
    """Constant friction torque of each drive."""

    slug = "coulomb_drag"
    title = "motor friction"
    base = True

    coulomb_torque = Parameter(unit="N·m", default=4.2e-3, bounds=(0.0, 10.0), spread=0.2)
    """Friction torque at one motor's shaft."""

    @staticmethod
    def motor_torque(motor_speed, coulomb_torque):
        """N·m against the motor's rotation."""
        return coulomb_torque * sign(motor_speed, 2.0)

    @staticmethod
    def static_torque(coulomb_torque):
        """N·m that the friction can hold at rest."""
        return coulomb_torque

    examples = (
        WorkedExample(
            "motor_torque", {"motor_speed": -1e5, "coulomb_torque": 0.004}, -0.004, "-τ_c"
        ),
        WorkedExample("static_torque", {"coulomb_torque": 0.004}, 0.004, "τ_c"),
    )
