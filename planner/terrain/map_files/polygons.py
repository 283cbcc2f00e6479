"""Polygons of a GeoJSON file, and the cells of a map whose centres lie in them.

    for polygon in read_polygons(Path("ground.geojson")):
        cells = polygon.cells(terrain)          # (ny, nx) bool

Coordinates are metres in the map's frame, [x, y] or [x, y, z]; holes are rings behind the first.
Left out: coordinates in degrees, lines and points.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.reading import finite_number
from planner.terrain.grid_checks import refused, require
from planner.terrain.heightmap import Terrain

MOST_BYTES = 20_000_000
"""Of a file that is held in memory."""
MOST_CORNERS = 200_000
"""Of all polygons of a file; each is tested against the cells around it."""
ACCEPTED = (
    'GeoJSON: {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, '
    '"geometry": {"type": "Polygon", "coordinates": [[[x, y], …]]}}, …]}, in metres of the map'
)


@dataclass(frozen=True, eq=False)
class Polygon:
    """One polygon of a file.

    Attributes:
        place: how to name it in a sentence, "polygon 3".
        rings: each (n, 2 or 3) m; the first is the outline, the others are holes.
        properties: as the file has them.
    """

    place: str
    rings: tuple[NDArray[np.float64], ...]
    properties: dict[str, Any]

    def cells(self, terrain: Terrain) -> NDArray[np.bool_]:
        """(ny, nx) cells whose centres lie inside."""
        return terrain.cells_in([ring[:, :2].tolist() for ring in self.rings])


def read_polygons(file: Path) -> list[Polygon]:
    """All polygons of a GeoJSON file.

    Raises:
        MapError: it is too large, not GeoJSON, or a corner is not two or three finite numbers.
    """
    require(
        file, file.stat().st_size <= MOST_BYTES, "is too large", f"at most {MOST_BYTES:,} bytes"
    )
    try:
        document = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as problem:
        raise refused(file, "is not JSON", ACCEPTED) from problem
    found: list[Polygon] = []
    corners = 0
    for number, feature in enumerate(_features(file, document), start=1):
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        geometry = geometry if isinstance(geometry, dict) else {}
        kind = geometry.get("type")
        require(file, kind in ("Polygon", "MultiPolygon"), f"has no polygon {number}", ACCEPTED)
        coordinates = geometry.get("coordinates")
        properties = feature.get("properties") or {}
        require(file, isinstance(properties, dict), f"has bad properties {number}", ACCEPTED)
        parts = [coordinates]
        if kind == "MultiPolygon" and isinstance(coordinates, list):
            parts = coordinates
        for part in parts:
            rings = _rings(file, part, f"polygon {number}")
            corners += sum(map(len, rings))
            require(file, corners <= MOST_CORNERS, "has too many corners", f"{MOST_CORNERS:,}")
            found.append(Polygon(f"polygon {number}", rings, properties))
    require(file, bool(found), "has no polygon", ACCEPTED)
    return found


def _features(file: Path, document: Any) -> list[Any]:
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection" and isinstance(document.get("features"), list):
        return list(document["features"])
    if kind == "Feature":
        return [document]
    raise refused(file, "is not GeoJSON", ACCEPTED)


def _rings(file: Path, part: Any, place: str) -> tuple[NDArray[np.float64], ...]:
    if not isinstance(part, list) or not part:
        raise refused(file, f"has no coordinates of {place}", ACCEPTED)
    rings = []
    for ring in part:
        good = isinstance(ring, list) and len(ring) >= 3
        require(file, good, f"has a ring of {place} without three corners", ACCEPTED)
        sizes = {len(corner) if isinstance(corner, list) else 0 for corner in ring}
        require(file, sizes in ({2}, {3}), f"has a corner of {place} that is no [x, y]", ACCEPTED)
        numbers = [[finite_number(value) for value in corner] for corner in ring]
        finite = all(value is not None for corner in numbers for value in corner)
        require(file, finite, f"has a corner of {place} that is no number", ACCEPTED)
        rings.append(np.array(numbers, np.float64))
    return tuple(rings)
