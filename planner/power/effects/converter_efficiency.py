"""Converter efficiency: the regulator between the bus and the electronics.

    P = P_el·(1/η_dc - 1)

Sign
    a loss, ≥ 0, in addition to the power at the electronics' rail.
Source
    definition of efficiency; 0.85-0.92 is usual for step-down converters of this size (prior).
Holds for
    loads near the converter's rating.
Left out
    the fall of the efficiency at light load. With a constant electronics load this effect is
    aliased with a larger constant. Only a varying load (sensor_rate), or a measurement on both
    sides of the converter, separates them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample


class ConverterEfficiency(Effect):
    """Loss of the converter that feeds control and sensors."""

    slug = "converter_efficiency"
    title = "voltage converter"
    loss = True
    how_to_measure = "Vary the load of the electronics, or measure before and behind it."

    efficiency = Parameter(unit="1", default=0.88, null=1.0, bounds=(0.3, 1.0), spread=0.05)
    """Share of the bus power that reaches the electronics."""

    @staticmethod
    def converter(electronics_watts, efficiency):
        """W lost in the converter."""
        return electronics_watts * (1.0 / efficiency - 1.0)

    examples = (
        WorkedExample(
            "converter", {"electronics_watts": 6, "efficiency": 0.8}, 1.5, "6·(1.25 - 1)"
        ),
    )
