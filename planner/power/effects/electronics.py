"""Electronics: constant power of controller and sensors, at rest and in motion.

    P = P_0

Sign
    drawn from the bus, ≥ 0.
Source
    Mei et al., "A case study of mobile robot's energy consumption and conservation techniques",
    2005: a constant controller power in addition to the motors.
Holds for
    a controller that does the same work at rest and in motion.
Left out
    the part that rises with the sampling rate (sensor_rate) and the regulator's loss
    (converter_efficiency).
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class Electronics(Effect):
    """Constant load of control and sensing."""

    slug = "electronics"
    title = "electronics"
    base = True

    power = Parameter(unit="W", default=5.0, bounds=(0.0, 500.0))
    """Constant load on the bus."""

    @staticmethod
    def electronics(power):
        """W drawn at the electronics' rail."""
        return power

    examples = (WorkedExample("electronics", {"power": 5.3}, 5.3, "the constant itself"),)
