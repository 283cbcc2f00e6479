"""Stiction: higher friction while the contact hardly moves.

    factor = 1 + s·exp(-(u/u_s)²)        u = √(rim speed² + roller speed²)

u is the rolling speed of that wheel's contact. Turning on the spot is therefore not standstill, nor
is a wheel of which only the rollers turn.

Sign
    s ≥ 0: more drag at creep speed.
Source
    Stribeck curve in the form of Armstrong-Hélouvry, Dupont, Canudas de Wit, "A survey of models,
    analysis tools and compensation methods for the control of machines with friction", Automatica
    30(7), 1994; s 0.3-1, u_s 0.02-0.05 m/s (priors). It is the law of static and sliding friction
    that the source paper mentions but does not print.
Holds for
    slow changes of speed.
Left out
    breakaway and stick-slip, which need a state; friction inside motor and gear.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import exponential


class Stiction(Effect):
    """Rise of rolling and roller drag near standstill."""

    slug = "stiction"
    title = "friction at creep speed"

    strength = Parameter(unit="1", default=0.5, null=0.0, bounds=(0.0, 5.0), spread=0.5)
    """Excess of static over sliding friction."""
    stiction_speed = Parameter(
        unit="m/s",
        default=0.03,
        bounds=(1e-3, 1.0),
        fitted=False,
        grid=(0.01, 0.02, 0.03, 0.05, 0.1),
    )
    """Contact speed at which the excess has fallen to 37 %."""

    @staticmethod
    def contact_factor(rim_speed, roller_speed, strength, stiction_speed):
        """Factor on the drag of one wheel."""
        square = rim_speed * rim_speed + roller_speed * roller_speed
        return 1.0 + strength * exponential(-square / (stiction_speed * stiction_speed))

    examples = (
        WorkedExample(
            "contact_factor",
            {"rim_speed": 0.03, "roller_speed": -0.04, "strength": 0.8, "stiction_speed": 0.05},
            1.2943035529,
            "1 + 0.8·exp(-(0.03² + 0.04²)/0.05²) = 1 + 0.8/e",
        ),
    )
