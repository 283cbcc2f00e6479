"""GeoTIFF through rasterio, with the format fixed to GTiff; the place on Earth of any grid.

Read: one band of heights (a second one may be alpha), north-up or south-up, cells of any two
sizes, in a projected coordinate system in metres or in no coordinate system. Nodata, mask, scale
and offset are honoured. Heights in feet, said by the band's unit or by the vertical part of a
compound coordinate system, are converted to metres and `Terrain.source` says so.

Refused: degrees (with the gdalwarp command for the UTM zone of the map), horizontal feet, systems
whose metre is not one on the ground there (Web Mercator), rotated or mirrored grids, no
georeference, several bands, more cells than allowed (before reading).

The driver is named because GDAL otherwise opens a VRT called .tif and follows it to other files.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import MapError
from planner.terrain.grid_checks import check_cells, refused, require
from planner.terrain.heightmap import Terrain

# A cell below this many metres is not a survey but a grid in degrees: 5 mm against 18" = 0.005.
SMALLEST_PLAUSIBLE_CELL = 0.005
# Ground on Earth lies between the Challenger Deep, -10,935 m, and Everest, 8,849 m.
LOWEST_GROUND, HIGHEST_GROUND = -12_000.0, 10_000.0
MOST_STRETCH = 0.03
"""Share by which a metre of a coordinate system may differ from one on the ground: slopes are wrong
by as much. UTM stays below 0.001, national systems below 0.01, continental ones mostly below 0.03;
Web Mercator is at 0.5 in central Europe."""
STRETCH_LENGTH = 1000.0
"""m of the map over which it is measured."""
# WGS 84 (NIMA TR8350.2): semi-major axis, m, and first eccentricity squared.
_SEMI_MAJOR_AXIS = 6_378_137.0
_ECCENTRICITY_SQUARED = 6.694_379_990_14e-3  # no unit
USUAL_NODATA = (-9999.0, -32768.0, -32767.0)
"""Heights that stand for none in many files which do not say so."""
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
    _check_grid(file, dataset)
    transform = dataset.transform
    dx, dy = float(transform.a), abs(float(transform.e))
    north_up = transform.e < 0
    south = float(transform.f) - ny * dy if north_up else float(transform.f)
    factor, unit = _vertical_unit(file, dataset)
    heights = dataset.read(1, masked=True).astype(np.float64).filled(np.nan)
    heights = (heights * float(dataset.scales[0]) + float(dataset.offsets[0])) * factor
    converted = f" (heights converted from {unit} to metres, times {factor:.9g})"
    return raster_terrain(
        file,
        heights[::-1] if north_up else heights,
        cell=(dx, dy),
        origin=(float(transform.c) + 0.5 * dx, south + 0.5 * dy),
        crs=dataset.crs,
        nodata_declared=dataset.nodata is not None,
        note="" if factor == 1.0 else converted,
    )


def _check_grid(file: Path, dataset: Any) -> None:
    """Refuse bands and grids that do not give one height a cell, west to east."""
    from rasterio.enums import ColorInterp

    has_alpha = dataset.count == 2 and dataset.colorinterp[1] == ColorInterp.alpha
    require(
        file,
        dataset.count == 1 or has_alpha,
        f"has {dataset.count} bands; one must be the height",
        f"one band of heights, for example after: gdal_translate -b 1 {file.name} "
        f"{file.stem}_height.tif",
    )
    real = not dataset.dtypes[0].startswith("complex")
    numbers = "heights as integers or floating-point numbers"
    require(file, real, "holds complex numbers", numbers)
    transform = dataset.transform
    require(
        file,
        not transform.is_identity and not dataset.gcps[0],
        "does not say where its corners lie, so its cell size is unknown",
        "a georeferenced GeoTIFF, for example after: gdal_translate -a_ullr WEST "
        f"NORTH EAST SOUTH {file.name} {file.stem}_placed.tif (metres)",
    )
    require(
        file,
        transform.b == 0 == transform.d and transform.a > 0 and transform.e != 0,
        "has a rotated or mirrored grid",
        "rows from west to east, for example after: "
        f"gdalwarp -r cubic {file.name} {file.stem}_north_up.tif",
    )


def _vertical_unit(file: Path, dataset: Any) -> tuple[float, str]:
    """Factor from the file's heights to metres, and their unit's name."""
    unit = str(dataset.units[0] or "").strip()
    if not unit and dataset.crs is not None:
        for part in _crs_parts(dataset.crs)[1:]:
            given = part.get("source_crs", part)["coordinate_system"]["axis"][0]["unit"]
            unit = given if isinstance(given, str) else given["name"]
    plain = unit.lower().replace("_", " ")
    for metres, names in _UNITS_BY_METRES.items():
        if plain in names:
            return metres, unit
    accepted = "metre, foot or US survey foot"
    raise refused(file, "has heights in an unknown unit", accepted, value=unit)


# What readers of other formats need too.


def raster_terrain(
    file: Path,
    heights: NDArray[Any],
    *,
    cell: tuple[float, float],
    origin: tuple[float, float],
    crs: Any = None,
    nodata_declared: bool = False,
    note: str = "",
    **layers: Any,
) -> Terrain:
    """The terrain of a grid that a file holds.

    Args:
        file: gives the terrain its name.
        heights: (ny, nx) m, the south row first; what is not finite is unknown.
        cell: dx, dy, m.
        origin: x, y of node [0, 0], m.
        crs: a rasterio CRS, or its text; None where the file names none.
        nodata_declared: whether the file names a nodata value.
        note: what was converted, for ``Terrain.source``.
        layers: further arguments of ``Terrain.from_arrays``.

    Raises:
        MapError: the grid is in degrees or not in metres, a height can only be an undeclared
            nodata value, or what ``Terrain.from_arrays`` raises.
    """
    ny, nx = heights.shape
    centre = origin[0] + 0.5 * (nx - 1) * cell[0], origin[1] + 0.5 * (ny - 1) * cell[1]
    if crs is not None:
        crs = checked_crs(file, crs, centre)
    elif 0 < min(cell) < SMALLEST_PLAUSIBLE_CELL:
        why = f"has cells of {cell[0]:g} by {cell[1]:g}: that is degrees"
        raise _degrees_refused(file, centre, why, undeclared=True)
    metres = np.asarray(heights, np.float64)
    _check_heights(file, metres, nodata_declared=nodata_declared)
    source = f"{file}{note}"
    return Terrain.from_arrays(
        metres, cell=cell, origin=origin, name=file.stem, crs=crs, source=source, **layers
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
        MapError: the system is geographic, not in metres, stretched or not understood.
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
        raise _degrees_refused(file, centre, f"is in degrees ({name})")
    unit, factor = crs.linear_units_factor if crs.is_projected else (crs.linear_units, 1.0)
    if abs(float(factor) - 1.0) > 1e-9:
        (longitude,), (latitude,) = transform(crs, CRS.from_epsg(4326), *([x] for x in centre))
        raise refused(
            file,
            f"has x and y in {unit}, not in metres",
            _reprojected(file, longitude, latitude),
            value=crs.to_string()[:60],
        )
    if crs.is_projected:
        _check_stretch(file, crs, centre)
    parts = _crs_parts(crs)
    horizontal = CRS.from_dict(parts[0]) if len(parts) > 1 else crs
    epsg = horizontal.to_epsg()
    return f"EPSG:{epsg}" if epsg else str(horizontal.to_wkt())


def _check_stretch(file: Path, crs: Any, centre: tuple[float, float]) -> None:
    """Refuse a coordinate system in which lengths about the map's centre are not those on Earth."""
    from rasterio.crs import CRS
    from rasterio.warp import transform

    (x, y), half = centre, 0.5 * STRETCH_LENGTH
    places = [x, x - half, x + half, x, x], [y, y, y, y - half, y + half]
    longitudes, latitudes = map(np.array, transform(crs, CRS.from_epsg(4326), *places))
    east, north = local_scale(float(latitudes[0]), 1.0)
    apart = np.hypot(east * np.diff(longitudes), north * np.diff(latitudes))[[1, 3]]
    metres = apart / STRETCH_LENGTH
    # Far outside the area of a system there may be no longitude at all.
    if np.isfinite(metres).all() and np.abs(metres - 1.0).max() > MOST_STRETCH:
        worst = float(metres[np.abs(metres - 1.0).argmax()])
        raise refused(
            file,
            f"has a coordinate system whose metre is {worst:.2f} m on the ground there, so slopes "
            "would be wrong",
            _reprojected(file, float(longitudes[0]), float(latitudes[0])),
            value=crs.to_string()[:60],
        )


