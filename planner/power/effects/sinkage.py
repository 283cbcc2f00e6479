"""Sinkage: the wheels press a rut into soft ground.

    F = k·N·(N / N_0)^(1/3) at the rim of each wheel

Sign
    a loss in every direction of rolling.
Source
    compaction resistance of Bekker, Introduction to Terrain-Vehicle Systems, 1969: for a plate
    exponent of 1 the resistance rises with load to the power 4/3. k = 0.03-0.3 from firm to loose
    soil (prior).
Holds for
    the first pass, with a rut much shallower than the wheel's radius.
Left out
    bulldozing, slip sinkage, passes in an existing rut. load_dependent_rolling together with
    rolling has nearly the same shape; runs with several masses and a second floor separate them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import larger, power_of


class Sinkage(Effect):
    """Compaction of soft ground under the wheels."""

    slug = "sinkage"
    title = "sinking into the ground"
    loss = True

    compaction = Parameter(
        unit="1", default=0.05, null=0.0, bounds=(0.0, 5.0), spread=1.0, hidden_at=0.01
    )
    """Resistance over load at the nominal load."""

    @staticmethod
    def wheel_drag(load, nominal_load, compaction):
        """N at the rim."""
        return compaction * load * power_of(larger(load / nominal_load, 1e-3), 1.0 / 3.0)

    examples = (
        WorkedExample(
            "wheel_drag", {"load": 240, "nominal_load": 30, "compaction": 0.05}, 24.0, "0.05·240·∛8"
        ),
    )
