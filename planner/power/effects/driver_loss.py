"""Driver loss: heat in the bridges between battery and motors.

    P = R_on·I² + V_d·|I| + P_sw·active

Sign
    a loss, ≥ 0, counted bridge by bridge; ``active`` falls to 0 where a motor neither turns nor
    holds.
Source
    path resistance of a BTN7971-type half bridge from its data sheet's typical values, as a prior;
    switching loss at a fixed pulse frequency is taken as independent of the current.
Holds for
    bridges that switch at a fixed frequency with currents below their limit.
Left out
    the rise of R_on with temperature; dead time. R_on·I² is aliased with the windings' R·I² when R
    is fitted, so only V_d and P_sw are fitted.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import absolute


class DriverLoss(Effect):
    """Conduction and switching loss of the motor bridges."""

    slug = "driver_loss"
    title = "motor drivers"
    loss = True

    bridge_resistance = Parameter(
        unit="Ω", default=0.03, null=0.0, bounds=(0.0, 10.0), fitted=False, spread=0.5
    )
    """On-resistance of one bridge's current path."""
    diode_voltage = Parameter(
        unit="V", default=0.0, null=0.0, bounds=(0.0, 5.0), spread=0.5, hidden_at=0.5
    )
    """Constant voltage drop in one bridge."""
    switching_power = Parameter(unit="W", default=0.15, null=0.0, bounds=(0.0, 50.0), spread=0.5)
    """Lost in one bridge while it drives its motor."""

    @staticmethod
    def driver(current, active, bridge_resistance, diode_voltage, switching_power):
        """W lost in one bridge."""
        return (
            bridge_resistance * current * current
            + diode_voltage * absolute(current)
            + switching_power * active
        )

    examples = (
        WorkedExample(
            "driver",
            {
                "current": -2,
                "active": 0.5,
                "bridge_resistance": 0.03,
                "diode_voltage": 0.7,
                "switching_power": 0.16,
            },
            1.6,
            "0.03·4 + 0.7·2 + 0.16·0.5",
        ),
    )
