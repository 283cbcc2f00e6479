"""Vibration: rollers that pass one after another, and a rough floor, shake energy away.

    F along the direction of travel        P = F·v

Sign
    a loss in every direction of travel.
Source
    own; the same energy is lost at every bump, so that the power is in proportion to their rate.
Holds for
    speeds away from resonance of the suspension. Vanishes smoothly at standstill.
Left out
    growth with v³ near resonance. Being linear in v it looks like coulomb_drag (and rolling); only
    wheels off the ground, or a measured vibration, tell them apart.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import SLIDING_SPEED, root


class Vibration(Effect):
    """Resistance of rollers and bumps along the path."""

    slug = "vibration"
    title = "shaking"
    loss = True

    shaking_force = Parameter(
        unit="N",
        default=0.5,
        null=0.0,
        bounds=(0.0, 1e3),
        doc="Resistance against the direction of travel.",
        spread=1.0,
    )

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
