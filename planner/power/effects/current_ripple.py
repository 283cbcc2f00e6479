"""Current ripple: a fluctuating current heats more than its mean.

    P = R·I²·ρ²        ρ² = variance of the current over the square of its mean

Sign
    a loss, ≥ 0. The parameter is the square, since the sign of a fluctuation has no meaning.
Source
    rms of a fluctuating current: <I²> = <I>²·(1 + ρ²); fluctuations come from pulse-width
    modulation and from an oscillating speed controller.
Holds for
    fluctuations faster than the mechanics, so the torque is the mean.
Left out
    losses in iron and bridges. The power is proportional to R·I²: without measured currents it is
    aliased with a higher winding resistance.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class CurrentRipple(Effect):
    """Additional copper loss of a fluctuating current."""

    slug = "current_ripple"
    title = "ripple of the motor currents"
    loss = True
    how_to_measure = "Measure the currents of the motors, or the winding's resistance."

    ripple_squared = Parameter(unit="1", default=0.25, null=0.0, bounds=(0.0, 10.0), spread=0.5)
    """Variance of a motor's current over the square of its mean."""

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
