"""Motor heating: warm copper has more resistance, warm magnets are weaker.

    R   = R_25·(1 + α·(T - 25 °C))
    k_t = k_25·(1 + β·s·(T - 25 °C))

s is the temperature rise of the magnets as a share of the measured rise.

Sign
    α > 0, β < 0: a warm motor needs more current for the same torque, and loses more at that
    current. Both raise the power at a given load. A motor below 25 °C needs less.
Source
    α = 0.00393 1/K, annealed copper (IEC 60028); β = -0.0020 1/K, remanence of ferrite magnets
    (data-sheet value; -0.0012 1/K for NdFeB). The source paper gives the first and describes the
    second in words.
Holds for
    temperatures below demagnetisation. ``motor_temp`` is that of the windings. Without the column
    nothing changes.
Left out
    the cause of the temperature (a heat balance along the route), and differences between the
    motors of one robot.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known

_MAGNETS = {
    "copper_coefficient": 0.004,
    "magnet_coefficient": -0.002,
    "magnet_share": 0.5,
}  # of the examples


class MotorHeating(Effect):
    """Resistance and torque constant that follow the motors' temperature."""

    slug = "motor_heating"
    title = "heat of the motors"

    copper_coefficient = Parameter(
        unit="1/K", default=0.00393, null=0.0, bounds=(0.0, 0.02), spread=0.1
    )
    """Relative rise of the winding's resistance per kelvin."""
    magnet_coefficient = Parameter(
        unit="1/K", default=-0.0020, null=0.0, bounds=(-0.005, 0.0), spread=0.3
    )
    """Relative change of the torque constant per kelvin."""
    magnet_share = Parameter(unit="1", default=1.0, bounds=(0.0, 1.5), fitted=False)
    """Temperature rise of the magnets as a share of motor_temp's."""

    @staticmethod
    def winding(motor_temp, copper_coefficient, magnet_coefficient, magnet_share):
        """Factors on resistance and torque constant."""
        rise = motor_temp - 25.0 if known(motor_temp) else 0.0
        return 1.0 + copper_coefficient * rise, 1.0 + magnet_coefficient * magnet_share * rise

    examples = (
        WorkedExample(
            "winding", {"motor_temp": 75, **_MAGNETS}, (1.2, 0.95), "1 + 0.004·50; 1 - 0.002·0.5·50"
        ),
        WorkedExample(
            "winding", {"motor_temp": float("nan"), **_MAGNETS}, (1.0, 1.0), "temperature not known"
        ),
    )
