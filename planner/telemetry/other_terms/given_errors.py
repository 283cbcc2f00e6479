"""Usual errors of what a diagnosis is given: data sheet and sensors, as columns of watts.

    columns = given_columns(log, model, watts)     # (n, k) W, each by its standard deviation

A data sheet's mass or a scale of the odometry is never exact. What such an error does to the power
looks like some missing effect. So every test has these columns beside the model's own, each with a
coefficient of standard deviation 1 before the log is read: an effect must explain what they cannot.

The errors of a data sheet are those that its file states ({ value, unit, source, uncertainty }),
else SHEET_SHARE of the value. Those of parameters that are fitted are in the fit. Small errors of
sensors stand here; larger ones are named (sensor_errors).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms.sensor_errors import SENSORS
from planner.telemetry.prediction import Nodes, Readings, predict
from planner.telemetry.sampling import with_earlier_tilt

SHEET_SHARE = 0.05
"""Standard deviation of a data sheet's mass and lengths where the file states none, as a share."""
HEIGHT_SHARE = 0.2
"""The same of the height of the centre of mass, which hardly anybody measures."""
TILT = 0.003
"""rad; usual error of a tilt sensor that was levelled."""
LAG = 0.1
"""s; usual time by which an inertial sensor's filter makes pitch and roll late."""
SCALE = 0.01
"""Usual error of a scale of the odometry, and of vy against vx, whose rollers slip."""
TURN_SCALE = 0.01
"""Usual error of the scale of the yaw rate."""
LIKELY_ERROR = 2.0
"""Standard deviations up to which an error is likely, 95 % of all."""
ONLY_BY_SIZE = 2.5
"""The same of the power's scale. Only its size distinguishes it from the data sheet's mass: 99 % of
all masses, with the scatter of the scale."""
USUAL_TURN = 0.01
"""rad; usual error of how the axes of the odometry are mounted."""
BIAS = 0.03
"""m/s²; usual bias of a MEMS accelerometer."""


@dataclass(frozen=True)
class _SheetError:
    """A number of the data sheet: its keys, usual error as a share, and how it changes a robot."""

    keys: tuple[str, ...]
    share: float
    change: Callable[[Vehicle, float], Vehicle]

    def sigma(self, vehicle: Vehicle) -> float:
        """Standard deviation as a share of the value."""
        stated = [
            vehicle.provenance.uncertainties[key]
            for key in self.keys
            if key in vehicle.provenance.uncertainties
        ]
        return max(stated) if stated else self.share


def _heavier(vehicle: Vehicle, share: float) -> Vehicle:
    return replace(vehicle, mass=vehicle.mass * (1.0 + share))


def _taller(vehicle: Vehicle, share: float) -> Vehicle:
    return replace(vehicle, com_height=vehicle.com_height * (1.0 + share))


def _larger_wheels(vehicle: Vehicle, share: float) -> Vehicle:
    radius = vehicle.layout.radius * (1.0 + share)
    return replace(vehicle, layout=replace(vehicle.layout, radius=radius))


def _longer(vehicle: Vehicle, share: float) -> Vehicle:
    return replace(vehicle, layout=vehicle.layout.stretched(1.0 + share, 1.0))


def _wider(vehicle: Vehicle, share: float) -> Vehicle:
    return replace(vehicle, layout=vehicle.layout.stretched(1.0, 1.0 + share))


_SHEET = (
    _SheetError(("body.mass",), SHEET_SHARE, _heavier),
    _SheetError(("body.com_height",), HEIGHT_SHARE, _taller),
    _SheetError(("wheels.radius",), SHEET_SHARE, _larger_wheels),
    _SheetError(("wheels.half_wheelbase", "wheels.base_radius"), SHEET_SHARE, _longer),
    _SheetError(("wheels.half_track", "wheels.base_radius"), SHEET_SHARE, _wider),
)


def _scaled(*names: str) -> Callable[[Telemetry, float], Telemetry]:
    def change(log: Telemetry, share: float) -> Telemetry:
        rows = log.rows.copy()
        for name in names:
            if name not in ("ax", "ay", "yaw_acceleration") or name not in log.present:
                rows[:, INDEX[name]] *= 1.0 + share
        return replace(log, rows=rows)

    return change


def _biased(name: str) -> Callable[[Telemetry, float], Telemetry]:
    def change(log: Telemetry, bias: float) -> Telemetry:
        rows = log.rows.copy()
        if name in log.present:
            rows[:, INDEX[name]] += bias
        return replace(log, rows=rows)

    return change


