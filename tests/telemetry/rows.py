"""Logs made of plain arrays, for tests that know what is in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict

Floats = NDArray[np.float64]

STEP = 0.5
"""Interval of every row, s."""


TRUTH = {
    "electronics__power": 6.1,
    "inertia__yaw_inertia": 1.2,
    "wheel_rolling__rolling": 0.041,
    "roller_drag__roller": 0.038,
    "roller_drag__roller_viscous": 0.01,
    "gear_loss__efficiency": 0.77,
    "copper_loss__resistance": 4.4,
    "coulomb_drag__coulomb_torque": 0.0036,
}
"""Parameters of a robot of the same kind as the vehicle."""


@cache
def base_model() -> PowerModel:
    """The vehicle's base model."""
    return PowerModel.from_vehicle(load_vehicle("minibalance"), effects=())


def plain_log(lengths: Sequence[int], rows: Floats | None = None) -> Telemetry:
    """A log of runs of these lengths with no power; at rest on level ground unless rows are given.

    Args:
        lengths: rows of each run.
        rows: (sum of lengths, ROW_LENGTH).
    """
    count = int(sum(lengths))
    within = np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    return Telemetry(
        rows=np.tile(rows_from(), (count, 1)) if rows is None else rows,
        power=np.zeros(count),
        run=np.repeat(np.arange(len(lengths)), lengths),
        run_names=tuple(f"run {k}" for k in range(len(lengths))),
        time=STEP * within,
        interval=np.full(count, STEP),
        surfaces=(),
        present=frozenset({"vx", "vy", "wz"}),
        derived=(),
        assumed=(),
        report=(),
        source="",
    )


def measured(
    log: Telemetry, model: PowerModel, share: float, seed: int, extra: Floats | float = 0.0
) -> Telemetry:
    """The log with what a model says for its power, something extra, and white noise.

    Args:
        log: the rows.
        model: what really draws the power.
        share: standard deviation of the noise over the mean power.
        seed: of the noise.
        extra: (n,) W that the model does not have.
    """
    watts = predict(model, log) + extra
    noise = np.random.default_rng(seed).standard_normal(len(log))
    return replace(log, power=watts + share * float(np.mean(np.abs(watts))) * noise)


def autoregressive(count: int, correlation: float, rng: np.random.Generator) -> Floats:
    """(count,) values of a stationary AR(1) series of unit variance."""
    values = rng.standard_normal(count)
    for k in range(1, count):
        values[k] = correlation * values[k - 1] + np.sqrt(1.0 - correlation**2) * values[k]
    return values