def local_scale(latitude: float, spacing: float) -> tuple[float, float]:
    """Metres east and north that a small angle spans on the WGS 84 ellipsoid.

    Args:
        latitude: where, degrees north.
        spacing: the angle in longitude and latitude, degrees.

    Returns:
        dx, dy in m.
    """
    phi, angle = math.radians(latitude), math.radians(spacing)
    root = 1.0 - _ECCENTRICITY_SQUARED * math.sin(phi) ** 2
    across = _SEMI_MAJOR_AXIS / math.sqrt(root)
    along = _SEMI_MAJOR_AXIS * (1.0 - _ECCENTRICITY_SQUARED) / root**1.5
    return across * math.cos(phi) * angle, along * angle


def _crs_parts(crs: Any) -> list[dict[str, Any]]:
    """The horizontal part of a rasterio CRS, and of a compound one the vertical, as PROJJSON."""
    whole: dict[str, Any] = crs.to_dict(projjson=True)
    return list(whole.get("components", [whole]))


def _degrees_refused(
    file: Path, centre: tuple[float, float], why: str, *, undeclared: bool = False
) -> MapError:
    """The error for a grid in degrees, with the command that reprojects it.

    Args:
        file: the map's file.
        centre: the map's longitude and latitude, degrees.
        why: how it is known, "is in degrees (EPSG:4326)".
        undeclared: the file names no coordinate system, so the command has to.
    """
    return refused(
        file,
        f"{why}; a degree of longitude is not a degree of latitude, so slopes would be wrong",
        _reprojected(file, *centre, given="-s_srs EPSG:4326 " if undeclared else ""),
    )


