"""Drag of the rollers about their own axles. It makes sideways travel cost more than forward.

    F = c_r·N·sgn(u) + d_r·u along each roller's rolling direction        P = Σ F·u

u is the surface speed of the contact roller (planner.power.kinematics): for Mecanum wheels √2·(v_y
+ ω_z·x), zero forward, √2·v sideways, v diagonally. This gives the dependence on heading; no fitted
cosine is needed.

Sign
    a loss in every direction.
Source
    derived from the kinematics; c_r 0.03-0.08 for a roller on a plain bush (bush friction 0.15 at a
    quarter of the roller's radius plus tread hysteresis).
Holds for
    Mecanum and omni wheels whose contact roller turns freely about its own axle.
Left out
    static friction of a roller at rest, which helps forward traction a little.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import sign


class RollerDrag(Effect):
    """Coulomb and viscous drag of the contact rollers."""

    slug = "roller_drag"
    title = "rolling of the rollers"
    base = True

    roller = Parameter(unit="1", default=0.045, bounds=(0.0, 0.5), spread=0.25)
    """Drag coefficient of a roller."""
    roller_viscous = Parameter(unit="N·s/m", default=0.0, bounds=(0.0, 200.0))
    """Drag that grows with roller speed."""

    @staticmethod
    def roller_drag(load, roller_speed, sliding_speed, roller, roller_viscous):
        """N along the roller's rolling direction."""
        return roller * load * sign(roller_speed, sliding_speed) + roller_viscous * roller_speed

    examples = (
        WorkedExample(
            "roller_drag",
            {
                "load": 30,
                "roller_speed": -80.0,
                "sliding_speed": 0.005,
                "roller": 0.05,
                "roller_viscous": 0.02,
            },
            -3.1,
            "-0.05·30 - 0.02·80; so fast that the smooth sign is -1",
        ),
    )
