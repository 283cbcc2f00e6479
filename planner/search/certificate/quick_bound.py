"""A lower bound of the energy of any route, from losses that no motion can avoid.

Every horizontal metre dissipates at least

    d = min over u, ω of Σ_i [ (n·τ_c/r + f·c_w·N_i)·|rim_i| + f·c_r·N_i·|roller_i| ]
        + (P_el - P_rest) / v

with rim and roller travel of wheel i for a metre along u with a yaw of ω on the way: a norm of u
for every wheel table (planner.power.kinematics). It is taken on 720 directions, less what a norm
can lose between two of them; in each, the best yaw stops one rim or roller. N_i is the load that
the wheel keeps on the steepest slope, at full acceleration and with the mass off the centre.

P_rest is what the smooth signs near rest spare against complete friction, of all wheels: 0.3·w·F at
most for friction F that changes sign over the width w, and at the motor what static friction and
the teeth help to hold less the copper loss of holding it, the largest over all speeds and torques.
v is full speed, or, where P_rest outweighs the electronics, half the slowest speed: the mean speed
on a step that starts or ends at rest. Between places so close that the speed programme has slower
ones for them (planner.search.trajectory.speed_profile) d then counts nothing. Turns on the spot
only add.

With M·g·Δz, less what the air can push, E, the gears that drive lose (1/η - 1)·max(0, E).
The bound is d·distance + E plus that. Air: the drag k·|v - w|·(v - w) is the slope of a convex
function, so its power is at least -k·|w|·w·v, which sums to -k·w²·distance however the route
bends. Body axes on a slope see w·v a little longer than the map, which adds a share of the way.

Where an effect of the model changes what is rubbed off at wheels or rollers, these count nothing.

Braking power that motors or source refuse cannot lower the energy: then E is at least that of the
electronics at full speed, or 0.

Left out: with wind so strong that this share outweighs d, no route is taken to be longer than a
hundred straight lines. A formula of the user's own, or an effect that is not declared a ``loss``,
may give energy back: such models, and the printed ones, get no more than min(0, M·g·Δz), which then
is no proven bound.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from planner.arrays import Array
from planner.cache import CACHE
from planner.power.effect import Effect
from planner.power.kernel_math import REST_SPEED
from planner.power.kinematics import LOAD, RIM, ROLLER
from planner.power.model import PowerModel
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.resolution import EVENLY, SLOWEST

BOUND_DIRECTIONS = 720
"""Directions in which the norm of a metre is taken; the loss between two of them is subtracted."""
LONGEST_ROUTE = 100.0
"""Straight lines that no route is longer than, where longer routes would gain from wind."""
SMOOTH_SIGN_LOSS = 0.3003
"""Largest x - x²/√(x² + 1), by which a smooth sign of width 1 lowers |x|."""


def lower_bound(
    conditions: OperatingConditions,
    distance: float,
    climb: float,
    steepest: float,
    *,
    shortest: float | None = None,
) -> float:
    """J that every route needs at least.

    Args:
        conditions: model and conditions.
        distance: m, straight and horizontal, from start to goal, or the sum over legs.
        climb: m, height of the goal above the start.
        steepest: largest tan(slope) that the robot can drive.
        shortest: m, the shortest leg; the distance where None.
    """
    weight = conditions.mass * STANDARD_GRAVITY
    model = conditions.model
    if model.kind != "sound" or not all(map(_is_bounded, model.effects)):
        return min(0.0, weight * climb)
    push = _wind_push(conditions)
    metre = (
        0.0
        if _may_creep(conditions, shortest or distance)
        else floor_per_metre(conditions, steepest)
    )
    metre -= push * _lengthening(steepest)
    dissipated = metre * distance * (1.0 if metre >= 0.0 else LONGEST_ROUTE)
    through_gears = weight * climb - push * distance
    efficiency = parameter_value(model, "gear_loss", "efficiency")
    dissipated += (1.0 / efficiency - 1.0) * max(0.0, through_gears)
    return max(dissipated + through_gears, _drawn(conditions, distance))


def _drawn(conditions: OperatingConditions, distance: float) -> float:
    """J drawn on any descent, where motors or source take nothing back."""
    model = conditions.model
    if not any(effect.slug == "regeneration_limit" for effect in model.effects):
        return -math.inf
    if parameter_value(model, "regeneration_limit", "motor_share") == 0.0:
        seconds = distance / float(conditions.limits[0])
        return parameter_value(model, "electronics", "power") * seconds
    source = parameter_value(model, "regeneration_limit", "source_share")
    return 0.0 if source == 0.0 else -math.inf


def _is_bounded(effect: type[Effect]) -> bool:
    """Whether the bound holds beside an effect: a loss, or one of those that it looks at."""
    known = effect.base or effect.loss or effect.slug in ("air_drag", "com_offset", "motor_heating")
    return known or {*effect.hooks} <= {"contact_factor", "roller_factor", "gear_return"}


def _may_creep(conditions: OperatingConditions, distance: float) -> bool:
    """Whether a robot between places so close may be slower than elsewhere, and gains by it."""
    near = EVENLY * float(conditions.limits[0])
    if conditions.model.vehicle.limits.acceleration * distance >= near * near:
        return False
    return _idle(conditions, *_friction(conditions, 0.0)) < 0.0


def floor_per_metre(conditions: OperatingConditions, steepest: float) -> float:
    """J that every horizontal metre dissipates at least, in still air."""
    key = ("floor per metre", conditions.key, steepest)
    return CACHE.get(key, lambda: _floor_per_metre(conditions, steepest))


def _floor_per_metre(conditions: OperatingConditions, steepest: float) -> float:
    model = conditions.model
    v = float(conditions.limits[0])
    rim, roller = _friction(conditions, steepest)
    idle = _idle(conditions, rim, roller)
    # The motor's dry friction is in the travel of its wheel; its smoothness is in ``spared``.
    per_rim = parameter_value(model, "coulomb_drag", "coulomb_torque") * model.vehicle.gear_ratio
    rim = rim + per_rim / model.vehicle.layout.radius
    sliding = _least_norm(model.wheels, rim, roller)
    return max(0.0, sliding + idle / (v if idle >= 0.0 else 0.5 * SLOWEST * v))


def _idle(conditions: OperatingConditions, rim: Array, roller: Array) -> float:
    """W of the electronics, less what is spared near rest, for friction (n,) in N."""
    spared = SMOOTH_SIGN_LOSS * conditions.model.sliding_speed * float(rim.sum() + roller.sum())
    spared += len(conditions.model.wheels) * _spared_by_motor(conditions)
    return parameter_value(conditions.model, "electronics", "power") - spared


def _least_norm(wheels: Array, rim: Array, roller: Array) -> float:
    """J of the cheapest metre for friction forces (n,) at rims and rollers in N."""
    table = np.vstack(
        [rim[:, None] * wheels[:, RIM : RIM + 3], roller[:, None] * wheels[:, ROLLER : ROLLER + 3]]
    )
    angles = 2.0 * math.pi * np.arange(BOUND_DIRECTIONS) / BOUND_DIRECTIONS
    along = np.column_stack([np.cos(angles), np.sin(angles)]) @ table[:, :2].T
    least = np.abs(along).sum(axis=1)
    # Turning while driving may spare travel: convex in the yaw rate, least where a term is zero.
    for term in np.flatnonzero(table[:, 2]):
        rate = -along[:, term] / table[term, 2]
        least = np.minimum(least, np.abs(along + rate[:, None] * table[:, 2]).sum(axis=1))
    half_step = math.pi / BOUND_DIRECTIONS
    # A norm differs between two directions by no more than the norm of their difference.
    return max(0.0, float(least.min() - least.max() * half_step / (1.0 - half_step)))


def _friction(conditions: OperatingConditions, steepest: float) -> tuple[Array, Array]:
    """N of dry friction at every rim and every roller, (n,) each; 0 where it is not known."""
    model = conditions.model
    if any("contact_factor" in effect.hooks for effect in model.effects):
        nothing = np.zeros(len(model.wheels))
        return nothing, nothing
    factor = float(conditions.class_rows[:, INDEX["rolling_factor"]].min())
    loads = factor * _least_loads(conditions, steepest)
    rollers = parameter_value(model, "roller_drag", "roller")
    if any("roller_factor" in effect.hooks for effect in model.effects):
        rollers = 0.0
    return parameter_value(model, "wheel_rolling", "rolling") * loads, rollers * loads


def _least_loads(conditions: OperatingConditions, steepest: float) -> Array:
    """N on every wheel (n,) at worst."""
    model = conditions.model
    cosine = math.cos(math.atan(steepest))
    # Along and across the way at the same time, with the tenth that bends may exceed it by.
    acceleration = math.hypot(1.0, 1.1) * model.vehicle.limits.acceleration
    pull = steepest + acceleration / (STANDARD_GRAVITY * cosine)
    by_one, by_x, by_y = (np.abs(model.wheels[:, LOAD + k]) for k in range(3))
    shift = model.vehicle.com_height * pull * np.hypot(by_x, by_y)
    if any(effect.slug == "com_offset" for effect in model.effects):
        gain = abs(parameter_value(model, "com_offset", "gain"))
        for axis, by in (("x", by_x), ("y", by_y)):
            known = np.nan_to_num(conditions.class_rows[:, INDEX[f"com_{axis}"]])
            unknown = math.sqrt(parameter_value(model, "com_offset", f"offset_{axis}_squared"))
            shift = shift + (gain * float(np.abs(known).max()) + unknown) * by
    loads: Array = conditions.mass * STANDARD_GRAVITY * cosine * np.maximum(0.0, by_one - shift)
    return loads


def _spared_by_motor(conditions: OperatingConditions) -> float:
    """W by which one motor near rest may draw less than with complete friction and teeth.

    A motor that holds the torque G behind its gear pays copper loss for what static friction does
    not hold; with c·G spared by the teeth, the best G solves c = 2·R/k_t²·(G - held).
    """
    model = conditions.model
    efficiency = parameter_value(model, "gear_loss", "efficiency")
    friction = parameter_value(model, "coulomb_drag", "coulomb_torque")
    stiffness = _copper_stiffness(conditions)
    backward = max(0.0, 2.0 - 1.0 / efficiency)
    if any("gear_return" in effect.hooks for effect in model.effects):
        backward = 0.0
    x = np.geomspace(1e-3, 1e4, 2000)
    speed = REST_SPEED * x
    moving, rest = x / np.hypot(x, 1.0), 1.0 / (x * x + 1.0)
    passing = backward + (1.0 / efficiency - backward) * moving
    by_teeth = speed * (1.0 / efficiency - passing) / passing
    held = friction * (rest - moving) + _rotor_torque(model)
    torque = np.maximum(friction, held + by_teeth / (2.0 * stiffness))
    copper = stiffness * np.maximum(0.0, torque - held) ** 2
    teeth = np.maximum(by_teeth * torque - copper, by_teeth * friction)
    # The last factor is for what lies between two speeds of the table.
    return 1.02 * float((teeth + friction * speed * (1.0 - moving + rest)).max())


def _copper_stiffness(conditions: OperatingConditions) -> float:
    """R/k_t² in W/(N·m)², as small as the temperature makes it."""
    model = conditions.model
    resistance = parameter_value(model, "copper_loss", "resistance")
    constant = parameter_value(model, "copper_loss", "torque_constant")
    if any(effect.slug == "motor_heating" for effect in model.effects):
        # Cold windings resist less and cold magnets are stronger.
        temperature = float(conditions.class_rows[0, INDEX["motor_temp"]])
        rise = min(0.0, temperature - 25.0) if math.isfinite(temperature) else 0.0
        resistance *= max(
            0.01, 1.0 + parameter_value(model, "motor_heating", "copper_coefficient") * rise
        )
        share = parameter_value(model, "motor_heating", "magnet_share")
        constant *= (
            1.0 + parameter_value(model, "motor_heating", "magnet_coefficient") * share * rise
        )
    return resistance / constant**2


def _rotor_torque(model: PowerModel) -> float:
    """N·m at the motor that its rotor may give while it slows down."""
    limits = model.vehicle.limits
    rim = model.wheels[:, RIM : RIM + 3]
    # A yaw rate changes over a tenth of a second or more.
    changes = 2.0 * limits.acceleration * np.hypot(rim[:, 0], rim[:, 1])
    changes = changes + 10.0 * limits.yaw_rate * np.abs(rim[:, 2])
    geared = model.vehicle.gear_ratio / model.vehicle.layout.radius
    return float(parameter_value(model, "inertia", "rotor_inertia") * geared * changes.max())


def _wind_push(conditions: OperatingConditions) -> float:
    """N with which the wind pushes a robot that stands."""
    if not any(effect.slug == "air_drag" for effect in conditions.model.effects):
        return 0.0
    area = parameter_value(conditions.model, "air_drag", "drag_area")
    density = parameter_value(conditions.model, "air_drag", "air_density")
    return 0.5 * density * area * float(conditions.wind @ conditions.wind)


@lru_cache(maxsize=64)  # numbers by number: nothing of size
def _lengthening(steepest: float) -> float:
    """Largest difference of a horizontal metre from the same metre in body axes on a slope."""
    azimuth = 2.0 * math.pi * np.arange(BOUND_DIRECTIONS) / BOUND_DIRECTIONS
    forward, left = steepest * np.cos(azimuth), steepest * np.sin(azimuth)
    length = np.hypot(1.0, forward)
    normal = math.hypot(1.0, steepest)
    difference = np.empty((BOUND_DIRECTIONS, 2, 2))
    # Columns: a metre along x and along y of the map, written as in planner.power.motion_row.
    difference[:, 0, 0] = length - 1.0
    difference[:, 0, 1] = left * forward / length
    difference[:, 1, 0] = 0.0
    difference[:, 1, 1] = normal / length - 1.0
    return 1.01 * float(np.linalg.norm(difference, 2, axis=(1, 2)).max())


def parameter_value(model: PowerModel, slug: str, name: str) -> float:
    """A parameter of an effect of the model; StopIteration where it has none."""
    return next(
        float(value)
        for (effect, parameter, _, _), value in zip(model.slots, model.parameters, strict=True)
        if effect.slug == slug and parameter == name
    )
