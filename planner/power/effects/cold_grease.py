"""Cold grease: drag that is high when cold and falls as the gear warms up.

    τ = b·exp(-q·(T - 25 °C))·ω_m

Sign
    a loss. Its power falls with temperature, unlike that of motor_heating.
Source
    exponential law of viscosity against temperature (Reynolds, 1886); q about 0.03 1/K for gear
    greases (prior).
Holds for
    T = ``motor_temp``, else ``ambient_temp``, else 25 °C.
Left out
    channelling and shear thinning of the grease. At a constant temperature it is aliased with
    viscous_drag.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import exponential, known

_OIL = {"viscosity": 2e-6, "temperature_rate": 0.05}  # of the examples


class ColdGrease(Effect):
    """Viscous drag that follows temperature."""

    slug = "cold_grease"
    title = "grease of the gears"
    loss = True

    viscosity = Parameter(unit="N·m·s", default=2e-6, null=0.0, bounds=(0.0, 1.0), spread=0.5)
    """Drag torque of one motor per rad/s of its shaft at 25 °C."""
    temperature_rate = Parameter(
        unit="1/K",
        default=0.03,
        bounds=(0.0, 0.2),
        fitted=False,
        grid=(0.01, 0.02, 0.03, 0.05, 0.08),
    )
    """Relative fall of the viscosity per kelvin."""

    @staticmethod
    def motor_torque(motor_speed, motor_temp, ambient_temp, viscosity, temperature_rate):
        """N·m against the motor's rotation."""
        ambient = ambient_temp if known(ambient_temp) else 25.0
        temperature = motor_temp if known(motor_temp) else ambient
        return viscosity * exponential(-temperature_rate * (temperature - 25.0)) * motor_speed

    examples = (
        WorkedExample(
            "motor_torque",
            {"motor_speed": -200, "motor_temp": 5.0, "ambient_temp": 60.0, **_OIL},
            -1.0873127314e-3,
            "-2e-6·200·e^(0.05·20) = -4e-4·2.718281828",
        ),
        WorkedExample(
            "motor_torque",
            {"motor_speed": 200, "motor_temp": float("nan"), "ambient_temp": 45.0, **_OIL},
            1.4715177647e-4,
            "air instead of motor: 4e-4/e",
        ),
        WorkedExample(
            "motor_torque",
            {"motor_speed": 200, "motor_temp": float("nan"), "ambient_temp": float("nan"), **_OIL},
            4e-4,
            "no temperature known: 2e-6·200",
        ),
    )