def _tilted(kind: str) -> Callable[[Telemetry, float], Telemetry]:
    def change(log: Telemetry, tilt: float) -> Telemetry:
        sensor = SENSORS[kind]
        return sensor.correct(log, tilt) if sensor.is_read_in(log.present) else log

    return change


_SENSORS: tuple[tuple[float, Callable[[Telemetry, float], Telemetry]], ...] = (
    (SCALE, _scaled("vx", "vy", "ax", "ay")),
    (SCALE, _scaled("vy", "ay")),
    (TURN_SCALE, _scaled("wz", "yaw_acceleration")),
    (TILT, _tilted("slope_offset")),
    (TILT, _tilted("roll_offset")),
    (USUAL_TURN, SENSORS["heading_misalignment"].correct),
    (BIAS, _biased("ax")),
    (BIAS, _biased("ay")),
    (LAG, with_earlier_tilt),
)
LATE_ROWS, LATEST = 0.5, 0.06
"""Rows, and s at most, by which the power may be late or early against the motion: what a row's
mean and its end differ by. More of it is a meter (planner.telemetry.estimation.meter_fit)."""
BLUR = 0.5
"""Share of the difference to the neighbouring rows' mean that one reading may be averaged by."""


class _Given(NamedTuple):
    """Numbers of columns: all of them, and those of the moment within a row, which come last.

    ``own`` is the column that is the same error as one of SENSORS, by kind. Of the power's scale it
    is the data sheet's mass.
    """

    total: int
    moments: int
    own: Mapping[str, int]

    def beside(self, columns: Array, kinds: Collection[str]) -> Array:
        """Usual errors beside which errors of sensors are tested: all but the same ones.

        Args:
            columns: (n, total) W, of given_columns.
            kinds: of SENSORS.
        """
        return np.delete(columns, [self.own[kind] for kind in kinds], axis=1)


_FIRST = len(_SHEET)
GIVEN = _Given(
    len(_SHEET) + len(_SENSORS) + 2,
    2,
    {
        "power_scale": 0,
        "speed_scale": _FIRST,
        "slope_offset": _FIRST + 3,
        "roll_offset": _FIRST + 4,
        "heading_misalignment": _FIRST + 5,
    },
)
"""How many columns there are, and which is whose."""


def given_columns(log: Telemetry, model: PowerModel, watts: Array) -> Array:
    """What usual errors of data sheet and sensors add to the power.

    Args:
        log: the rows.
        model: the model.
        watts: (n,) W that it says for them.

    Returns:
        (n, GIVEN.total) W per standard deviation; 0 where an error does nothing.
    """
    vehicle = model.vehicle
    columns = np.empty((len(log), GIVEN.total))
    for number, error in enumerate(_SHEET):
        changed = replace(model, vehicle=error.change(vehicle, error.sigma(vehicle)))
        columns[:, number] = predict(changed, log) - watts
    # Another motion changes nothing of when and how its power is read.
    readings = Readings.of(log)
    for number, (size, change) in enumerate(_SENSORS, start=len(_SHEET)):
        moved = Nodes.of(replace(change(log, size), meter=None), model)
        columns[:, number] = predict(model, moved._replace(readings=readings)) - watts
    columns[:, -GIVEN.moments :] = _moments(log, watts)
    return columns


def _moments(log: Telemetry, watts: Array) -> Array:
    """(n, GIVEN.moments) W, what another moment within the row and a little averaging change."""
    ahead, behind = watts.copy(), watts.copy()
    for start, stop in log.segments():
        ahead[start : stop - 1] = watts[start + 1 : stop]
        behind[start + 1 : stop] = watts[start : stop - 1]
    rows = np.minimum(LATE_ROWS, LATEST / np.maximum(log.interval, 1e-9))
    return np.column_stack([rows * 0.5 * (ahead - behind), BLUR * (ahead + behind - 2.0 * watts)])


def tolerance_of(kind: str, vehicle: Vehicle, stderr: float) -> float:
    """Size up to which an error of a sensor may well be one of data sheet or mounting.

    Args:
        kind: of SENSORS. Scales of speed and power look like a mass that is off by their share.
        vehicle: as its data sheet has it.
        stderr: standard error of the size.
    """
    mass = _SHEET[0].sigma(vehicle)
    if kind == "power_scale":
        return ONLY_BY_SIZE * float(np.hypot(mass, stderr))
    if kind == "speed_scale":
        return LIKELY_ERROR * mass
    return LIKELY_ERROR * (TILT if kind in ("slope_offset", "roll_offset") else USUAL_TURN)
