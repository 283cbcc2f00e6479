"""Power of a model and its Jacobian: compiled loops over the rows of a log.

    watts = predict(model, log)                        # or the Nodes of a log
    watts, columns = tangent(model, nodes, places)     # derivative by parameters[places]
    watts, own, columns = secants(model, nodes, places, variants, steps)

A variant is a whole parameter array. A small step gives a derivative, a step of the size that an
effect is thought to have gives the *secant*, which says what the effect does at that size.
Differences of the real kernel are used, not complex steps: with a relative step of 1e-6 they agree
with those to 1e-5 and cost a tenth (tests/telemetry/prediction/test_sensitivity.py).

The rows are shared out among the processor's cores; the compiled loop holds no lock of Python's.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.parameters import sizes
from planner.telemetry.prediction.nodes import Nodes

RELATIVE_STEP = 1e-6
"""Step of a derivative over the parameter's size: rounding and curvature stay below 1e-5."""
_TASK_ROWS = 4096
"""Rows that one task takes at most."""
_ONE_THREAD_ROWS = 500
"""Rows up to which one thread is faster than several."""
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")


@njit(
    types.void(BLOCK_KERNEL, _F2, _I1, _F1, _F1, _F2, _F1, _F2, _F1, _F2),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _differences(
    kernel: Any,
    rows: Any,
    first: Any,
    weight: Any,
    parameters: Any,
    variants: Any,
    body: Any,
    wheels: Any,
    watts: Any,
    columns: Any,
) -> None:
    watts[:] = 0.0
    columns[:] = 0.0
    block = np.empty(rows.shape[1] * BLOCK)
    of_row = np.empty(BLOCK, np.int64)
    here, there = np.empty(BLOCK), np.empty(BLOCK)
    row = 0
    for start in range(first[0], first[-1], BLOCK):
        count = min(BLOCK, first[-1] - start)
        for k in range(count):
            while first[row + 1] <= start + k:
                row += 1
            of_row[k] = row
            for quantity in range(rows.shape[1]):
                block[quantity * BLOCK + k] = rows[start + k, quantity]
        kernel(block, count, parameters, body, wheels, here)
        for k in range(count):
            watts[of_row[k]] += weight[start + k] * here[k]
        for j in range(variants.shape[0]):
            kernel(block, count, variants[j], body, wheels, there)
            for k in range(count):
                columns[of_row[k], j] += weight[start + k] * (there[k] - here[k])


def _cores() -> int:
    return len(os.sched_getaffinity(0))


@lru_cache(maxsize=1)
def _threads(process: int) -> ThreadPoolExecutor:
    # Keyed by the process: threads do not survive a fork.
    return ThreadPoolExecutor(max_workers=_cores())


def differences(model: PowerModel, nodes: Nodes, variants: Array) -> tuple[Array, Array]:
    """Power of the model, and its change when the parameters are replaced.

    Args:
        model: the model in the middle.
        nodes: the rows of a log, see nodes.
        variants: (m, P) whole parameter arrays.

    Returns:
        (n,) W and (n, m) W, as the log's meter shows them.
    """
    variants = np.ascontiguousarray(variants, dtype=float).reshape(-1, len(model.parameters))
    count = len(nodes.first) - 1
    watts = np.empty(count)
    columns = np.empty((count, len(variants)))

    # As many for each core, so that none waits for another's last one.
    rounds = -(-count // (_TASK_ROWS * _cores()))
    length = -(-count // (rounds * _cores())) if count > _ONE_THREAD_ROWS else max(count, 1)

    def piece(start: int) -> None:
        stop = min(start + length, count)
        _differences(
            model.power_kernel,
            nodes.rows,
            nodes.first[start : stop + 1],
            nodes.weight,
            model.parameters,
            variants,
            model.body,
            model.wheels,
            watts[start:stop],
            columns[start:stop],
        )

    starts = range(0, count, length)
    if len(starts) <= 1:
        piece(0)
    else:
        list(_threads(os.getpid()).map(piece, starts))
    if nodes.readings is not None:
        watts, columns = nodes.readings.shown(watts), nodes.readings.change(columns)
    return watts, columns


def predict(model: PowerModel, log: Telemetry | Nodes) -> Array:
    """(n,) W, what the model says for a log or its nodes, to be compared with ``log.power``."""
    nodes = log if isinstance(log, Nodes) else Nodes.of(log, model)
    return differences(model, nodes, np.empty((0, len(model.parameters))))[0]


UNSURE_RIM_SPEED = 0.03
"""m/s; a wheel whose rim is slower may stand: three times the usual error of odometry."""


def input_uncertainty(model: PowerModel, rows: Array) -> Array:
    """Uncertainty of the power in single rows where a wheel may stand or turn.

    A robot that stands on a slope may be held by friction or by its motors, a wheel that hardly
    turns may be braked by friction or pushed, and a speed of a few millimetres a second decides
    between them. Rows in which no wheel is slow have no such uncertainty.

    Args:
        model: the model.
        rows: (n, ROW_LENGTH), ``surface`` counting in the model's list.

    Returns:
        (n,) W, the largest change of power by an error of one speed; 0 for rows in motion.
    """
    motion = rows[:, [INDEX["vx"], INDEX["vy"], INDEX["wz"]]].T
    rim = model.wheels[:, 2:5] @ motion
    slow = np.flatnonzero(np.any(np.abs(rim) < UNSURE_RIM_SPEED, axis=0))
    input_error = np.zeros(len(rows))
    if not len(slow):
        return input_error
    errors = [
        (name, sign * size)
        for name, size in zip(("vx", "vy", "wz"), Telemetry.SPEED_ERROR, strict=True)
        for sign in (1.0, -1.0)
    ]
    moved = np.repeat(rows[slow][:, None, :], len(errors) + 1, axis=1)
    for number, (name, error) in enumerate(errors, start=1):
        moved[:, number, INDEX[name]] += error
    count = len(slow) * (len(errors) + 1)
    single = Nodes(moved.reshape(-1, rows.shape[1]), np.arange(count + 1), np.ones(count))
    watts = predict(model, single).reshape(len(slow), -1)
    input_error[slow] = np.abs(watts[:, 1:] - watts[:, :1]).max(axis=1)
    return input_error


def small_steps(model: PowerModel, places: Sequence[int]) -> tuple[Array, Array]:
    """Parameters with a small step in one of them: (m, P) arrays, and the (m,) steps.

    At a bound the step goes inwards, so that no parameter leaves its physical range.
    """
    variants = np.tile(model.parameters, (len(places), 1))
    size = sizes(model)
    for column, place in enumerate(places):
        step = RELATIVE_STEP * size[place]
        if model.parameters[place] + step > model.slots[place][2].bounds[1]:
            step = -step
        variants[column, place] += step
    chosen = np.arange(len(places)), list(places)
    return variants, variants[chosen] - model.parameters[chosen[1]]


def tangent(model: PowerModel, nodes: Nodes, places: Sequence[int]) -> tuple[Array, Array]:
    """Power of the model, (n,) W, and its derivative by some parameters, (n, len(places))."""
    variants, steps = small_steps(model, places)
    watts, columns = differences(model, nodes, variants)
    return watts, columns / steps


def secants(
    model: PowerModel, nodes: Nodes, places: Sequence[int], variants: Array, steps: Array
) -> tuple[Array, Array, Array]:
    """Tangent of the model, and secants towards whole parameter arrays, in one pass.

    Args:
        model: the model in the middle.
        nodes: the rows of a log.
        places: numbers of the parameters of the tangent.
        variants: (m, P) whole parameter arrays.
        steps: (m,) what each change of power is taken relative to.

    Returns:
        (n,) W of the model, (n, len(places)) and (n, m) W per unit.
    """
    stepped, small = small_steps(model, places)
    watts, changes = differences(model, nodes, np.concatenate([stepped, variants]))
    own, columns = np.split(changes / np.concatenate([small, steps]), [len(small)], axis=1)
    return watts, own, columns
