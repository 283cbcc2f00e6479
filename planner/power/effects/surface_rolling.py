"""Surface rolling: each labelled ground has its own factor on rolling and roller drag.

    factor = 1 + e(surface)

Sign
    e > 0: a ground that rolls worse than the one on which c_w and c_r were found.
Source
    own; carpet 0.08 against 0.035 on hard floor (priors) is e = 1.3.
Holds for
    grounds told apart by the label ``surface``; where the label is none of the model's, e = 0.
Left out
    another share of wheels and rollers on each ground; traction (ground classes of the map).
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class SurfaceRolling(Effect):
    """Drag of each labelled ground."""

    slug = "surface_rolling"
    title = "kind of ground"
    how_to_measure = "Drive the same on a second kind of ground, with a column surface."

    excess = Parameter(
        unit="1",
        default=0.0,
        null=0.0,
        bounds=(-0.9, 20.0),
        per="surface",
        doc="Relative change of the drag coefficients on this ground.",
        spread=0.5,
        hidden_at=0.4,
    )

    @staticmethod
    def contact_factor(excess):
        """Factor on the drag of every wheel."""
        return 1.0 + excess

    examples = (WorkedExample("contact_factor", {"excess": 0.4}, 1.4, "1 + 0.4"),)
