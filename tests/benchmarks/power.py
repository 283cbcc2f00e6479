"""Speed of the power model: one evaluation in a compiled loop, compiling, starting from disk.

    measure() -> {"power_ns": …, "power_first_s": …, "power_again_s": …, "power_error": …}

Accuracy stands beside the time: the worst difference, in W, from the sanity numbers of
docs/physics.md that were measured.
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

from planner.power.compile_kernel import KERNEL
from planner.power.model import PowerModel, rows_from
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.vehicle import load_vehicle

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")

# Bus W on the flat at 0.5 m/s: forward, diagonal, sideways; printed to 0.1 W.
FLAT = ((0.0, 13.9), (np.pi / 4, 16.1), (np.pi / 2, 20.4))

START = """
import time
before = time.perf_counter()
from planner.power.model import PowerModel, rows_from
from planner.power.vehicle import load_vehicle
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


def nanoseconds(model: PowerModel, repeats: int = 7) -> float:
    """Best time of one evaluation in a loop over 1,000 different states, ns."""
    random = np.random.default_rng(0)
    slope = random.uniform(-0.3, 0.3, 1000)
    rows = rows_from(
        vx=random.uniform(-1.0, 1.0, 1000),
        vy=random.uniform(-1.0, 1.0, 1000),
        wz=random.uniform(-1.0, 1.0, 1000),
        gravity_x=-9.80665 * np.sin(slope),
        gravity_normal=9.80665 * np.cos(slope),
    )
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((len(model.wheels), len(PER_WHEEL)))
    best = np.inf
    for _ in range(repeats):
        before = time.perf_counter()
        _many(
            model.kernel, rows, model.parameters, model.body, model.wheels, account, per_wheel, 200
        )
        best = min(best, time.perf_counter() - before)
    return float(1e9 * best / (200 * len(rows)))


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
    """Time of one evaluation (ns), of the first use and of a later start (s), worst error (W)."""
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    first, again = starts()
    rows = rows_from(
        vx=[0.5 * np.cos(heading) for heading, _ in FLAT],
        vy=[0.5 * np.sin(heading) for heading, _ in FLAT],
    )
    error = np.abs(model.watts(rows) - [watts for _, watts in FLAT]).max()
    return {
        "power_ns": nanoseconds(model),
        "power_first_s": first,
        "power_again_s": again,
        "power_error": float(error),
    }


if __name__ == "__main__":
    for name, value in measure().items():
        print(f"{name:16} {value:10.3f}")
