"""What a map holds, in figures: extent, cells, slopes, obstacles, unknown ground.

describe_map(open_map("warehouse"))["slopes"]
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.terrain.heightmap import Terrain

STEEPER_THAN = (2.0, 5.0, 10.0, 20.0)
"""Degrees of which the share of steeper ground is given."""


def describe_map(terrain: Terrain) -> dict[str, Any]:
    """Figures of a map, ready for JSON.

    Slopes are differences of neighbouring cells of known ground without obstacles.
    """
    ny, nx = terrain.heights.shape
    dx, dy = terrain.cell
    ground = terrain.known & ~terrain.obstacles
    along, across = (
        np.abs(np.diff(terrain.heights, axis=axis)) / size for axis, size in ((1, dx), (0, dy))
    )
    slope = np.zeros((ny, nx))
    np.maximum(slope[:, 1:], along, out=slope[:, 1:], where=ground[:, 1:] & ground[:, :-1])
    np.maximum(slope[1:], across, out=slope[1:], where=ground[1:] & ground[:-1])
    degrees = np.degrees(np.arctan(slope[ground]))
    heights = terrain.heights[ground]
    some = bool(len(heights))
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
        "obstacles_share": float(terrain.obstacles.mean()),
        "unknown_share": float(1.0 - terrain.known.mean()),
        "ground_shares": {
            kind.name: float((terrain.ground[ground] == number).mean()) if some else 0.0
            for number, kind in enumerate(terrain.ground_classes)
        },
    }
