"""Light-load gear drag: an almost idle gear loses more than its efficiency predicts.

    τ = τ_0·exp(-|τ_wheel| / τ_f) / n · sgn(ω_m)

Sign
    a loss. The torque refers to the wheel's side and acts against the rotation.
Source
    measured gear efficiencies fall towards light load (machinedesign.com, planetary gears, about 10
    % an engagement at rated load); the exponential is the simplest law that vanishes with load.
Holds for
    wheel torques from zero up; a constant part belongs to coulomb_drag.
Left out
    dependence on speed and temperature.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import absolute, exponential, sign


class LightLoadGearDrag(Effect):
    """Drag of the gear that fades out under load."""

    slug = "light_load_gear_drag"
    title = "idling gears"
    loss = True

    drag_torque = Parameter(unit="N·m", default=0.02, null=0.0, bounds=(0.0, 100.0), spread=0.5)
    """Drag of one unloaded gear at the wheel's side."""
    fading_torque = Parameter(
        unit="N·m", default=0.2, bounds=(1e-4, 1e4), fitted=False, grid=(0.05, 0.1, 0.2, 0.5, 1.0)
    )
    """Wheel torque at which the drag has fallen to 37 %."""

    @staticmethod
    def motor_torque(wheel_torque, motor_speed, gear_ratio, drag_torque, fading_torque):
        """N·m against the motor's rotation."""
        fading = exponential(-absolute(wheel_torque) / fading_torque)
        return drag_torque * fading / gear_ratio * sign(motor_speed, 2.0)

    examples = (
        WorkedExample(
            "motor_torque",
            {
                "wheel_torque": 0.4,
                "motor_speed": -1e5,
                "gear_ratio": 25,
                "drag_torque": 0.05,
                "fading_torque": 0.2,
            },
            -2.7067056647e-4,
            "-0.05·e^(-2)/25",
        ),
    )
