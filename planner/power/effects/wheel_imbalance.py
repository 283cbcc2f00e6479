"""Wheel imbalance: each wheel has a drag of its own.

    factor_i = 1 + e_i - mean(e)

Sign
    e_i above the mean: a wheel that rolls worse than its fellows.
Source
    own; on a robot with three omni wheels and unevenly spread weight it leaves the clean second
    harmonic of the heading that single coefficients cannot follow.
Holds for
    steady differences between wheels, bearings and loads that no other quantity explains. The mean
    is taken off, so that the factors average to 1 and the common part stays with c_w and c_r. A
    wheel at -1 below the mean has no drag at all.
Left out
    imbalance in the sense of a mass off a wheel's axle; a wheel whose motor differs.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class WheelImbalance(Effect):
    """Drag factor of each wheel."""

    slug = "wheel_imbalance"
    title = "differences between wheels"

    excess = Parameter(
        unit="1",
        default=0.0,
        null=0.0,
        bounds=(-1.0, 10.0),
        per="wheel",
        doc="Relative change of this wheel's drag; the mean over wheels is taken off.",
        spread=0.5,
        hidden_at=0.4,
    )

    @staticmethod
    def contact_factor(excess):
        """Factor on the drag of one wheel."""
        return 1.0 + excess

    examples = (WorkedExample("contact_factor", {"excess": -0.3}, 0.7, "1 - 0.3"),)
