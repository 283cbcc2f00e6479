"""Small terrains for the tests, made from numbers or drawn as text."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.terrain.heightmap import Terrain
from planner.terrain.surface import GroundClass


def terrain(
    heights: NDArray[np.float64],
    *,
    cell: float | tuple[float, float] = 0.25,
    obstacles: NDArray[np.bool_] | None = None,
    known: NDArray[np.bool_] | None = None,
    ground: NDArray[np.uint8] | None = None,
    classes: tuple[GroundClass, ...] = (GroundClass("concrete"),),
    origin: tuple[float, float] = (0.0, 0.0),
) -> Terrain:
    """A terrain of these heights; row 0 is south."""
    nothing = np.zeros(heights.shape, bool)
    return Terrain(
        name="test",
        heights=np.ascontiguousarray(heights, dtype=float),
        known=~nothing if known is None else known,
        obstacles=nothing if obstacles is None else obstacles,
        ground=nothing.astype(np.uint8) if ground is None else ground,
        ground_classes=classes,
        origin=origin,
        cell=(cell, cell) if isinstance(cell, float) else cell,
        crs=None,
        source="made by a test",
    )


def drawn(picture: str, *, cell: float) -> Terrain:
    """Flat ground with obstacles '#' and holes '?'; the first line is the northern edge."""
    rows = [line.strip() for line in picture.strip().splitlines()][::-1]
    letters = np.array([list(row) for row in rows])
    return terrain(
        np.zeros(letters.shape), cell=cell, obstacles=letters == "#", known=letters != "?"
    )


def hills(
    count: int = 96, *, cell: float = 0.25, rms_degrees: float = 6.0, seed: int = 3
) -> NDArray[np.float64]:
    """Smooth random relief (count, count): a sum of 24 plane waves of 6 to 20 m."""
    rng = np.random.default_rng(seed)
    x = cell * np.arange(count)
    heights = np.zeros((count, count))
    for _ in range(24):
        length, azimuth, phase = rng.uniform(6, 20), rng.uniform(0, 7), rng.uniform(0, 7)
        k = 2.0 * np.pi / length
        heights += (
            np.sin(k * (np.cos(azimuth) * x[None, :] + np.sin(azimuth) * x[:, None]) + phase) / k
        )
    slope_y, slope_x = np.gradient(heights, cell)
    rms = np.sqrt((slope_x**2 + slope_y**2).mean())
    return np.asarray(heights * np.tan(np.radians(rms_degrees)) / rms)
