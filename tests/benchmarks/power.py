"""Speed of the power model: one evaluation in a compiled loop, compiling, starting from disk.

    measure() -> {"power_ns": …, "blocks_ns": …, "catalogue_ns": …, "catalogue_blocks_ns": …, …}

``blocks`` are the lean kernel's blocks of rows, ``catalogue`` the model with every effect, those
beside the base at their null values. Accuracy stands beside the time: the worst difference, in W,
from the sanity numbers of docs/physics.md that were measured; between blocks and single rows there
is none (tests/power/kernels/test_row_blocks.py).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.account import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.catalogue import all_effects
from planner.power.kernels import KERNEL
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.telemetry.prediction import Nodes, secants

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
Floats = NDArray[np.float64]

# Bus W on the flat at 0.5 m/s: forward, diagonal, sideways; printed to 0.1 W.
FLAT = ((0.0, 13.9), (np.pi / 4, 16.1), (np.pi / 2, 20.4))

START = """
import time
before = time.perf_counter()
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
imported = time.perf_counter()
PowerModel.from_vehicle(load_vehicle("minibalance")).watts(rows_from(vx=0.5))
print(time.perf_counter() - imported, time.perf_counter() - before)
"""


@njit(
    types.float64(KERNEL, _F2, _F1, _F1, _F2, _F1, _F2, types.int64),
    cache=True,
    error_model="numpy",
)
def _many(
    kernel: Any,
    rows: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    account: Any,
    per_wheel: Any,
    times: int,
) -> float:
    total = 0.0
    for _ in range(times):
        for k in range(rows.shape[0]):
            total += kernel(rows[k], parameters, body, wheels, account, per_wheel)
    return total


def different_rows() -> Floats:
    """1,000 different states."""
    random = np.random.default_rng(0)
    slope = random.uniform(-0.3, 0.3, 1000)
    return rows_from(
        vx=random.uniform(-1.0, 1.0, 1000),
        vy=random.uniform(-1.0, 1.0, 1000),
        wz=random.uniform(-1.0, 1.0, 1000),
        gravity_x=-9.80665 * np.sin(slope),
        gravity_normal=9.80665 * np.cos(slope),
    )


def nanoseconds(model: PowerModel, repeats: int = 7) -> tuple[float, float]:
    """Best time of one evaluation, ns of one thread: row by row, and in blocks."""
    rows = different_rows()
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((len(model.wheels), len(PER_WHEEL)))
    # Few rows, so that one thread sees to them; 200 times all of them, like the loop above.
    few = Nodes(rows[:500], np.arange(501), np.ones(500))
    variants, steps = np.tile(model.parameters, (399, 1)), np.ones(399)
    best = [np.inf, np.inf]
    for _ in range(repeats):
        before = time.perf_counter()
        _many(
            model.kernel, rows, model.parameters, model.body, model.wheels, account, per_wheel, 200
        )
        between = time.perf_counter()
        secants(model, few, (), variants, steps)
        after = time.perf_counter()
        best = [min(best[0], between - before), min(best[1], after - between)]
    return 1e9 * best[0] / (200 * len(rows)), 1e9 * best[1] / (400 * 500)


def starts() -> tuple[float, float]:
    """Seconds until the first power in a fresh process: nothing on disk, then all of it."""
    root = Path(__file__).resolve().parents[2]
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            done = subprocess.run(
                [sys.executable, "-c", START],
                env={**os.environ, "JOULEPATH_CACHE_DIR": folder},
                cwd=root,
                capture_output=True,
                text=True,
                check=True,
            )
            seconds.append(float(done.stdout.split()[0]))
    return seconds[0], seconds[1]


def measure() -> dict[str, float]:
    """Times of one evaluation (ns), of the first use and of a later start (s), worst error (W)."""
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    everything = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=list(all_effects()))
    first, again = starts()
    alone, blocks = nanoseconds(model)
    all_alone, all_blocks = nanoseconds(everything.without_candidates())
    rows = rows_from(
        vx=[0.5 * np.cos(heading) for heading, _ in FLAT],
        vy=[0.5 * np.sin(heading) for heading, _ in FLAT],
    )
    error = np.abs(model.watts(rows) - [watts for _, watts in FLAT]).max()
    return {
        "power_ns": alone,
        "blocks_ns": blocks,
        "catalogue_ns": all_alone,
        "catalogue_blocks_ns": all_blocks,
        "power_first_s": first,
        "power_again_s": again,
        "power_error": float(error),
    }


if __name__ == "__main__":
    for name, value in measure().items():
        print(f"{name:16} {value:10.3f}")
