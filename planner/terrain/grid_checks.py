"""Checks that every raster format shares: number of cells, degrees, undeclared nodata.

The sentences name the file, what is wrong and the command or entry that mends it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import MapError

# A cell below this many metres is not a survey but a grid in degrees: 5 mm against 18" = 0.005.
SMALLEST_PLAUSIBLE_CELL = 0.005
# Ground on Earth lies between the Challenger Deep, -10,935 m, and Everest, 8,849 m.
LOWEST_GROUND, HIGHEST_GROUND = -12_000.0, 10_000.0
USUAL_NODATA = (-9999.0, -32768.0, -32767.0)


def refused(which: Path | str, problem: str, accepted: str, value: Any = None) -> MapError:
    """The error for a map that cannot be used.

    Args:
        which: its file, or the name of arrays.
        problem: what is wrong, to follow that name.
        accepted: what would be accepted instead.
        value: as given; of a file its path by default.
    """
    if isinstance(which, Path):
        which, value = which.name, str(which) if value is None else value
    return MapError("map", f"{which} {problem}", value=value, accepted=accepted)


def check_cells(file: Path, nx: int, ny: int, max_cells: int) -> None:
    """Refuse a header that claims more cells than allowed, or none.

    Raises:
        MapError: nx * ny is above max_cells, or a side is below 1.
    """
    if nx < 1 or ny < 1:
        raise refused(
            file, f"says that it has {nx} columns and {ny} rows", "at least 4 columns and 4 rows"
        )
    if nx * ny > max_cells:
        raise refused(
            file,
            f"says that it has {nx} by {ny} = {nx * ny:,} cells",
            f"at most {max_cells:,} cells; cut it (gdal_translate -srcwin) "
            "or make the cells larger (gdalwarp -tr)",
        )


def utm_code(longitude: float, latitude: float) -> int:
    """EPSG code of the UTM zone (WGS 84) that holds a point in degrees."""
    zone = min(60, max(1, math.floor((longitude + 180.0) / 6.0) + 1))
    return (32600 if latitude >= 0 else 32700) + zone


def degrees_refused(
    file: Path, longitude: float, latitude: float, why: str, *, undeclared: bool = False
) -> MapError:
    """The error for a grid in degrees, with the command that reprojects it.

    Args:
        file: the map's file.
        longitude, latitude: the map's centre, degrees.
        why: how it is known, "is in degrees (EPSG:4326)".
        undeclared: the file names no coordinate system, so the command has to.
    """
    code = utm_code(longitude, latitude)
    given = "-s_srs EPSG:4326 " if undeclared else ""
    return refused(
        file,
        f"{why}; a degree of longitude is not a degree of latitude, so slopes would be wrong",
        "metres, for example after: "
        f"gdalwarp {given}-t_srs EPSG:{code} -r cubic {file.name} {file.stem}_utm.tif",
    )


def check_not_degrees(
    file: Path, cell: tuple[float, float], origin: tuple[float, float], nx: int, ny: int
) -> None:
    """Refuse a grid without a coordinate system whose numbers can only be degrees.

    Raises:
        MapError: a cell is below 5 mm.
    """
    if 0 < min(cell) < SMALLEST_PLAUSIBLE_CELL:
        longitude = origin[0] + 0.5 * nx * cell[0]
        latitude = origin[1] + 0.5 * ny * cell[1]
        why = f"has cells of {cell[0]:g} by {cell[1]:g}: that is degrees"
        raise degrees_refused(file, longitude, latitude, why, undeclared=True)


def check_heights(file: Path, heights: NDArray[np.float64], *, nodata_declared: bool) -> None:
    """Refuse heights that can only be an undeclared nodata value.

    Args:
        file: the map's file.
        heights: (ny, nx) m, NaN where nodata.
        nodata_declared: whether the file names a nodata value.

    Raises:
        MapError: a height beyond any ground on Earth, or a usual nodata value undeclared.
    """
    if not np.isfinite(heights).any():
        return  # Terrain.from_arrays says that nothing is known.
    lowest, highest = float(np.nanmin(heights)), float(np.nanmax(heights))
    undeclared = not nodata_declared and lowest in USUAL_NODATA
    if lowest < LOWEST_GROUND or highest > HIGHEST_GROUND or undeclared:
        suspect = highest if lowest >= LOWEST_GROUND and highest > HIGHEST_GROUND else lowest
        raise refused(
            file,
            f"holds heights of {suspect:g} m, a nodata value that it does not declare",
            f"heights from {LOWEST_GROUND:g} to {HIGHEST_GROUND:g} m and the nodata value "
            f"declared, for a GeoTIFF: gdal_edit.py -a_nodata {suspect:.9g} {file.name}",
        )
