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
    odd = [
        f"heights differ by {relief:.4g} m on a map {least:.4g} m wide; perhaps they are in mm, cm "
        "or gray steps"
    ]
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
        "odd": odd if relief > least else [],
        "obstacles_share": float(terrain.obstacles.mean()),
        "unknown_share": float(1.0 - terrain.known.mean()),
        "ground_shares": {
            kind.name: float((terrain.ground[ground] == number).mean()) if some else 0.0
            for number, kind in enumerate(terrain.ground_classes)
        },
    }