def _reprojected(file: Path, longitude: float, latitude: float, given: str = "") -> str:
    """The command that brings a map to metres, in the UTM zone (WGS 84) of a point in degrees."""
    zone = min(60, max(1, math.floor((longitude + 180.0) / 6.0) + 1))
    code = (32600 if latitude >= 0 else 32700) + zone
    command = f"gdalwarp {given}-t_srs EPSG:{code} -r cubic {file.name} {file.stem}_utm.tif"
    return f"metres, for example after: {command}"


def _check_heights(file: Path, heights: NDArray[np.float64], *, nodata_declared: bool) -> None:
    """Refuse heights, (ny, nx) m, in another unit, or that can only be an undeclared nodata value.

    Raises:
        MapError: a height beyond any ground on Earth, or a usual nodata value undeclared.
    """
    known = np.isfinite(heights)
    if not known.any():
        return  # Terrain.from_arrays says that nothing is known.
    lowest = float(heights.min(where=known, initial=np.inf))
    highest = float(heights.max(where=known, initial=-np.inf))
    undeclared = not nodata_declared and lowest in USUAL_NODATA
    suspect = highest if lowest >= LOWEST_GROUND and highest > HIGHEST_GROUND else lowest
    beyond = known & ((heights < LOWEST_GROUND) | (heights > HIGHEST_GROUND))
    require(
        file,
        # A nodata value is one value.
        bool(np.all(heights[beyond] == suspect)),
        f"holds heights from {lowest:g} to {highest:g} m, which no ground on Earth has",
        f"heights from {LOWEST_GROUND:g} to {HIGHEST_GROUND:g} m; other units, such as mm, "
        "converted to m",
    )
    require(
        file,
        lowest >= LOWEST_GROUND and highest <= HIGHEST_GROUND and not undeclared,
        f"holds heights of {suspect:g} m, a nodata value that it does not declare",
        f"heights from {LOWEST_GROUND:g} to {HIGHEST_GROUND:g} m and the nodata value "
        f"declared, for a GeoTIFF: gdal_edit.py -a_nodata {suspect:.9g} {file.name}",
    )
