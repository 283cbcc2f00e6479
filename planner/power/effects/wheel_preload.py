"""Wheel preload: four wheels fight each other without moving the robot.

    f_i = ±λ·ν_i with λ = √(λ²)        ν: the axle forces that add up to nothing

For four Mecanum wheels ν is +, +, -, - in the order of the wheels: the front pulls against the
rear with λ newton at every rim.

Sign
    either sign of λ is possible and the leading pair is unknown; the power is the mean of both,
    so it depends on λ² only, which is the parameter. A loss in sum: copper and gear.
Source
    null space of the force balance, own derivation; caused by unequal wheel radii, controller gains
    or wheel speeds that do not fit together.
Holds for
    four driven wheels in contact; three wheels have no such mode and nothing changes.
Left out
    how λ depends on motion.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import root


class WheelPreload(Effect):
    """Internal force between the wheels."""

    slug = "wheel_preload"
    title = "wheels fighting each other"
    loss = True

    preload_squared = Parameter(
        unit="N²",
        default=4.0,
        null=0.0,
        bounds=(0.0, 1e6),
        doc="Square of the internal force along the rim of each wheel.",
        spread=1.0,
    )

    @staticmethod
    def circulation(preload_squared):
        """N per wheel."""
        return root(preload_squared)

    examples = (WorkedExample("circulation", {"preload_squared": 9}, 3.0, "√9"),)
