"""Surface rolling: each labelled ground has its own factor on wheel and roller drag.

    factor = 1 + e(surface)

Sign
    e > 0: more drag than on the ground for which c_w and c_r hold.
Source
    own; carpet 0.08 against 0.035 on hard floor (priors) is e = 1.3.
Holds for
    grounds with a label ``surface``. A label that the model does not know has e = 0.
Left out
    different factors for wheels and rollers; traction (ground classes of the map).
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
        spread=0.5,
        hidden_at=0.4,
    )
    """Relative change of the drag coefficients on this ground."""

    @staticmethod
    def contact_factor(excess):
        """Factor on the drag of every wheel."""
        return 1.0 + excess

    examples = (WorkedExample("contact_factor", {"excess": 0.4}, 1.4, "1 + 0.4"),)
