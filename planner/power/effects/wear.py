"""Wear: the drag of treads and bushes rises with every metre.

    factor = 1 + w·d        d: distance driven, ``odometer``

Sign
    w ≥ 0: drag rises with distance.
Source
    own; 5-20 % over the life of rollers and treads (prior).
Holds for
    a small total change. The odometer starts at zero with the log or the route. The model's
    coefficients are those at its beginning.
Left out
    running-in, the shrinking radius, replacement of parts. Any other drift during a log (warming
    grease, dust) has the same shape; reference laps weeks apart separate them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class Wear(Effect):
    """Drag that rises with distance driven."""

    slug = "wear"
    title = "wear"
    how_to_measure = "Repeat the same laps weeks apart."

    wear_rate = Parameter(
        unit="1/m", default=1e-6, null=0.0, bounds=(0.0, 0.1), spread=1.0, hidden_at=1e-4
    )
    """Relative rise of rolling and roller drag per metre."""

    @staticmethod
    def contact_factor(odometer, wear_rate):
        """Factor on the drag of every wheel."""
        return 1.0 + wear_rate * odometer

    examples = (
        WorkedExample(
            "contact_factor", {"odometer": 2500.0, "wear_rate": 4e-5}, 1.1, "1 + 4e-5·2500"
        ),
    )
