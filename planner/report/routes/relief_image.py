"""A map's heights as a picture: tinted by height, shaded by the sun from the north-west.

Shade is that of a surface that scatters light evenly, n · l with the light 45° above the horizon.
Heights are exaggerated so that gentle ground shows its form too; the picture is for looking at,
not for measuring slopes.
"""

from __future__ import annotations

import base64
import io
import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from planner.terrain.heightmap import Terrain

Window = tuple[float, float, float, float]

# Low ground to high ground; muted, so that a coloured route stands out.
_TINTS = np.array([[176, 190, 165], [208, 206, 176], [206, 188, 158], [222, 212, 202]], float)
_OBSTACLE = np.array([64, 70, 84], float)
_UNKNOWN = np.array([236, 236, 238], float)
_GROUNDS = np.array([[1, 1, 1], [1.0, 0.90, 0.84], [0.86, 0.94, 1.0], [0.92, 1.0, 0.86]], float)


def relief_image(terrain: Terrain, window: Window, *, pixels: int = 900) -> Image.Image:
    """Picture of a part of a map, north up.

    Args:
        terrain: the map.
        window: xmin, ymin, xmax, ymax in m.
        pixels: of the longer side.
    """
    x0, y0, x1, y1 = window
    scale = pixels / max(x1 - x0, y1 - y0)
    columns = max(2, round((x1 - x0) * scale))
    rows = max(2, round((y1 - y0) * scale))
    u = (x0 + (np.arange(columns) + 0.5) / scale - terrain.origin[0]) / terrain.cell[0]
    v = (y1 - (np.arange(rows) + 0.5) / scale - terrain.origin[1]) / terrain.cell[1]
    places = np.meshgrid(v, u, indexing="ij")
    # Without its prefilter the spline smooths a little and does not ring beside ledges.
    heights = ndimage.map_coordinates(
        terrain.heights, places, order=3, mode="nearest", prefilter=False
    )
    j = np.clip(np.rint(v), 0, terrain.heights.shape[0] - 1).astype(int)
    i = np.clip(np.rint(u), 0, terrain.heights.shape[1] - 1).astype(int)
    cells = np.ix_(j, i)
    colour = _tint(heights) * _shade(heights, 1 / scale)[..., None]
    colour *= _GROUNDS[terrain.ground[cells] % len(_GROUNDS)]
    colour = np.where(terrain.known[cells][..., None], colour, _UNKNOWN)
    colour = np.where(terrain.obstacles[cells][..., None], _OBSTACLE, colour)
    return Image.fromarray(np.clip(colour, 0, 255).astype(np.uint8), "RGB")


def ground_colours(terrain: Terrain) -> dict[str, str]:
    """Kinds of ground that a map has, each with its mean colour in the picture."""
    tints = _tint(terrain.heights)
    found = {}
    for number, ground in enumerate(terrain.ground_classes):
        cells = (terrain.ground == number) & terrain.known & ~terrain.obstacles
        if cells.any():
            mean = tints[cells].mean(axis=0) * _GROUNDS[number % len(_GROUNDS)]
            found[ground.name] = "#{:02x}{:02x}{:02x}".format(*mean.astype(int))
    return found


def as_data_url(image: Image.Image) -> str:
    """A picture as text that a page can hold; JPEG, as relief has few sharp edges."""
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=82, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()


def _tint(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    low, high = heights.min(), heights.max()
    share = (heights - low) / (high - low) if high - low > 1e-9 else np.full(heights.shape, 0.35)
    place = share * (len(_TINTS) - 1)
    stops = np.arange(len(_TINTS))
    return np.stack([np.interp(place, stops, _TINTS[:, k]) for k in range(3)], axis=-1)


def _shade(heights: NDArray[np.float64], pixel: float) -> NDArray[np.float64]:
    """Brightness around 1, for rows that run from north to south."""
    south, east = np.gradient(heights, pixel)
    steep = float(np.quantile(np.hypot(south, east), 0.95))
    # The steepest twentieth appears as 45°; flat ground stays flat, noise is not blown up.
    factor = min(1.0 / max(steep, 1e-3), 25.0)
    slope_east, slope_north = factor * east, -factor * south
    light = np.array([-1.0, 1.0, math.sqrt(2.0)]) / 2.0
    normal = np.sqrt(1.0 + slope_east**2 + slope_north**2)
    lit = (-slope_east * light[0] - slope_north * light[1] + light[2]) / normal
    brightness: NDArray[np.float64] = 0.62 + 0.55 * np.clip(lit, 0, 1)
    return brightness
