"""Wheel preload: four wheels push against each other without moving the robot.

    f_i = ±λ·ν_i with λ = √(λ²)        ν: the axle forces whose sum is zero

For four Mecanum wheels ν is +, +, -, - in the order of the wheels: the front pulls against the rear
with λ newtons at every rim.

Sign
    the sign of λ is unknown, and the power is the mean of both signs. It depends only on λ², which
    is therefore the parameter. In total it is a loss, in copper and gear.
Source
    null space of the force balance, own derivation. Causes are unequal wheel radii, controller
    gains, or inconsistent wheel speeds.
Holds for
    four driven wheels in contact. Three wheels have no such mode, so nothing changes.
Left out
    dependence of λ on the motion.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import root


class WheelPreload(Effect):
    """Internal force between the wheels."""

    slug = "wheel_preload"
    title = "wheels fighting each other"
    loss = True

    preload_squared = Parameter(unit="N²", default=4.0, null=0.0, bounds=(0.0, 1e6), spread=1.0)
    """Square of the internal force along the rim of each wheel."""

    @staticmethod
    def circulation(preload_squared):
        """N per wheel."""
        return root(preload_squared)

    examples = (WorkedExample("circulation", {"preload_squared": 9}, 3.0, "√9"),)
