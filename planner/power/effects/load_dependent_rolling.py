"""Load-dependent rolling: the drag coefficients rise with the load of a wheel.

    c(N) = c_0·(N / N_0)^κ        N_0 = nominal load, the robot's own weight over its wheels

Sign
    κ ≥ 0: the coefficient is higher above the nominal load and lower below it. The loss is convex
    in N, so an uneven load costs power.
Source
    Hertz-type contact gives 0.2-0.5 for a soft tread on a hard floor, compaction of soft ground up
    to 1 (priors); κ = 0 is a hard wheel with plain bearings.
Holds for
    loads up to a few times the nominal one. It acts on wheels and rollers alike.
Left out
    the ground's stiffness. sinkage has nearly the same shape; a log with one mass cannot separate
    them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import larger, power_of


class LoadDependentRolling(Effect):
    """Rolling and roller coefficients that rise with load."""

    slug = "load_dependent_rolling"
    title = "load on the wheels"

    exponent = Parameter(unit="1", default=0.3, null=0.0, bounds=(0.0, 1.5), spread=0.5)
    """Exponent of the load in the drag coefficients."""

    @staticmethod
    def contact_factor(load, nominal_load, exponent):
        """Factor on the drag of one wheel."""
        # A wheel about to lift has next to no drag whatever its coefficient; keeps the log finite.
        return power_of(larger(load / nominal_load, 1e-3), exponent)

    examples = (
        WorkedExample(
            "contact_factor", {"load": 120, "nominal_load": 30, "exponent": 0.5}, 2.0, "√(120/30)"
        ),
    )
