"""Gear loss: friction of the teeth, proportional to the transmitted torque.

    driving      τ_m = τ / (n·η)
    back-driven  τ_m = τ·η_b / n        η_b = 2 - 1/η + gear_return

Sign
    a loss in both directions: the motor supplies more, or receives less.
Source
    symmetric tooth friction. The same loss per torque in both directions gives η_b = 2 - 1/η; 0.9
    for each stage of a 36 mm planetary gear (greensky-power), about 10 % an engagement
    (machinedesign.com).
Holds for
    η > 0.5; below it the gear is self-locking.
Left out
    drag without load (coulomb_drag, light_load_gear_drag). A wheel at rest counts as back-driven:
    tooth friction then helps to hold the load.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import larger, sign, smaller

_GEAR = {"wheel_torque": 2.0, "gear_ratio": 25, "efficiency": 0.8}  # of the examples


class GearLoss(Effect):
    """Load-dependent friction of the gear."""

    slug = "gear_loss"
    title = "gear"
    base = True

    efficiency = Parameter(unit="1", default=0.8, bounds=(0.5, 1.0), spread=0.05)
    """Share that passes when driving."""

    @staticmethod
    def gear(wheel_torque, motor_speed, gear_ratio, gear_return, efficiency):
        """N·m at the motor's side."""
        # Between a gear that locks itself and one without loss; beyond, it would create energy.
        backward = smaller(larger(2.0 - 1.0 / efficiency + gear_return, 0.0), 1.0)
        direction = 1.0 if wheel_torque.real >= 0.0 else -1.0
        driving = larger(sign(motor_speed * direction, 2.0), 0.0)
        return wheel_torque / gear_ratio * (backward + (1.0 / efficiency - backward) * driving)

    examples = (
        WorkedExample("gear", {"motor_speed": 1e4, "gear_return": 0, **_GEAR}, 0.1, "2 / (25·0.8)"),
        WorkedExample(
            "gear",
            {"motor_speed": -1e4, "gear_return": -0.05, **_GEAR},
            0.056,
            "2·(2 - 1/0.8 - 0.05) / 25",
        ),
    )
