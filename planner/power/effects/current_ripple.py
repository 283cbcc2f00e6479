"""Current ripple: a current that swings heats more than its mean.

    P = R·I²·ρ²        ρ² = variance of the current over the square of its mean

Sign
    a loss, ≥ 0; declared as the square because the sign of a swing has no meaning.
Source
    rms of a fluctuating current: <I²> = <I>²·(1 + ρ²); swings come from pulse-width modulation and
    from a restless speed controller.
Holds for
    swings faster than the mechanics, so that the torque is the mean one.
Left out
    loss in the iron and in the bridges. Its power is in proportion to R·I²: without measured
    currents it is the same thing as a higher winding resistance.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class CurrentRipple(Effect):
    """Additional copper loss of a fluctuating current."""

    slug = "current_ripple"
    title = "ripple of the motor currents"
    loss = True
    how_to_measure = "Measure the currents of the motors, or the winding's resistance."

    ripple_squared = Parameter(
        unit="1",
        default=0.25,
        null=0.0,
        bounds=(0.0, 10.0),
        doc="Variance of a motor's current over the square of its mean.",
        spread=0.5,
    )

    @staticmethod
    def motor_loss(current, resistance_now, ripple_squared):
        """W lost in one winding in addition to that of the mean current."""
        return resistance_now * current * current * ripple_squared

    examples = (
        WorkedExample(
            "motor_loss",
            {"current": -0.5, "resistance_now": 4, "ripple_squared": 0.3},
            0.3,
            "4·0.5²·0.3",
        ),
    )
