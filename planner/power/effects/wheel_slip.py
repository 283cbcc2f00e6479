"""Wheel slip: under force the contact creeps, and the wheel turns faster than the robot moves.

    slip σ = k·f/N    sliding speed |σ·rim speed| along the roller's axle    P = Σ |f·σ·rim speed|

The wheel gives the same torque at a higher speed, so the current does not change. With rollers at
45° the rim is faster by √2 times the sliding speed.

Sign
    a loss for driving and braking wheels alike.
Source
    linear creepage at small slip (Kalker, "On the rolling contact of two elastic bodies in the
    presence of dry friction", 1967); k = creep stiffness over traction coefficient, slip of 1-3 %
    on slopes gives 0.02-0.1.
Holds for
    forces well below the traction limit.
Left out
    gross sliding, and lateral error of the path. f is the force along the roller's axle.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import larger, sign


class WheelSlip(Effect):
    """Creep between rollers and ground under traction."""

    slug = "wheel_slip"
    title = "slip of the wheels"
    loss = True

    creep = Parameter(unit="1", default=0.05, null=0.0, bounds=(0.0, 2.0), spread=0.5)
    """Slip per ratio of axle force to load."""

    @staticmethod
    def slip(axis_force, load, nominal_load, rim_speed, sliding_speed, creep):
        """Sliding speed along the roller's axle over the rim's speed."""
        carried = larger(load, 1e-3 * nominal_load)
        return creep * axis_force / carried * sign(rim_speed, sliding_speed)

    examples = (
        WorkedExample(
            "slip",
            {
                "axis_force": -10,
                "load": 25,
                "nominal_load": 30,
                "rim_speed": -50.0,
                "sliding_speed": 0.005,
                "creep": 0.05,
            },
            0.02,
            "0.05·10/25; force and motion point the same way",
        ),
    )
