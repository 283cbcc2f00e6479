"""Every input of the power model, once: its name, unit, sign and meaning.

This is the one vocabulary. Columns of a telemetry log, arguments of an effect's formula and fields
of the API use these names and no others. The order of ``QUANTITIES`` is the order of the columns
of a *row*, the plain float array that the compiled power model reads (``INDEX[name]`` is a column).

Frames: body x forward, y left, z along the normal of the surface; angles in rad, counter-clockwise
seen from above, REP-103 (pitch > 0 is nose down). A quantity that is not known is NaN in a row
where ``default`` is NaN; an effect that reads it says what it does then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

NOT_KNOWN = math.nan
STANDARD_GRAVITY = 9.80665  # m/s2, conventional value, ISO 80000-3


@dataclass(frozen=True)
class Quantity:
    """One input: what it is called, what it is measured in, what a positive value means."""

    name: str
    unit: str
    meaning: str
    default: float = 0.0


QUANTITIES: tuple[Quantity, ...] = (
    Quantity("vx", "m/s", "velocity of the geometric centre, forward"),
    Quantity("vy", "m/s", "velocity of the geometric centre, to the left"),
    Quantity("wz", "rad/s", "yaw rate, counter-clockwise"),
    Quantity("ax", "m/s²", "acceleration of the centre along body x, without gravity"),
    Quantity("ay", "m/s²", "acceleration of the centre along body y, without gravity"),
    Quantity("yaw_acceleration", "rad/s²", "time derivative of wz"),
    Quantity("gravity_x", "m/s²", "gravity along body x; negative when the nose points uphill"),
    Quantity("gravity_y", "m/s²", "gravity along body y; negative when the left side is higher"),
    Quantity(
        "gravity_normal", "m/s²", "gravity pressing on the surface, > 0", default=STANDARD_GRAVITY
    ),
    Quantity("payload", "kg", "mass carried beside the robot's own"),
    Quantity("com_x", "m", "centre of mass of robot and payload, forward of the centre", NOT_KNOWN),
    Quantity("com_y", "m", "centre of mass of robot and payload, left of the centre", NOT_KNOWN),
    Quantity("motor_temp", "°C", "temperature of the motors", NOT_KNOWN),
    Quantity("ambient_temp", "°C", "temperature of the air", NOT_KNOWN),
    Quantity("battery_voltage", "V", "voltage at the battery", NOT_KNOWN),
    Quantity(
        "surface", "1", "number of the ground's label in the model's list; -1 none of them", -1
    ),
    Quantity("rolling_factor", "1", "factor of the ground on all rolling resistance", default=1.0),
    Quantity("traction_factor", "1", "factor of the ground on the traction limit", default=1.0),
    Quantity("wind_x", "m/s", "velocity of the air along body x"),
    Quantity("wind_y", "m/s", "velocity of the air along body y"),
    Quantity("sensor_rate", "Hz", "samples taken per second by the sensors", NOT_KNOWN),
    Quantity("slope_rate", "rad/s", "magnitude of the rate of change of the slope under the robot"),
    Quantity("odometer", "m", "distance driven since the log or the route began"),
    Quantity("time_since_start", "s", "time since the run or the route began"),
)

INDEX: dict[str, int] = {quantity.name: column for column, quantity in enumerate(QUANTITIES)}
ROW_LENGTH = len(QUANTITIES)
DEFAULT_ROW: tuple[float, ...] = tuple(quantity.default for quantity in QUANTITIES)
