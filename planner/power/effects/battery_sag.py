"""Battery sag: loss in the battery's internal resistance.

    I = P / U                              loss = R_b·I²
    I = 2·P / (V + √(V² - 4·R_b·P))        where U is not known

U is the voltage under load, V that without load. The second formula is the smaller root of V·I -
R_b·I² = P, in a form without a special case for R_b = 0.

Sign
    P is the power that leaves the battery's terminals; charging loses too.
Source
    internal-resistance model, own solution of the quadratic.
Holds for
    power at the source. A meter at the terminals does not see this loss. U is ``battery_voltage``,
    since a log measures it while the current flows. Used as the voltage without load, it would
    count the sag twice and make a large resistance about 10 % too small. Beyond P = V²/(4·R_b) the
    battery cannot deliver the power, and the current stays at 2·P/V.
Left out
    polarisation, state of charge, temperature of the cells.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known, larger, root


class BatterySag(Effect):
    """Loss in the internal resistance of the battery."""

    slug = "battery_sag"
    title = "inside the battery"
    loss = True
    before_meter = True
    how_to_measure = "Measure the power at the source, and state this in the mapping file."

    internal_resistance = Parameter(
        unit="Ω", default=0.08, null=0.0, bounds=(0.0, 10.0), spread=0.5
    )
    """Of the battery with its wiring."""
    open_circuit_voltage = Parameter(unit="V", default=25.2, bounds=(1.0, 1e5), fitted=False)
    """Voltage without load where none is measured."""

    @staticmethod
    def supply(bus_watts, battery_voltage, internal_resistance, open_circuit_voltage):
        """W lost in the battery."""
        if known(battery_voltage):
            current = bus_watts / battery_voltage
        else:
            spare = larger(open_circuit_voltage**2 - 4.0 * internal_resistance * bus_watts, 0.0)
            current = 2.0 * bus_watts / (open_circuit_voltage + root(spare))
        return internal_resistance * current * current

    examples = (
        WorkedExample(
            "supply",
            {
                "bus_watts": 16,
                "battery_voltage": float("nan"),
                "internal_resistance": 1,
                "open_circuit_voltage": 10,
            },
            4.0,
            "√(100 - 64) = 6, I = 32/16 = 2 A, 1·2²",
        ),
        WorkedExample(
            "supply",
            {
                "bus_watts": -11,
                "battery_voltage": 10,
                "internal_resistance": 1,
                "open_circuit_voltage": 12,
            },
            1.21,
            "charging: I = -11/10 A, 1·1.1²",
        ),
    )
