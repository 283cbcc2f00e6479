"""What a motion takes from the source: by step, and with the account by physical effect.

route = drive(field, conditions, legs, yaws)      # or Infeasible, with the place
route = price(field, conditions, motion)                       # of a motion that is there already
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.quantities import STANDARD_GRAVITY
from planner.search.certificate import lower_bound
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.results.energy_interval import energy_distribution, thinned
from planner.search.results.route import Battery, Route
from planner.search.trajectory import Motion, limits_used, motion_rows, move
from planner.search.wanted_yaw import Wanted


def drive(
    field: CostField,
    conditions: OperatingConditions,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    *,
    charge: float | None = None,
) -> Route | Infeasible:
    """The best motion along a path and its energy.

    Args:
        field: map and costs.
        conditions: model and conditions.
        legs: polylines from one fixed point to the next.
        yaws: asked for at every fixed point.
        charge: share of the battery's capacity that is left; None counts it as full.
    """
    motion = move(field, conditions, legs, yaws)
    return (
        motion
        if isinstance(motion, Infeasible)
        else price(field, conditions, motion, charge=charge)
    )


def energy_by_step(field: CostField, conditions: OperatingConditions, motion: Motion) -> Array:
    """J of a motion's steps (n - 1,), without the account by effect."""
    rows, seconds, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind)
    watts = _watts(conditions.model, rows)
    return np.asarray(np.bincount(owner, watts * seconds, len(motion.x) - 1), float)


def energy_of(field: CostField, conditions: OperatingConditions, motion: Motion) -> float:
    """J of a motion, without the account by effect."""
    return float(energy_by_step(field, conditions, motion).sum())


def _watts(model: PowerModel, rows: Array) -> Array:
    """Power of rows (n,), in blocks: its kernel is compiled for the profiles anyway."""
    return model.power_and_limits(rows)[:, 0]


def price(
    field: CostField,
    conditions: OperatingConditions,
    motion: Motion,
    *,
    charge: float | None = None,
) -> Route:
    """The energy of a finished motion, by effect; its interval is found when it is asked for."""
    model = conditions.model
    rows, seconds, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind)
    shares = model.watts_by_effect(rows, watts=_watts)
    steps = len(motion.x) - 1
    durations = np.diff(motion.time)
    by_step = {
        slug: np.bincount(owner, watts * seconds, minlength=steps) for slug, watts in shares.items()
    }
    joules = np.sum(list(by_step.values()), axis=0)
    energy = float(joules.sum())
    breakdown = {slug: float(values.sum()) for slug, values in by_step.items()}
    first = np.zeros(1)
    arrays = {
        "x": motion.x,
        "y": motion.y,
        "z": motion.heights,
        "yaw": motion.yaw,
        "t": motion.time,
        "speed": motion.speed,
        "energy_j": np.concatenate([first, np.cumsum(joules)]),
        "watts": np.concatenate([first, joules / durations]),
    }
    # The sum in another order may differ in the last digit; the account must close exactly.
    arrays["energy_j"][-1] = energy
    climb = float(motion.heights[-1] - motion.heights[0])
    distance = math.hypot(motion.x[-1] - motion.x[0], motion.y[-1] - motion.y[0])
    # Not clipped to the energy: a bound above it is a fault, and must show as a negative gap.
    bound = lower_bound(conditions, distance, climb, float(field.limit.max()))
    dissipated = energy - conditions.mass * STANDARD_GRAVITY * climb
    surface = np.sqrt(
        np.diff(motion.x) ** 2 + np.diff(motion.y) ** 2 + np.diff(motion.heights) ** 2
    )
    return Route(
        energy_j=energy,
        lower_bound_j=bound,
        gap=(energy - bound) / dissipated if dissipated > 0.0 else 0.0,
        duration_s=float(motion.time[-1]),
        length_m=float(surface.sum()),
        known=partial(energy_distribution, model, *thinned(rows, seconds), energy),
        breakdown_j=breakdown,
        arrays=arrays,
        watts_by_effect={
            slug: np.concatenate([first, values / durations]) for slug, values in by_step.items()
        },
        battery=_battery(model.vehicle.battery.capacity, charge, energy),
        motion=motion,
        uses=partial(limits_used, field, conditions, motion),
    )


def _battery(capacity: float, charge: float | None, energy: float) -> Battery | None:
    if not math.isfinite(capacity):
        return None
    available = capacity * (1.0 if charge is None else charge)
    share = energy / available if available > 0.0 else math.inf
    return Battery(available, share if math.isfinite(share) else 1e9, energy <= available)
