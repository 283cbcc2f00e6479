"""What a request's circumstances mean for the power model: mass, rows by ground class, limits."""

from __future__ import annotations

import hashlib
import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Array
from planner.power.kinematics import RIM
from planner.power.limits import broken_limit, limit_values
from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.power.rows import rows_from
from planner.power.sanity import oddities
from planner.power.vehicles import Limits, Vehicle
from planner.quantities import INDEX
from planner.search.kernel_arguments import ModelArrays
from planner.search.requests import SituationRequest
from planner.search.resolution import DIRECTIONS, MOST_WEIGHT
from planner.terrain.heightmap import Terrain

PLANNED_SLIDING_SPEED = 0.0008
"""m/s within which friction of rims and rollers changes sign on planned motions, whose speeds are
exact. Measured speeds are not, and blur it more (planner.power.kernel_math). With more blur, routes
lean into it and would drag more than is said (python -m tests.benchmarks.sharp_friction)."""
BEYOND_REACH = 1.5
"""Largest limits of speed and yaw rate that a search works with, over what the drive reaches on
level ground. Speeds and turns are tried in shares of the limits; of those far above the reach all
break some limit, and no route is found. Some more is left for a descent."""
_READ_AS = {"wind": "wind_x"}
"""Names of conditions whose quantity has another name."""


@dataclass(frozen=True)
class OperatingConditions:
    """A model, and everything about a request that is the same all along the route.

    Attributes:
        model: with the height of the centre of mass that the payload makes.
        class_rows: (classes, ROW_LENGTH) one row of conditions for each ground class of the map.
        limits: [speed, current, voltage, peak torque, mass, largest tan(slope), yaw rate,
            acceleration].
        wind: (2,) m/s in the map's frame.
        lasting: whether steady driving takes no more torque than motors give for good. Turns and
            changes of speed may, up to the peak.
        stated: limits as the vehicle states them; the model's are near what its drive reaches.
    """

    model: PowerModel
    class_rows: Array
    limits: Array
    wind: Array
    lasting: bool = False
    stated: Limits | None = None

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Key of the model under its conditions, for planner.cache."""
        arrays = (self.class_rows, self.limits, self.wind)
        return (model_key(self.model), *(array.tobytes() for array in arrays), self.lasting)

    @cached_property
    def content(self) -> tuple[object, ...]:
        """Key for kept tables: effects are meant by their sources, not by their names."""
        return (self.model.kernel.name, *self.key)

    @cached_property
    def arrays(self) -> ModelArrays:
        """The numbers that compiled loops take with the model's kernel.

        Behind the limits stands the torque that motors may give for good, infinite unless
        ``lasting``.
        """
        model = self.model
        numbers = model.parameters, model.body, model.wheels
        for_good = model.vehicle.limits.continuous_torque if self.lasting else math.inf
        limits = np.append(self.limits, for_good)
        return ModelArrays(*numbers, self.class_rows, limits, self.wind)

    @cached_property
    def hurried(self) -> OperatingConditions:
        """Those with seconds that weigh so much that energy counts only among motions as quick."""
        row = self.class_rows[:1].copy()
        set_motion(row[0], 0.0, 0.0, 0.0, 0.0, float(self.limits[0]))
        watts = MOST_WEIGHT * abs(float(self.model.power_and_limits(row)[0, 0]))
        return replace(self, model=replace(self.model, time_weight=watts))

    @property
    def mass(self) -> float:
        """kg, robot and payload."""
        return float(self.limits[4])

    @cached_property
    def steady(self) -> OperatingConditions:
        """Those of steady driving: with ``lasting``, the continuous torque is the peak."""
        if not self.lasting:
            return self
        vehicle = self.model.vehicle
        peak = replace(vehicle.limits, peak_torque=vehicle.limits.continuous_torque)
        limits = self.limits.copy()
        limits[3] = peak.peak_torque
        model = replace(self.model, vehicle=replace(vehicle, limits=peak))
        return replace(self, model=model, limits=limits, lasting=False)

    def wind_by_direction(self) -> Array:
        """(DIRECTIONS,) J that wind adds to a level metre, by azimuth of travel."""
        if not self.wind.any():
            return np.zeros(DIRECTIONS)
        row = self.class_rows[0].copy()
        speed = float(self.limits[0])
        set_motion(row, 0.0, 0.0, 0.0, 0.0, speed)
        still = float(self.model.watts(row[None])[0])
        extra = np.empty(DIRECTIONS)
        for k in range(DIRECTIONS):
            azimuth = 2.0 * math.pi * k / DIRECTIONS
            c, s = math.cos(azimuth), math.sin(azimuth)
            row[INDEX["wind_x"]] = c * self.wind[0] + s * self.wind[1]
            row[INDEX["wind_y"]] = c * self.wind[1] - s * self.wind[0]
            extra[k] = (float(self.model.watts(row[None])[0]) - still) / speed
        return extra


def model_key(model: PowerModel) -> str:
    """Cache key of a power model: whatever its watts and limits depend on."""
    digest = hashlib.sha256(model.kind.encode())
    for effect in model.effects:
        digest.update(repr((effect.slug, effect.definition)).encode())
    digest.update(repr((model.vehicle.limits, model.surfaces)).encode())
    for array in (model.parameters, model.body, model.wheels):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _fastest_on_the_level(model: PowerModel, class_rows: Array, limits: Array) -> float:
    """m/s on level ground with the best yaw; the limit itself where not even a crawl is possible.

    Speeds beyond it would only make the planner's grid of speeds coarser.
    """
    yaws = 2.0 * math.pi * np.arange(32) / 32
    # Most robots reach their limit: the lower speeds are looked at only if one does not.
    for speeds in (limits[:1], limits[0] * np.geomspace(1e-3, 1.0, 120)):
        rows = np.repeat(class_rows[:1], len(yaws) * len(speeds), axis=0)
        for row, (yaw, speed) in zip(rows, itertools.product(yaws, speeds), strict=True):
            set_motion(row, 0.0, 0.0, yaw, 0.0, speed)
        accounts, _ = model.evaluate(rows)
        good = [broken_limit(account, limits) < 0 for account in accounts]
        reached = np.tile(speeds, len(yaws))[good]
        if len(reached):
            return float(reached.max())
    return float(limits[0])


def operating_conditions(
    request: SituationRequest, model: PowerModel, terrain: Terrain
) -> OperatingConditions:
    """Work out what a request's payload, conditions and ground mean for the model."""
    vehicle = model.vehicle
    model = replace(model, sliding_speed=PLANNED_SLIDING_SPEED)
    payload = request.payload
    mass = vehicle.mass + payload.mass
    columns: dict[str, float] = {"payload": payload.mass}
    if payload.mass > 0.0:
        columns["com_x"] = payload.mass * payload.x / mass
        columns["com_y"] = payload.mass * payload.y / mass
        if payload.height is not None:
            height = (vehicle.mass * vehicle.com_height + payload.mass * payload.height) / mass
            model = replace(model, vehicle=replace(vehicle, com_height=height))
    for name in ("motor_temp", "ambient_temp", "sensor_rate", "battery_voltage"):
        value = getattr(request.conditions, name)
        if value is not None:
            columns[name] = value
    rows = np.vstack(
        [
            rows_from(
                **columns,
                surface=model.surfaces.index(ground.name) if ground.name in model.surfaces else -1,
                rolling_factor=ground.rolling,
                traction_factor=ground.traction,
            )
            for ground in terrain.ground_classes
        ]
    )
    most = vehicle.limits
    limits = np.append(limit_values(model, payload.mass), [most.yaw_rate, most.acceleration])
    limits[0] = min(limits[0], _fastest_on_the_level(model, rows, limits))
    near = _near_reach(vehicle, float(limits[0]))
    if near != most:
        limits[6] = near.yaw_rate
        model = replace(model, vehicle=replace(model.vehicle, limits=near))
    wind = request.conditions.wind
    return OperatingConditions(model, rows, limits, np.array([wind.x, wind.y]), stated=most)


