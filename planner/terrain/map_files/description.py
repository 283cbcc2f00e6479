"""What a map holds, in figures: extent, cells, slopes, obstacles, unknown ground.

describe_map(open_map("warehouse"))["slopes"]
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.arrays import Array, Mask
from planner.terrain.heightmap import Terrain

STEEPER_THAN = (2.0, 5.0, 10.0, 20.0)
"""Degrees of which the share of steeper ground is given."""
NOISE_GROWTH = 1.2
"""Difference of heights over two cells to that over one: 2 on a slope, √2 on the roughest ground,
1 where each height errs by itself."""
NOISE_SLOPE = 5.0
"""Degrees between neighbours below which such errors harm no route: a ramp's."""


ENOUGH_CELLS = 1_000_000
"""Cells of which the noise shows; of a larger map some of its lines are looked at."""
WIDEST_WALL = 1.0
"""m; a floor plan with larger cells has no walls, and its resolution is perhaps in mm."""


def describe_map(terrain: Terrain) -> dict[str, Any]:
    """Figures of a map, ready for JSON.

    Slopes are the steepest at a cell, from differences to its western and southern neighbours of
    known ground without obstacles.
    """
    ny, nx = terrain.heights.shape
    dx, dy = terrain.cell
    ground = terrain.known & ~terrain.obstacles
    along, across = (
        np.abs(np.diff(terrain.heights, axis=axis)) / size for axis, size in ((1, dx), (0, dy))
    )
    climbs = np.zeros((2, ny, nx))
    np.copyto(climbs[0, :, 1:], along, where=ground[:, 1:] & ground[:, :-1])
    np.copyto(climbs[1, 1:], across, where=ground[1:] & ground[:-1])
    slope = np.hypot(*climbs)
    degrees = np.degrees(np.arctan(slope[ground]))
    heights = terrain.heights[ground]
    some = bool(len(heights))
    relief = float(np.ptp(heights)) if some else 0.0
    west, south, east, north = terrain.extent
    least = min(east - west, north - south)
    found = {
        f"heights differ by {relief:.4g} m on a map {least:.4g} m wide; perhaps they are in mm, cm "
        "or gray steps": relief > least,
        f"a floor plan with cells of {max(dx, dy):g} m; its resolution is in m a pixel": (
            max(dx, dy) > WIDEST_WALL and relief == 0.0 and bool(terrain.obstacles.any())
        ),
        "heights jump from cell to cell without a slope that lasts: noise of a sensor, which makes "
        "ledges and drag; smooth them over some cells first": _noisy(terrain, ground),
    }
    return {
        "name": terrain.name,
        "source": terrain.source,
        "crs": terrain.crs,
        "extent_m": list(terrain.extent),
        "cells": [nx, ny],
        "cell_m": [dx, dy],
        "heights_m": [float(heights.min()), float(heights.max())] if some else None,
        "slopes": {
            "steepest_deg": float(degrees.max()) if some else None,
            "share_steeper_than_deg": {
                f"{limit:g}": float((degrees > limit).mean()) if some else None
                for limit in STEEPER_THAN
            },
        },
        "odd": [*terrain.odd, *(sentence for sentence, holds in found.items() if holds)],
        "obstacles_share": float(terrain.obstacles.mean()),
        "unknown_share": float(1.0 - terrain.known.mean()),
        "ground_shares": {
            kind.name: float((terrain.ground[ground] == number).mean()) if some else 0.0
            for number, kind in enumerate(terrain.ground_classes)
        },
    }


def _noisy(terrain: Terrain, ground: Mask) -> bool:
    """Whether neighbours differ as much as heights two cells apart, and much for their distance."""
    jumps: dict[int, list[Array]] = {1: [], 2: []}
    every = 1 + terrain.heights.size // ENOUGH_CELLS
    slopes = []
    for heights, known, size in (
        (terrain.heights, ground, terrain.cell[1]),
        (terrain.heights.T, ground.T, terrain.cell[0]),
    ):
        # Lines apart from each other: the neighbours along a line stay neighbours.
        heights, known = heights[:, ::every], known[:, ::every]
        for lag, squares in jumps.items():
            both = known[lag:] & known[:-lag]
            squares.append((heights[lag:] - heights[:-lag])[both] ** 2)
        slopes.append(np.sqrt(jumps[1][-1]) / size)
    one, two = (np.concatenate(squares) for squares in jumps.values())
    if not len(one) or not len(two):
        return False
    steep = float(np.median(np.concatenate(slopes))) > np.tan(np.radians(NOISE_SLOPE))
    return bool(steep and two.mean() < NOISE_GROWTH**2 * one.mean())
