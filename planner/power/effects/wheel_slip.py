"""Wheel slip: under force the contact creeps, and the wheel turns more than the robot moves.

    slip σ = k·f/N        P = Σ |f|·σ·|r·ω| = Σ k·f²/N·|r·ω|

written as the axle torque r·k·f²/N·sgn(ω), which does the same work at the wheel speed of rolling
without slip.

Sign
    a loss for driving and braking wheels alike.
Source
    linear creepage at small slip (Kalker, "On the rolling contact of two elastic bodies in the
    presence of dry friction", 1967); k = creep stiffness over traction coefficient, slip of 1-3 %
    on slopes gives 0.02-0.1.
Holds for
    forces well below the traction limit.
Left out
    gross sliding and the lateral shortfall of the path. f is the force along the roller's axle.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import SLIDING_SPEED, larger, sign


class WheelSlip(Effect):
    """Creep between rollers and ground under traction."""

    slug = "wheel_slip"
    title = "slip of the wheels"

    creep = Parameter(
        unit="1",
        default=0.05,
        null=0.0,
        bounds=(0.0, 2.0),
        doc="Slip per ratio of axle force to load.",
        spread=0.5,
    )

    @staticmethod
    def axle_torque(axis_force, load, nominal_load, rim_speed, wheel_radius, creep):
        """N·m at the axle of one wheel."""
        carried = larger(load, 1e-3 * nominal_load)
        return (
            wheel_radius
            * creep
            * axis_force
            * axis_force
            / carried
            * sign(rim_speed, SLIDING_SPEED)
        )

    examples = (
        WorkedExample(
            "axle_torque",
            {
                "axis_force": -10,
                "load": 25,
                "nominal_load": 30,
                "rim_speed": -50.0,
                "wheel_radius": 0.08,
                "creep": 0.05,
            },
            -0.016,
            "-0.08·0.05·100/25",
        ),
    )
