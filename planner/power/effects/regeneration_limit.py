"""Regeneration limit: the share of the braking power that returns.

    each motor   P → χ_motor·P  where P < 0
    the bus      P → χ_source·P where P < 0

Sign
    refused power is lost: both terms add (1 - χ)·|P| to a negative power.
Source
    derived; a bench supply or a series diode takes no power back (χ_source = 0), a battery 0.8-0.95
    of the energy (charging efficiency, prior). Motors on one bus feed each other before anything
    reaches the source.
Holds for
    any split between braking and driving motors.
Left out
    a full battery that refuses charge; rising bus voltage.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import negative


class RegenerationLimit(Effect):
    """Shares of braking power that drivers and source accept."""

    slug = "regeneration_limit"
    title = "refused braking power"
    loss = True

    motor_share = Parameter(unit="1", default=1.0, null=1.0, bounds=(0.0, 1.0), hidden_at=0.0)
    """Share of a motor's negative power that its driver passes to the bus."""
    source_share = Parameter(unit="1", default=0.0, null=1.0, bounds=(0.0, 1.0))
    """Share of negative bus power that the source takes back."""

    @staticmethod
    def motor_power(motor_watts, motor_share):
        """W of braking that one driver refuses."""
        return (motor_share - 1.0) * negative(motor_watts)

    @staticmethod
    def supply(bus_watts, source_share):
        """W that the source refuses."""
        return (source_share - 1.0) * negative(bus_watts)

    examples = (
        WorkedExample("motor_power", {"motor_watts": -8, "motor_share": 0.75}, 2.0, "0.25·8"),
        WorkedExample("motor_power", {"motor_watts": 8, "motor_share": 0.75}, 0.0, "not braking"),
        WorkedExample("supply", {"bus_watts": -5, "source_share": 0.9}, 0.5, "0.1·5"),
    )
