"""How a model's power changes with its parameters: compiled loops over the rows of a log.

    watts = mean_watts(model, nodes)                      # nodes: planner.telemetry.interval
    watts, columns = differences(model, nodes, variants)  # columns[:, j]: variant j less watts
    watts, columns = tangent(model, nodes, places)        # derivative by parameters[places]

A variant is a whole parameter array. A small step gives a derivative, a step of the size that an
effect is thought to have gives the *secant*, which says what the effect does at that size.
Differences of the real kernel are used, not complex steps: with a relative step of 1e-6 they agree
with those to 1e-5 and cost a tenth (tests/telemetry/test_identification_sensitivity.py).

The rows are shared out among the processor's cores; the compiled loop holds no lock of Python's.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.compile_kernel import BLOCK_KERNEL
from planner.power.model import PowerModel
from planner.power.row_blocks import BLOCK
from planner.quantities import INDEX
from planner.telemetry.interval import Nodes, interval_nodes
from planner.telemetry.log import Telemetry

Floats = NDArray[np.float64]

STEP = 1e-6
"""Step of a derivative relative to the parameter's size."""
_PIECE = 4096  # rows that one task takes at most
_SMALL = 500  # rows that one thread sees to
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


def differences(model: PowerModel, nodes: Nodes, variants: Floats) -> tuple[Floats, Floats]:
    """Power of the model, and its change when the parameters are replaced.

    Args:
        model: the model in the middle.
        nodes: the rows of a log, see planner.telemetry.interval.
        variants: (m, P) whole parameter arrays.

    Returns:
        (n,) W and (n, m) W.
    """
    variants = np.ascontiguousarray(variants, dtype=float).reshape(-1, len(model.parameters))
    count = len(nodes.first) - 1
    watts = np.empty(count)
    columns = np.empty((count, len(variants)))

    # As many for each core, so that none waits for another's last one.
    rounds = -(-count // (_PIECE * _cores()))
    length = -(-count // (rounds * _cores())) if count > _SMALL else max(count, 1)

    def piece(start: int) -> None:
        stop = min(start + length, count)
        _differences(
            model.lean_kernel,
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
    return watts, columns


def mean_watts(model: PowerModel, nodes: Nodes) -> Floats:
    """(n,) W, what the model says for the rows of a log."""
    return differences(model, nodes, np.empty((0, len(model.parameters))))[0]


def predict(model: PowerModel, log: Telemetry) -> Floats:
    """(n,) W, what the model says for a log, to be compared with ``log.power``."""
    return mean_watts(model, interval_nodes(log.rows_for(model.surfaces), log.interval, model))


SPEED_ERROR = (0.01, 0.01, 0.03)
"""m/s, m/s and rad/s: odometry's error, and the speeds within which friction changes side."""
SLOW = 0.03
"""m/s; a wheel whose rim is slower may stand, whatever its measured speed says."""


def doubt_of(model: PowerModel, rows: Floats) -> Floats:
    """How far the power may be off in single rows because a wheel's speed is not known to be zero.

    A robot that stands on a slope may be held by friction or by its motors, a wheel that hardly
    turns may be braked by friction or pushed, and a speed of a few millimetres a second decides
    between them. Rows in which no wheel is slow have no such doubt.

    Args:
        model: the model.
        rows: (n, ROW_LENGTH), ``surface`` counting in the model's list.

    Returns:
        (n,) W, the largest change of power by an error of one speed; 0 for rows in motion.
    """
    motion = rows[:, [INDEX["vx"], INDEX["vy"], INDEX["wz"]]].T
    rim = model.wheels[:, 2:5] @ motion
    slow = np.flatnonzero(np.any(np.abs(rim) < SLOW, axis=0))
    doubt = np.zeros(len(rows))
    if not len(slow):
        return doubt
    errors = [
        (name, sign * size)
        for name, size in zip(("vx", "vy", "wz"), SPEED_ERROR, strict=True)
        for sign in (1.0, -1.0)
    ]
    moved = np.repeat(rows[slow][:, None, :], len(errors) + 1, axis=1)
    for number, (name, error) in enumerate(errors, start=1):
        moved[:, number, INDEX[name]] += error
    count = len(slow) * (len(errors) + 1)
    single = Nodes(moved.reshape(-1, rows.shape[1]), np.arange(count + 1), np.ones(count))
    watts = mean_watts(model, single).reshape(len(slow), -1)
    doubt[slow] = np.abs(watts[:, 1:] - watts[:, :1]).max(axis=1)
    return doubt


RUN_ERRORS = {"payload": 0.02, "com_x": 0.002, "com_y": 0.002, "ambient_temp": 0.5}
"""kg, m, m and °C: usual errors of what is weighed or measured once before a run."""


def run_errors(model: PowerModel, nodes: Nodes, watts: Floats, known: Collection[str]) -> Floats:
    """What an error of a quantity that is measured once a run does to the power of its rows.

    Args:
        model: the model.
        nodes: the rows of a log.
        watts: (n,) W, what the model says for them.
        known: quantities that the log has.

    Returns:
        (n, k) W, one column for each quantity of RUN_ERRORS that is known and acts, by its usual
        error.
    """
    columns = []
    for name, error in RUN_ERRORS.items():
        if name in known:
            rows = nodes.rows.copy()
            rows[:, INDEX[name]] += error
            column = mean_watts(model, nodes._replace(rows=rows)) - watts
            if np.any(column):
                columns.append(column)
    return np.column_stack(columns) if columns else np.empty((len(watts), 0))


def sizes(model: PowerModel) -> Floats:
    """(P,) size of every parameter that a step is taken relative to.

    Factors of single wheels and grounds are relative changes: their size is one.
    """
    result = np.empty(len(model.parameters))
    for place, (_, _, parameter, _) in enumerate(model.slots):
        value = abs(float(model.parameters[place]))
        usual = abs(parameter.default - (parameter.null or 0.0))
        # A value that a fit left next to nothing must not become the measure of itself.
        size = max(value, usual or min(1e-2, parameter.bounds[1]))
        result[place] = size if parameter.per is None else 1.0
    return result


def small_steps(model: PowerModel, places: Sequence[int]) -> tuple[Floats, Floats]:
    """Parameters with a small step in one of them: (m, P) arrays, and the (m,) steps.

    At a bound the step goes inwards, so that no parameter leaves its physical range.
    """
    variants = np.tile(model.parameters, (len(places), 1))
    size = sizes(model)
    for column, place in enumerate(places):
        step = STEP * size[place]
        if model.parameters[place] + step > model.slots[place][2].bounds[1]:
            step = -step
        variants[column, place] += step
    chosen = np.arange(len(places)), list(places)
    return variants, variants[chosen] - model.parameters[chosen[1]]


def tangent(model: PowerModel, nodes: Nodes, places: Sequence[int]) -> tuple[Floats, Floats]:
    """Power of the model, (n,) W, and its derivative by some parameters, (n, len(places))."""
    variants, steps = small_steps(model, places)
    watts, columns = differences(model, nodes, variants)
    return watts, columns / steps
