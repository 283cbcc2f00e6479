"""Rolling resistance of the wheels about their own axles.

    F = c_w·N at the rim of each wheel        P = Σ c_w·N·r·|ω|

Sign
    a loss in every direction of rolling.
Source
    coefficient-of-rolling-resistance law; polymer tread on clean hard floor 0.02-0.05, hard rubber
    0.07-0.2 (NORD conveyor design table, conservative).
Holds for
    loads near the nominal one; load_dependent_rolling and sinkage describe how the coefficient
    grows.
Left out
    dependence on speed. The sign of rolling is smooth within 5 mm/s of rest.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class WheelRolling(Effect):
    """Drag at the rim in proportion to the wheel's load."""

    slug = "wheel_rolling"
    title = "rolling of the wheels"
    base = True

    rolling = Parameter(unit="1", default=0.035, bounds=(0.0, 0.5), spread=0.25)
    """Rolling coefficient of a wheel."""

    @staticmethod
    def wheel_drag(load, rolling):
        """N at the rim."""
        return rolling * load

    examples = (WorkedExample("wheel_drag", {"load": 30, "rolling": 0.04}, 1.2, "30·0.04"),)
