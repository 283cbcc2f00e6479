"""Random states and models that the tests of the power model share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.catalogue import all_effects
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY

Array = NDArray[np.float64]


def column(rows: Array, name: str) -> Array:
    """One quantity of all rows."""
    return rows[:, INDEX[name]]


def plane_gravity(slope: float | Array, uphill: float | Array) -> dict[str, Any]:
    """Columns of gravity on slopes in rad whose uphill direction is seen from the body's x axis."""
    return {
        "gravity_x": -STANDARD_GRAVITY * np.sin(slope) * np.cos(uphill),
        "gravity_y": -STANDARD_GRAVITY * np.sin(slope) * np.sin(uphill),
        "gravity_normal": STANDARD_GRAVITY * np.cos(slope),
    }


def random_columns(count: int, seed: int, *, moving: bool = True) -> dict[str, Array]:
    """Quantities of states a robot of 12 kg can be in; all wheels carry load.

    Args:
        count: number of states.
        seed: of the random numbers.
        moving: also accelerations, yaw rate, payload and centre of mass, not motion alone.
    """
    random = np.random.default_rng(seed)
    heading = random.uniform(-np.pi, np.pi, count)
    speed = random.uniform(0.05, 1.2, count)
    columns = {
        "vx": speed * np.cos(heading),
        "vy": speed * np.sin(heading),
        **plane_gravity(
            random.uniform(0.0, np.radians(20.0), count), random.uniform(-np.pi, np.pi, count)
        ),
    }
    if moving:
        columns |= {
            "wz": random.uniform(-1.0, 1.0, count),
            "ax": random.uniform(-0.5, 0.5, count),
            "ay": random.uniform(-0.5, 0.5, count),
            "yaw_acceleration": random.uniform(-0.5, 0.5, count),
            "payload": random.uniform(0.0, 10.0, count),
            "com_x": random.uniform(-0.04, 0.04, count),
            "com_y": random.uniform(-0.04, 0.04, count),
            "motor_temp": random.uniform(-10.0, 90.0, count),
            "ambient_temp": random.uniform(-10.0, 40.0, count),
            "battery_voltage": random.uniform(20.0, 26.0, count),
            "wind_x": random.uniform(-3.0, 3.0, count),
            "wind_y": random.uniform(-3.0, 3.0, count),
            "slope_rate": random.uniform(0.0, 0.3, count),
            "odometer": random.uniform(0.0, 1e4, count),
            "time_since_start": random.uniform(0.0, 1e3, count),
            "surface": random.integers(-1, 2, count).astype(float),
        }
    return columns


def model_with(*effects: str, **values: float) -> PowerModel:
    """Minibalance's active model with more effects; "slug__parameter" replaces the file's values.

    All other effects are there at their null values: one compiled model serves most tests, and they
    see that nothing comes from effects that are switched off.

    Args:
        effects: slugs beside the vehicle's active ones.
        values: a value for every element of that parameter.
    """
    known = load_vehicle("minibalance")
    active = {*known.active, *effects}
    model = PowerModel.from_vehicle(known, effects=list(all_effects()), surfaces=("hard", "carpet"))
    for place, (effect, _, parameter, _) in enumerate(model.slots):
        if effect.slug not in active and parameter.null is not None:
            model = model.with_parameter(place, parameter.null)
    return changed(model, **values)


def changed(model: PowerModel, **values: float) -> PowerModel:
    """The model with parameters replaced, by "slug__parameter"."""
    parameters = model.parameters.copy()
    for name, value in values.items():
        places = [
            place
            for place, (effect, parameter, _, _) in enumerate(model.slots)
            if f"{effect.slug}__{parameter}" == name
        ]
        assert places, f"no parameter {name}"
        parameters[places] = value
    return replace(model, parameters=parameters)
