"""Pictures of a map: heights, holes and obstacles, and where a robot cannot go."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.report.routes import ground_layer, whole_map
from planner.terrain.catalogue import open_map


def relief_of(name: str, most: int, report: bool = False) -> dict[str, Any]:
    """Heights and geometry of a map.

    Args:
        name: as in a request.
        most: largest number of columns or rows.
        report: whether the picture itself comes with them.

    Returns:
        ``columns``, ``rows``; ``origin`` (x, y of the first height) and ``cell`` (dx, dy) in m;
        ``extent`` (xmin, ymin, xmax, ymax) of the whole map; ``heights`` in m row by row from the
        south, null where the ground is unknown; ``blocked`` likewise, 1 where an obstacle stands
        in any cell that was thinned out; ``report``, the picture as SVG, if asked for.
    """
    terrain = open_map(name)
    rows, columns = terrain.heights.shape
    step = max(1, math.ceil(max(rows, columns) / most))
    heights = np.where(terrain.known, terrain.heights, np.nan)[::step, ::step]
    return {
        "name": terrain.name,
        "columns": heights.shape[1],
        "rows": heights.shape[0],
        "origin": list(terrain.origin),
        "cell": [terrain.cell[0] * step, terrain.cell[1] * step],
        "extent": list(terrain.extent),
        "heights": [None if np.isnan(h) else round(float(h), 4) for h in heights.ravel()],
        "blocked": _any_in_blocks(terrain.obstacles, step).ravel().astype(int).tolist(),
        **({"report": whole_map(terrain)} if report else {}),
    }


def ground_of(name: str, vehicle: str | None, model: str | None) -> dict[str, Any]:
    """``report``: where a robot cannot go on a map and kinds of its ground, as HTML with a legend.

    Args:
        name: of the map.
        vehicle, model: as in a request; the vehicle is a model's own if there is one.
    """
    robot = PowerModel.load(Path(model)).vehicle if model else load_vehicle(vehicle or "")
    return {"report": ground_layer(open_map(name), robot)}


def _any_in_blocks(cells: Any, step: int) -> Any:
    """(⌈ny/step⌉, ⌈nx/step⌉) True where any cell of a step × step block is."""
    rows, columns = cells.shape
    padded = np.pad(cells, ((0, -rows % step), (0, -columns % step)))
    blocks = padded.reshape(padded.shape[0] // step, step, padded.shape[1] // step, step)
    return blocks.any(axis=(1, 3))
