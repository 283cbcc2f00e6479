"""ESRI ASCII grids (.asc).

    ncols 403                  the keys in any case, in any order
    nrows 344
    xllcorner 0.0              or xllcenter: corner or centre of the south-west cell
    yllcorner 0.0              or yllcenter
    cellsize 30.0              or dx and dy, as GDAL writes them
    NODATA_value -9999         optional; -9999 when absent, as the format has it
    ...                        nrows * ncols numbers, the NORTH row first

A .prj file beside the grid gives the coordinate system; without one the frame is local and in
metres. Source: Esri, ArcGIS help, "Esri ASCII raster format". Left out: binary .flt grids.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner.terrain.geotiff import raster_terrain
from planner.terrain.grid_checks import check_cells, refused, require
from planner.terrain.heightmap import Terrain

_ORIGIN_KEYS = {"xllcorner", "xllcenter", "yllcorner", "yllcenter"}
_KEYS = {"ncols", "nrows", "cellsize", "dx", "dy", "nodata_value", *_ORIGIN_KEYS}
_DEFAULT_NODATA = -9999.0
"""The format's own value where a header names none."""
_HEADER = "ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, cellsize, NODATA_value"
# Longer than any printed float with its blank; a file beyond it is not the grid its header names.
_MOST_BYTES_A_CELL = 64


def read_esri_ascii(file: Path, *, max_cells: int) -> Terrain:
    """The terrain in an ESRI ASCII grid.

    Args:
        file: the .asc file.
        max_cells: refuse larger grids before reading them.

    Raises:
        MapError: the header is incomplete, the count of heights differs from it, or the grid is
            in degrees.
    """
    header, start = _read_header(file)
    nx, ny = _count(file, header, "ncols"), _count(file, header, "nrows")
    check_cells(file, nx, ny, max_cells)
    cell = _cell(file, header)
    heights = _read_heights(file, start, nx, ny)
    nodata = header.get("nodata_value", _DEFAULT_NODATA)
    heights[np.isclose(heights, nodata, rtol=1e-7, atol=0.0)] = np.nan
    prj = file.with_suffix(".prj")
    return raster_terrain(
        file,
        heights[::-1],
        cell=cell,
        origin=(_origin(file, header, "x", cell[0]), _origin(file, header, "y", cell[1])),
        crs=prj.read_text(encoding="utf-8", errors="replace") if prj.is_file() else None,
        nodata_declared=True,
    )


def _read_header(file: Path) -> tuple[dict[str, float], int]:
    header: dict[str, float] = {}
    start = 0
    with file.open("rb") as stream:
        while line := stream.readline(256):
            key, *numbers = line.decode("ascii", "replace").lower().split() or [""]
            if key and key not in _KEYS:
                break
            start = stream.tell()
            if not key:
                continue
            try:
                (number,) = numbers
                header[key] = float(number)
            except ValueError as problem:
                raise refused(
                    file,
                    f"has a header line '{key}' without one number",
                    f"an ESRI ASCII header: {_HEADER}, each with one number such as 0.5",
                    value=line.decode("ascii", "replace").strip(),
                ) from problem
    require(file, bool(header), "does not begin with an ESRI ASCII header", f"the lines {_HEADER}")
    return header, start


def _count(file: Path, header: dict[str, float], key: str) -> int:
    number = _required(file, header, key)
    whole = number == number // 1 and number >= 1
    require(file, whole, f"has a bad {key}", "a whole number, 1 or more", value=number)
    return int(number)


def _required(file: Path, header: dict[str, float], *keys: str) -> float:
    key = next((key for key in keys if key in header), "")
    require(file, bool(key), f"has no {' or '.join(keys)} in its header", f"the lines {_HEADER}")
    number = header[key]
    require(file, math.isfinite(number), f"has a bad {key}", "a finite number", value=number)
    return number


def _cell(file: Path, header: dict[str, float]) -> tuple[float, float]:
    if "dx" in header or "dy" in header:
        cell = _required(file, header, "dx"), _required(file, header, "dy")
    else:
        size = _required(file, header, "cellsize")
        cell = size, size
    require(file, min(cell) > 0, "has a bad cellsize", "metres, above 0", value=cell)
    return cell


def _origin(file: Path, header: dict[str, float], axis: str, size: float) -> float:
    corner, centre = f"{axis}llcorner", f"{axis}llcenter"
    value = _required(file, header, corner, centre)
    return value + 0.5 * size if corner in header else value


def _read_heights(file: Path, start: int, nx: int, ny: int) -> NDArray[np.float64]:
    size = file.stat().st_size - start
    accepted = f"nrows * ncols = {ny} * {nx} heights; the file may have been cut off"
    most = _MOST_BYTES_A_CELL * nx * ny + 4096
    require(file, size <= most, "holds many more heights than its header says", accepted)
    # Each number takes a digit and a blank; this refuses a lying header before any allocation.
    require(file, size >= 2 * nx * ny - 1, "holds fewer heights than its header says", accepted)
    with file.open("rb") as stream:
        stream.seek(start)
        text = stream.read()
    with warnings.catch_warnings():
        # NumPy reports unreadable text by a DeprecationWarning and returns what came before it.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            values = np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as problem:
            raise refused(
                file,
                f"holds text that is not a number{_first_bad_word(text)}",
                "heights as numbers with a point, parted by blanks",
            ) from problem
    counts = f"holds {values.size:,} heights, its header says {nx * ny:,}"
    require(file, values.size == nx * ny, counts, accepted)
    return values.reshape(ny, nx)


def _first_bad_word(text: bytes) -> str:
    for word in text.split():
        try:
            float(word)
        except ValueError:
            return f" ('{word[:20].decode('ascii', 'replace')}')"
    return ""
