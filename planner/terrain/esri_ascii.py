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

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner.errors import MapError
from planner.terrain.geotiff import checked_crs
from planner.terrain.grid_checks import check_cells, check_heights, check_not_degrees, refused
from planner.terrain.heightmap import Terrain

_ORIGIN_KEYS = {"xllcorner", "xllcenter", "yllcorner", "yllcenter"}
_KEYS = {"ncols", "nrows", "cellsize", "dx", "dy", "nodata_value", *_ORIGIN_KEYS}
_DEFAULT_NODATA = -9999.0
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
    corner_x = _origin(file, header, "x", cell[0])
    corner_y = _origin(file, header, "y", cell[1])
    prj, crs = file.with_suffix(".prj"), None
    if prj.is_file():
        centre = corner_x + 0.5 * nx * cell[0], corner_y + 0.5 * ny * cell[1]
        crs = checked_crs(file, prj.read_text(encoding="utf-8", errors="replace"), centre)
    else:
        check_not_degrees(file, cell, (corner_x, corner_y), nx, ny)
    heights = _read_heights(file, start, nx, ny)
    nodata = header.get("nodata_value", _DEFAULT_NODATA)
    heights[~np.isfinite(heights) | np.isclose(heights, nodata, rtol=1e-7, atol=0.0)] = np.nan
    check_heights(file, heights, nodata_declared=True)
    return Terrain.from_arrays(
        heights[::-1],
        cell=cell,
        origin=(corner_x, corner_y),
        name=file.stem,
        crs=crs,
        source=str(file),
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
                    f"an ESRI ASCII header: {_HEADER}, each with one number",
                    value=line.decode("ascii", "replace").strip(),
                ) from problem
    if not header:
        raise refused(file, "does not begin with an ESRI ASCII header", f"the lines {_HEADER}")
    return header, start


def _count(file: Path, header: dict[str, float], key: str) -> int:
    number = _required(file, header, key)
    if number != number // 1 or number < 1:
        raise refused(file, f"has a bad {key}", "a whole number, 1 or more", value=number)
    return int(number)


def _required(file: Path, header: dict[str, float], *keys: str) -> float:
    for key in keys:
        if key in header:
            number = header[key]
            if not np.isfinite(number):
                raise refused(file, f"has a bad {key}", "a finite number", value=number)
            return number
    raise refused(file, f"has no {' or '.join(keys)} in its header", f"the lines {_HEADER}")


def _cell(file: Path, header: dict[str, float]) -> tuple[float, float]:
    if "dx" in header or "dy" in header:
        cell = _required(file, header, "dx"), _required(file, header, "dy")
    else:
        size = _required(file, header, "cellsize")
        cell = size, size
    if min(cell) <= 0:
        raise refused(file, "has a bad cellsize", "metres, above 0", value=cell)
    return cell


def _origin(file: Path, header: dict[str, float], axis: str, size: float) -> float:
    corner, centre = f"{axis}llcorner", f"{axis}llcenter"
    value = _required(file, header, corner, centre)
    return value + 0.5 * size if corner in header else value


def _read_heights(file: Path, start: int, nx: int, ny: int) -> NDArray[np.float64]:
    size = file.stat().st_size - start
    if size > _MOST_BYTES_A_CELL * nx * ny + 4096:
        raise _wrong_count(file, "many more heights than its header says", nx, ny)
    # Each number takes a digit and a blank; this refuses a lying header before any allocation.
    if size < 2 * nx * ny - 1:
        raise _wrong_count(file, "fewer heights than its header says", nx, ny)
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
    if values.size != nx * ny:
        counts = f"{values.size:,} heights, its header says {nx * ny:,}"
        raise _wrong_count(file, counts, nx, ny)
    return values.reshape(ny, nx)


def _first_bad_word(text: bytes) -> str:
    for word in text.split():
        try:
            float(word)
        except ValueError:
            return f" ('{word[:20].decode('ascii', 'replace')}')"
    return ""


def _wrong_count(file: Path, holds: str, nx: int, ny: int) -> MapError:
    count = f"nrows * ncols = {ny} * {nx} heights; the file may have been cut off"
    return refused(file, f"holds {holds}", count)
