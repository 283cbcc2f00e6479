"""Questions that benchmarks of planning ask: maps, and places on them at random.

    for asked in questions(open_map("cone"), count=4, seed=7):
        plan_route(map="cone", **asked)

Every question has a route.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner import plan_route
from planner.errors import InputError
from planner.terrain.heightmap import Terrain

MAPS = ("fractal-512", "jacksboro-1to100", "cone", "saddle", "warehouse")
FIRST_SEED = 100
"""Of the questions on the first of the maps; the next ones follow."""

Question = dict[str, Any]


def fractal(count: int, seed: int) -> Terrain:
    """Relief of count by count cells of 0.25 m with a mean slope of 4.6°."""
    rng = np.random.default_rng(seed)
    rows, columns = np.fft.fftfreq(count)[:, None], np.fft.rfftfreq(count)[None, :]
    frequency = np.hypot(rows, columns)
    frequency[0, 0] = 1.0
    spectrum = rng.standard_normal(frequency.shape) + 1j * rng.standard_normal(frequency.shape)
    heights = np.fft.irfft2(spectrum / frequency**2.1, (count, count))
    slope = np.hypot(*np.gradient(heights, 0.25)).mean()
    return Terrain.from_arrays(heights * (0.08 / slope), cell=(0.25, 0.25), name=f"fractal-{count}")


def questions(terrain: Terrain, count: int, seed: int) -> list[Question]:
    """Starts and goals at random that have a route."""
    rng = np.random.default_rng(seed)
    west, south, east, north = terrain.extent
    found: list[Question] = []
    while len(found) < count:
        x = west + (east - west) * rng.uniform(0.05, 0.95, 2)
        y = south + (north - south) * rng.uniform(0.05, 0.95, 2)
        asked = {
            "start": {"x": float(x[0]), "y": float(y[0])},
            "goal": {"x": float(x[1]), "y": float(y[1])},
        }
        if np.hypot(x[1] - x[0], y[1] - y[0]) < 0.2 * (east - west):
            continue
        try:
            if plan_route(terrain=terrain, **asked).status == "ok":
                found.append(asked)
        except InputError:
            continue
    return found
