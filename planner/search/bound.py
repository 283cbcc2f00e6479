"""A lower bound of the energy of any route, from what no motion can avoid.

Per horizontal metre at least the electronics at full speed, the motors' dry friction on the
cheapest heading and, for four Mecanum wheels, the rolling drag on it:

    d = (P_el - P_rest)/v_max + Σ τ_c·n·|r·ω|/r + s·min(c_w, c_w/√2 + c_r)·M·g·cos γ_max

with the sums for a metre in the cheapest direction, found by sampling the norm Σ|r·ω| on 720
directions and taking off what a norm can lose between two samples. On top (1/η - 1)·M·g·max(0, Δz):
the net climb passes through gears that drive. The energy bound is d·distance + M·g·Δz plus that.
s is the share of its even load that the least loaded wheel keeps on the steepest slope, at full
acceleration and with the centre of mass off the centre: a robot might spin so that the loaded
wheels roll least. P_rest is what static friction and the teeth of wheels almost at rest can spare,
each at its largest. Effects that can lower drag (a contact factor) take the rolling term out.
"""

from __future__ import annotations

import math

import numpy as np

from planner.power.kernel_math import SLIDING_SPEED
from planner.power.kinematics import RIM, X, Y
from planner.power.model import PowerModel
from planner.power.pipeline import REST_SPEED
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.conditions import Circumstances

SAMPLES = 720


def lower_bound(around: Circumstances, distance: float, climb: float, steepest: float) -> float:
    """J that every route needs at least.

    Args:
        around: model and conditions.
        distance: m, straight and horizontal, from start to goal.
        climb: m, height of the goal above the start.
        steepest: largest tan(slope) that the robot can drive.
    """
    weight = around.mass * STANDARD_GRAVITY
    model = around.model
    if model.kind != "sound":
        return min(0.0, weight * climb)
    dissipated = floor_per_metre(around, steepest) * distance
    efficiency = _value(model, "gear_loss", "efficiency")
    if not any("gear_return" in effect.hooks for effect in model.effects):
        dissipated += (1.0 / efficiency - 1.0) * weight * max(0.0, climb)
    return dissipated + weight * climb


def floor_per_metre(around: Circumstances, steepest: float) -> float:
    """J that every horizontal metre dissipates at least."""
    model = around.model
    if around.wind.any():
        return 0.0
    v = float(around.limits[0])
    # Smooth dry friction falls short of its full value near rest; faster than a tenth of full
    # speed it is complete to this share, and slower the electronics outweigh it all.
    slow = 0.1 * v
    full = slow / math.hypot(slow, max(SLIDING_SPEED, _rest_rim_speed(model)))
    idle = max(0.0, _value(model, "electronics", "power") - _spared_at_rest(model))
    sliding = full * _coulomb(model) + full * _rolling(around, steepest)
    return min(idle / v + sliding, idle / slow)


def _rest_rim_speed(model: PowerModel) -> float:
    return REST_SPEED / model.vehicle.gear_ratio * model.vehicle.layout.radius


def _coulomb(model: PowerModel) -> float:
    """J/m of the motors' friction in the cheapest direction."""
    rim = model.wheels[:, RIM : RIM + 3]
    angles = 2.0 * math.pi * np.arange(SAMPLES) / SAMPLES
    along = np.column_stack([np.cos(angles), np.sin(angles)]) @ rim[:, :2].T
    # Turning while driving may spare wheel travel: the best yaw rate stops one of the wheels.
    least = np.abs(along).sum(axis=1)
    for wheel in range(len(rim)):
        if rim[wheel, 2] != 0.0:
            rate = -along[:, wheel] / rim[wheel, 2]
            travel = np.abs(along + rate[:, None] * rim[:, 2]).sum(axis=1)
            least = np.minimum(least, travel)
    # Between two samples a norm falls by no more than its largest value times half the chord.
    travel = max(0.0, float(least.min()) - float(least.max()) * math.pi / SAMPLES)
    torque = _value(model, "coulomb_drag", "coulomb_torque")
    return torque * model.vehicle.gear_ratio / model.vehicle.layout.radius * travel


def _rolling(around: Circumstances, steepest: float) -> float:
    """J/m of wheels and rollers in the cheapest direction; 0 where that is not known."""
    model = around.model
    if len(model.wheels) != 4 or any("contact_factor" in e.hooks for e in model.effects):
        return 0.0
    wheel = _value(model, "wheel_rolling", "rolling")
    roller = _value(model, "roller_drag", "roller")
    factor = float(around.class_rows[:, INDEX["rolling_factor"]].min())
    least = min(wheel, wheel / math.sqrt(2.0) + roller)
    weight = around.mass * STANDARD_GRAVITY * math.cos(math.atan(steepest))
    return factor * _least_load_share(around, steepest) * least * weight


def _least_load_share(around: Circumstances, steepest: float) -> float:
    """Load of the least loaded wheel over its even share, at worst."""
    model = around.model
    cosine = math.cos(math.atan(steepest))
    pull = steepest + model.vehicle.limits.acceleration / (STANDARD_GRAVITY * cosine)
    x = y = model.vehicle.com_height * pull
    if any(effect.slug == "com_offset" for effect in model.effects):
        gain = abs(_value(model, "com_offset", "gain"))
        for axis in ("x", "y"):
            known = np.nan_to_num(around.class_rows[:, INDEX[f"com_{axis}"]])
            unknown = math.sqrt(_value(model, "com_offset", f"offset_{axis}_squared"))
            offset = gain * float(np.abs(known).max()) + unknown
            x, y = (x + offset, y) if axis == "x" else (x, y + offset)
    shift = x / np.abs(model.wheels[:, X]).min() + y / np.abs(model.wheels[:, Y]).min()
    return max(0.0, 1.0 - float(shift))


def _spared_at_rest(model: PowerModel) -> float:
    """W by which friction that helps to hold can lower the losses of wheels almost at rest."""
    torque = model.vehicle.limits.continuous_torque
    if not math.isfinite(torque):
        return math.inf
    teeth = torque * (1.0 / _value(model, "gear_loss", "efficiency") - 1.0)
    friction = _value(model, "coulomb_drag", "coulomb_torque")
    return len(model.wheels) * REST_SPEED * (teeth + friction)


def _value(model: PowerModel, slug: str, name: str) -> float:
    return next(
        float(value)
        for (effect, parameter, _, _), value in zip(model.slots, model.parameters, strict=True)
        if effect.slug == slug and parameter == name
    )
