"""GeoTIFF through rasterio, with the format fixed to GTiff.

Read: one band of heights (a second one may be alpha), north-up or south-up, cells of any two
sizes, in a projected coordinate system in metres or in no coordinate system. Nodata, mask, scale
and offset are honoured. Heights in feet, said by the band's unit or by the vertical part of a
compound coordinate system, are converted to metres and `Terrain.source` says so.

Refused: degrees (with the gdalwarp command for the UTM zone of the map), horizontal feet, rotated
or mirrored grids, no georeference, several bands, more cells than allowed (before reading).

The driver is named because GDAL otherwise opens a VRT called .tif and follows it to other files.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from planner.terrain.grid_checks import (
    check_cells,
    check_heights,
    check_not_degrees,
    degrees_refused,
    refused,
    utm_code,
)
from planner.terrain.heightmap import Terrain

# International foot: exactly 0.3048 m. US survey foot: exactly 1200/3937 m.
_UNITS_BY_METRES = {
    1.0: {"", "m", "metre", "metres", "meter", "meters"},
    0.3048: {"ft", "foot", "feet", "international foot"},
    1200 / 3937: {"us survey foot", "us-ft", "ftus", "us survey feet"},
}


def read_geotiff(file: Path, *, max_cells: int) -> Terrain:
    """The terrain in a GeoTIFF.

    Args:
        file: the .tif file.
        max_cells: refuse larger rasters before reading them.

    Raises:
        MapError: see the module's head; also for a damaged or cut-off file.
    """
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    try:
        with warnings.catch_warnings():
            # A raster without georeference is refused below, in a sentence.
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(file, driver="GTiff", sharing=False) as dataset:
                return _read(file, dataset, max_cells)
    except RasterioError as problem:
        raise refused(
            file,
            "cannot be read as a GeoTIFF, it is damaged or cut off",
            "a complete GeoTIFF that gdalinfo reads",
        ) from problem


def _read(file: Path, dataset: Any, max_cells: int) -> Terrain:
    nx, ny = int(dataset.width), int(dataset.height)
    check_cells(file, nx, ny, max_cells)
    _check_bands(file, dataset)
    transform = dataset.transform
    _check_transform(file, dataset)
    dx, dy = float(transform.a), abs(float(transform.e))
    west, first_edge = float(transform.c), float(transform.f)
    north_up = transform.e < 0
    south = first_edge - ny * dy if north_up else first_edge
    centre = (west + 0.5 * nx * dx, south + 0.5 * ny * dy)
    if dataset.crs is None:
        crs = None
        check_not_degrees(file, (dx, dy), (west, south), nx, ny)
    else:
        crs = checked_crs(file, dataset.crs, centre)
    factor, unit = _vertical_unit(file, dataset)
    band = dataset.read(1, masked=True)
    heights = band.astype(np.float64).filled(np.nan)
    heights[~np.isfinite(heights)] = np.nan
    heights = (heights * float(dataset.scales[0]) + float(dataset.offsets[0])) * factor
    check_heights(file, heights, nodata_declared=dataset.nodata is not None)
    source = str(file)
    if factor != 1.0:
        source += f" (heights converted from {unit} to metres, times {factor:.9g})"
    return Terrain.from_arrays(
        heights[::-1] if north_up else heights,
        cell=(dx, dy),
        origin=(west + 0.5 * dx, south + 0.5 * dy),
        name=file.stem,
        crs=crs,
        source=source,
    )


def _check_bands(file: Path, dataset: Any) -> None:
    from rasterio.enums import ColorInterp

    has_alpha = dataset.count == 2 and dataset.colorinterp[1] == ColorInterp.alpha
    if dataset.count != 1 and not has_alpha:
        raise refused(
            file,
            f"has {dataset.count} bands; one must be the height",
            f"one band of heights, for example after: gdal_translate -b 1 {file.name} "
            f"{file.stem}_height.tif",
        )
    if dataset.dtypes[0].startswith("complex"):
        raise refused(
            file, "holds complex numbers", "heights as integers or floating-point numbers"
        )


def _check_transform(file: Path, dataset: Any) -> None:
    transform = dataset.transform
    if transform.is_identity or dataset.gcps[0]:
        raise refused(
            file,
            "does not say where its corners lie, so its cell size is unknown",
            "a georeferenced GeoTIFF, for example after: gdal_translate -a_ullr WEST "
            f"NORTH EAST SOUTH {file.name} {file.stem}_placed.tif (metres)",
        )
    if transform.b != 0 or transform.d != 0 or transform.a <= 0 or transform.e == 0:
        raise refused(
            file,
            "has a rotated or mirrored grid",
            "rows from west to east, for example after: "
            f"gdalwarp -r cubic {file.name} {file.stem}_north_up.tif",
        )


def checked_crs(file: Path, given: Any, centre: tuple[float, float]) -> str:
    """The coordinate system's short name, once it is known to be a plane one in metres.

    Args:
        file: the map's file, for the sentence.
        given: a rasterio CRS, or its text.
        centre: the map's centre in that coordinate system.

    Returns:
        "EPSG:32613", or the WKT where no authority knows it; of a compound system the horizontal
        part.

    Raises:
        MapError: the system is geographic, not in metres or not understood.
    """
    from rasterio.crs import CRS
    from rasterio.errors import CRSError
    from rasterio.warp import transform

    try:
        crs = given if isinstance(given, CRS) else CRS.from_user_input(given)
    except CRSError as problem:
        raise refused(
            file,
            "has a coordinate system that is not understood",
            "a projected coordinate system in metres",
            value=str(given),
        ) from problem
    if crs.is_geographic:
        name = crs.to_string() if crs.to_epsg() else "its coordinate system"
        raise degrees_refused(file, centre[0], centre[1], f"is in degrees ({name})")
    unit, factor = crs.linear_units_factor if crs.is_projected else (crs.linear_units, 1.0)
    if abs(float(factor) - 1.0) > 1e-9:
        longitude, latitude = transform(crs, CRS.from_epsg(4326), [centre[0]], [centre[1]])
        code = utm_code(longitude[0], latitude[0])
        raise refused(
            file,
            f"has x and y in {unit}, not in metres",
            "metres, for example after: "
            f"gdalwarp -t_srs EPSG:{code} -r cubic {file.name} {file.stem}_utm.tif",
            value=crs.to_string()[:60],
        )
    horizontal = CRS.from_wkt(_part_of_wkt(crs.to_wkt(), "PROJCS[") or crs.to_wkt())
    epsg = horizontal.to_epsg()
    return f"EPSG:{epsg}" if epsg else str(horizontal.to_wkt())


def _vertical_unit(file: Path, dataset: Any) -> tuple[float, str]:
    """Factor from the file's heights to metres, and their unit's name."""
    unit = str(dataset.units[0] or "").strip()
    if not unit and dataset.crs is not None:
        unit = _unit_of_vertical_crs(dataset.crs.to_wkt())
    plain = unit.lower().replace("_", " ")
    for metres, names in _UNITS_BY_METRES.items():
        if plain in names:
            return metres, unit
    raise refused(
        file, "has heights in an unknown unit", "metre, foot or US survey foot", value=unit
    )


def _unit_of_vertical_crs(wkt: str) -> str:
    """Name of the unit in the vertical part of a compound coordinate system's WKT 1, else ''."""
    vertical = _part_of_wkt(wkt, "VERT_CS[")
    return vertical.split('UNIT["')[1].split('"')[0] if 'UNIT["' in vertical else ""


def _part_of_wkt(wkt: str, opening: str) -> str:
    """The part of a WKT text that begins with `opening` and ends with its bracket, else ''."""
    start = wkt.find(opening)
    if start < 0:
        return ""
    depth = 0
    for position in range(start, len(wkt)):
        depth += {"[": 1, "]": -1}.get(wkt[position], 0)
        if depth == 0 and wkt[position] == "]":
            return wkt[start : position + 1]
    return ""
