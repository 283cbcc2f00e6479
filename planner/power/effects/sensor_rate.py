"""Sensor rate: every sample costs energy, and a fast robot samples more often.

    P = e_s·f        f = min(f_0 + k_f·v, f_max), or the sampling rate that the row gives

Sign
    drawn at the electronics' rail, ≥ 0.
Source
    power linear in the sampling frequency: Mei et al., "A case study of mobile robot's energy
    consumption and conservation techniques", 2005; the source paper measured more power at a period
    of 0.02 s than at 0.04 s: two points of one line.
Holds for
    sensors that sleep between samples. v is the speed of the centre, so turning on the spot has the
    rate of standstill.
Left out
    processing whose cost depends on the scene. Below f_max and without the column the term is
    linear in v, and aliased with coulomb_drag and wheel_rolling. Several rates at standstill
    separate them.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known, smaller

_SAMPLING = {
    "energy_per_sample": 0.02,
    "base_rate": 12,
    "rate_per_speed": 40,
    "top_rate": 50,
}  # of the examples


class SensorRate(Effect):
    """Sampling energy of the sensors."""

    slug = "sensor_rate"
    title = "sampling of the sensors"
    loss = True
    how_to_measure = "Vary the sampling rate at standstill, with a column sensor_rate."

    energy_per_sample = Parameter(unit="J", default=0.02, null=0.0, bounds=(0.0, 10.0), spread=0.5)
    """Energy of one sample of all sensors."""
    base_rate = Parameter(unit="Hz", default=10.0, bounds=(0.0, 1e4), fitted=False)
    """Sampling rate at standstill where no rate is measured."""
    rate_per_speed = Parameter(unit="1/m", default=40.0, bounds=(0.0, 1e4), fitted=False)
    """Rise of the sampling rate with speed."""
    top_rate = Parameter(unit="Hz", default=50.0, bounds=(0.0, 1e5), fitted=False)
    """Highest sampling rate."""

    @staticmethod
    def electronics(speed, sensor_rate, energy_per_sample, base_rate, rate_per_speed, top_rate):
        """W of sampling."""
        if known(sensor_rate):
            return energy_per_sample * sensor_rate + 0.0 * (base_rate + rate_per_speed + top_rate)
        return energy_per_sample * smaller(base_rate + rate_per_speed * speed, top_rate)

    examples = (
        WorkedExample(
            "electronics",
            {"speed": 0.5, "sensor_rate": float("nan"), **_SAMPLING},
            0.64,
            "0.02·(12 + 40·0.5)",
        ),
        WorkedExample(
            "electronics",
            {"speed": 2.0, "sensor_rate": float("nan"), **_SAMPLING},
            1.0,
            "0.02·50, the highest rate",
        ),
        WorkedExample(
            "electronics",
            {"speed": 2.0, "sensor_rate": 25.0, **_SAMPLING},
            0.5,
            "0.02·25, the measured rate",
        ),
    )
