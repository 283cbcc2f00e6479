"""Yaw scrub: a constant moment against every turn.

    M = M_s·sgn(ω_z)        P = M_s·|ω_z|

Sign
    against the yaw rate; a loss.
Source
    own; rolling and roller drag in a turn are part of the base model, through the kinematics of
    each wheel. This effect adds the contact patches of finite width.
Holds for
    a hard floor and loads near the nominal one.
Left out
    dependence on load and on the radius of the turn (Dogru & Marques, 2017, for skid steering).
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import sign


class YawScrub(Effect):
    """Additional moment of scrubbing contacts."""

    slug = "yaw_scrub"
    title = "scrub in turns"
    loss = True

    scrub_moment = Parameter(unit="N·m", default=1.0, null=0.0, bounds=(0.0, 1e4), spread=1.0)
    """Moment against the yaw rate in addition to that of rolling."""

    @staticmethod
    def body_force(wz, scrub_moment):
        """N, N, N·m that the wheels must supply."""
        moment = scrub_moment * sign(wz, 0.01)
        return 0.0 * moment, 0.0 * moment, moment

    examples = (
        WorkedExample(
            "body_force",
            {"wz": -100.0, "scrub_moment": 1.5},
            (0.0, 0.0, -1.5),
            "-M_s; the sign is smooth within 0.01 rad/s of rest",
        ),
    )
