"""Presliding of the rollers: each yields a little before its friction is complete.

    factor = 1 - x·(1 - exp(-1/x))        x = p·|rim speed| / |roller speed|

A wheel sets down one roller after another. Each arrives without load and stays in contact while the
rim travels the distance between two rollers. Meanwhile it moves sideways by that distance times
roller speed over rim speed. Dry friction of bush and tread is complete only after a presliding
path; on that path it rises as 1 - exp(-path/σ). The factor is the mean over a contact, with p = σ
over the distance between two rollers. A wheel that rolls almost straight ahead therefore has little
roller drag, and the drag of a robot changes smoothly with its heading.

Sign
    less drag than complete friction, and the less, the steeper the roller's path; p ≥ 0.
Source
    derived here from the friction law of Dahl, "A solid friction model", The Aerospace Corporation,
    TOR-0158(3107-18)-1, 1968; a tyre's side force builds up in the same way (Pacejka, "Tyre and
    Vehicle Dynamics", brush model). σ 1-5 mm for rubber on a bush with play, rollers every 30-60
    mm.
Holds for
    rollers that have come to rest about their own axles before they touch the ground.
Left out
    presliding of wheels, which never leave the ground; the roller's inertia.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import SLIDING_SPEED, absolute, exponential, root

_NOTHING = 1e-9  # keeps 1/x finite where the effect is not there


class RollerPresliding(Effect):
    """Roller drag that builds up over a path."""

    slug = "roller_presliding"
    title = "rollers that give before they turn"

    presliding = Parameter(unit="1", default=0.1, null=0.0, bounds=(0.0, 2.0), spread=0.5)
    """Path over which a roller's friction builds up, over the distance between two rollers."""

    @staticmethod
    def roller_factor(rim_speed, roller_speed, presliding):
        """Factor on the drag of one wheel's rollers."""
        sideways = root(roller_speed * roller_speed + SLIDING_SPEED * SLIDING_SPEED)
        steep = presliding * absolute(rim_speed) / sideways
        return 1.0 - steep * (1.0 - exponential(-1.0 / (steep + _NOTHING)))

    examples = (
        WorkedExample(
            "roller_factor",
            {"rim_speed": -0.3, "roller_speed": 0.012, "presliding": 0.0433333333333},
            0.3678794412,
            "√(0.012² + 0.005²) = 0.013, x = 1, 1 - (1 - 1/e)",
        ),
    )
