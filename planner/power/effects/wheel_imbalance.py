"""Wheel imbalance: each wheel has its own drag.

    factor_i = 1 + e_i - mean(e)

Sign
    e_i above the mean: a wheel with more drag than the others.
Source
    own; three omni wheels and uneven weight give a second harmonic of the heading that common
    coefficients cannot follow.
Holds for
    steady differences between wheels, bearings and loads that no other quantity explains. The mean
    is subtracted: the factors average to 1, and the common part stays with c_w and c_r. A wheel at
    -1 below the mean has no drag.
Left out
    imbalance as a mass off the wheel's axle; differences between motors.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class WheelImbalance(Effect):
    """Drag factor of each wheel."""

    slug = "wheel_imbalance"
    title = "differences between wheels"

    excess = Parameter(
        unit="1", default=0.0, null=0.0, bounds=(-1.0, 10.0), per="wheel", spread=0.5, hidden_at=0.4
    )
    """Relative change of this wheel's drag; the mean over wheels is taken off."""

    @staticmethod
    def contact_factor(excess):
        """Factor on the drag of one wheel."""
        return 1.0 + excess

    examples = (WorkedExample("contact_factor", {"excess": -0.3}, 0.7, "1 - 0.3"),)
