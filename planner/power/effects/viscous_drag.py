"""Viscous drag: bearing grease and eddy currents, a motor torque proportional to speed.

    τ = b·ω_m        P = Σ b·ω_m²

Sign
    a loss; the torque has the sign of the motor's speed.
Source
    viscous damping of the Pittman 9233S013's data sheet as a stand-in for 36-40 mm motors; eddy
    currents add to the same term because their torque is linear in speed too.
Holds for
    warm grease; cold_grease describes how it stiffens.
Left out
    hysteresis and brushes, whose torque does not depend on speed (coulomb_drag).
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class ViscousDrag(Effect):
    """Drag torque of each drive that rises with speed."""

    slug = "viscous_drag"
    title = "viscous drag of motor and gear"
    loss = True

    viscous_torque = Parameter(
        unit="N·m·s", default=2.3e-6, null=0.0, bounds=(0.0, 1.0), spread=0.3
    )
    """Drag torque of one motor per rad/s of its shaft."""

    @staticmethod
    def motor_torque(motor_speed, viscous_torque):
        """N·m against the motor's rotation."""
        return viscous_torque * motor_speed

    examples = (
        WorkedExample(
            "motor_torque", {"motor_speed": -200, "viscous_torque": 3e-6}, -6e-4, "-200·3e-6"
        ),
    )
