"""Copper loss: heat of the current in the windings.

    I = τ_shaft / k_t        P = Σ I²·R

Sign
    a loss; summed motor by motor, since (ΣI)²·R would be n times too much.
Source
    permanent-magnet motor; data sheet of the Pittman 9233S013 as a stand-in for 36-40 mm motors.
Holds for
    25 °C; motor_heating changes R and k_t with temperature.
Left out
    inductance, and the voltage drop at the brushes beyond the data sheet's resistance.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class CopperLoss(Effect):
    """Resistive loss of the motors."""

    slug = "copper_loss"
    title = "motor windings"
    base = True

    resistance = Parameter(unit="Ω", default=3.94, bounds=(1e-3, 100.0), spread=0.1)
    """Of one motor at 25 °C."""
    torque_constant = Parameter(
        unit="N·m/A", default=0.0373, bounds=(1e-4, 10.0), fitted=False, spread=0.05
    )
    """Of one motor at 25 °C; only R/k_t² shows without currents or temperatures."""

    @staticmethod
    def winding_resistance(resistance):
        """Ω of one motor, cold."""
        return resistance

    @staticmethod
    def motor_constant(torque_constant):
        """N·m/A of one motor, cold."""
        return torque_constant

    @staticmethod
    def motor_loss(current, resistance_now):
        """W lost in one winding."""
        return resistance_now * current * current

    examples = (
        WorkedExample("winding_resistance", {"resistance": 3.9}, 3.9, "the value itself"),
        WorkedExample("motor_constant", {"torque_constant": 0.037}, 0.037, "the value itself"),
        WorkedExample("motor_loss", {"current": 0.5, "resistance_now": 4}, 1.0, "4·0.5²"),
    )