def _near_reach(vehicle: Vehicle, fastest: float) -> Limits:
    """The vehicle's limits, those of speed and yaw rate not far above what the drive reaches."""
    rims = np.abs(vehicle.layout.table[:, RIM : RIM + 3])
    turning = fastest * float(rims[:, :2].max()) / float(rims[:, 2].max())
    stated = vehicle.limits
    return replace(
        stated,
        speed=min(stated.speed, BEYOND_REACH * fastest),
        yaw_rate=min(stated.yaw_rate, BEYOND_REACH * turning),
    )


def assumptions(
    request: SituationRequest, conditions: OperatingConditions, terrain: Terrain
) -> tuple[str, ...]:
    """Sentences without a full stop; none where nothing was assumed.

    Args:
        request: what was asked.
        conditions: that follow from it.
        terrain: the map as it was read.
    """
    model = conditions.model
    near = model.vehicle.limits
    stated = near if conditions.stated is None else conditions.stated
    model = replace(model, vehicle=replace(model.vehicle, limits=stated))
    defaults = model.defaults_in_words()
    notes = [f"defaults taken: {', '.join(defaults)}"] if defaults else []
    if origin := model.vehicle.provenance.derived.get("battery.voltage"):
        # It decides what the motors can do, and is easily lost among two dozen defaults.
        volts = model.vehicle.battery.voltage
        notes.append(
            f"the vehicle's file has no battery.voltage: {volts:g} V assumed, the {origin}"
        )
    for name, unit in (("speed", "m/s"), ("yaw_rate", "rad/s")):
        asked, taken = getattr(stated, name), getattr(near, name)
        if asked > taken:
            notes.append(
                f"limits.{name}: {asked:g} {unit} is far beyond the drive, which reaches about "
                f"{taken / BEYOND_REACH:.2g} {unit} on level ground"
            )
    # A unit that is missing in the file makes an answer that is wrong by orders of magnitude.
    notes += [
        f"odd in the vehicle's file: {said}"
        for said in oddities(model)
        if not any(note.startswith(said.partition(":")[0]) for note in notes)
    ]
    notes += [f"odd in the map's file: {said}" for said in terrain.odd]
    reads = {name for effect in model.effects for name in effect.reads}
    payload = request.payload
    if payload.mass > 0.0 and (payload.x or payload.y) and not {"com_x", "com_y"} & reads:
        notes.append(
            "payload.x and payload.y change nothing but whether the robot stands: no active effect "
            "reads them; com_offset does"
        )
    for name in type(request.conditions).model_fields:
        unread = name != "battery_charge" and _READ_AS.get(name, name) not in reads
        if unread and name in request.conditions.model_fields_set:
            notes.append(f"conditions.{name} changes nothing: no active effect reads it")
    return tuple(notes)
