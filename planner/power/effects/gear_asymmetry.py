"""Gear asymmetry: the teeth lose more, or less, when the load drives the motor.

    η_b = 2 - 1/η + δ

Sign
    δ < 0: less braking power returns than with symmetric tooth friction.
Source
    definition; helical and worm gears deviate from the symmetric law, spur and planetary gears
    hardly.
Holds for
    η_b between 0 (self-locking) and 1; the gear limits it to that range.
Left out
    drag without load. Braking power lost in the driver or refused by the source is similar
    (regeneration_limit). It occurs only at negative power, while δ acts on every braking wheel.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class GearAsymmetry(Effect):
    """Efficiency of the gear when driven backwards."""

    slug = "gear_asymmetry"
    title = "gear driven backwards"

    return_change = Parameter(unit="1", default=-0.1, null=0.0, bounds=(-0.8, 0.5), spread=0.5)
    """Departure of the back-driven efficiency from 2 - 1/η."""

    @staticmethod
    def gear_return(return_change):
        """Change of the back-driven efficiency."""
        return return_change

    examples = (WorkedExample("gear_return", {"return_change": -0.08}, -0.08, "the change itself"),)
