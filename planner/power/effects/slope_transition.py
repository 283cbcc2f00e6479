"""Slope transition: crossing the edge of a ramp costs more than the slope itself.

    F = k·|dγ/dt| along the direction of travel        P = k·|dγ/dt|·v

Sign
    k ≥ 0, a resistance at every edge, upper and lower.
Source
    own; the source paper calls the transition its main contribution but prints no equation. The
    change of climbing power needs no term of its own: under the footprint, an edge becomes a ramp
    of one wheelbase.
Holds for
    edges crossed at speeds at which the controller settles within a wheelbase.
Left out
    lifting wheels; oscillation after the edge; turning on the spot, which has no direction of
    travel. The force vanishes smoothly at standstill.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import SLIDING_SPEED, root


class SlopeTransition(Effect):
    """Resistance while the slope under the robot changes."""

    slug = "slope_transition"
    title = "edges of slopes"
    loss = True

    transition_drag = Parameter(
        unit="N·s/rad", default=5.0, null=0.0, bounds=(0.0, 1e4), spread=1.0
    )
    """Resistance per rate of change of the slope."""

    @staticmethod
    def body_force(vx, vy, slope_rate, transition_drag):
        """N, N, N·m that the wheels must supply."""
        force = (
            transition_drag * slope_rate / root(vx * vx + vy * vy + SLIDING_SPEED * SLIDING_SPEED)
        )
        return force * vx, force * vy, 0.0 * force

    examples = (
        WorkedExample(
            "body_force",
            {"vx": 300.0, "vy": -400.0, "slope_rate": 0.5, "transition_drag": 8},
            (2.4, -3.2, 0.0),
            "8·0.5·(0.6, -0.8); so fast that the smoothing at standstill does not show",
        ),
    )
