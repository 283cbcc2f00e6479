"""Vibration: passing rollers and a rough floor dissipate energy by shaking the robot.

    F along the direction of travel        P = F·v

Sign
    a loss in every direction of travel.
Source
    own; every bump takes the same energy, so the power is proportional to their rate.
Holds for
    speeds away from the suspension's resonance. The force vanishes smoothly at standstill.
Left out
    growth with v³ near resonance. It is linear in v and therefore aliased with coulomb_drag and
    rolling. Only a test with lifted wheels, or a measured vibration, separates them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import SLIDING_SPEED, root


class Vibration(Effect):
    """Resistance of rollers and bumps along the path."""

    slug = "vibration"
    title = "shaking"
    loss = True

    shaking_force = Parameter(unit="N", default=0.5, null=0.0, bounds=(0.0, 1e3), spread=1.0)
    """Resistance against the direction of travel."""

    @staticmethod
    def body_force(vx, vy, shaking_force):
        """N, N, N·m that the wheels must supply."""
        force = shaking_force / root(vx * vx + vy * vy + SLIDING_SPEED * SLIDING_SPEED)
        return force * vx, force * vy, 0.0 * force

    examples = (
        WorkedExample(
            "body_force",
            {"vx": -300.0, "vy": 400.0, "shaking_force": 2},
            (-1.2, 1.6, 0.0),
            "2·(-0.6, 0.8); so fast that the smoothing at standstill does not show",
        ),
    )
