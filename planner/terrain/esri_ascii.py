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
from planner.terrain.grid_checks import check_cells, check_heights, check_not_degrees
from planner.terrain.heightmap import Terrain

_KEYS = {
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
    "nodata_value",
}
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
    crs = _read_prj(file, (corner_x, corner_y), cell, (nx, ny))
    if crs is None:
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
        while True:
            line = stream.readline(256)
            words = line.split()
            key = words[0].decode("ascii", "replace").lower() if words else ""
            if words and key not in _KEYS:
                break
            if not line:
                break
            start = stream.tell()
            if not words:
                continue
            try:
                (number,) = words[1:]
                header[key] = float(number)
            except ValueError as problem:
                raise MapError(
                    "map",
                    f"{file.name} has a header line '{key}' without one number",
                    value=line.decode("ascii", "replace").strip(),
                    accepted=f"an ESRI ASCII header: {_HEADER}, each with one number",
                ) from problem
    if not header:
        raise MapError(
            "map",
            f"{file.name} does not begin with an ESRI ASCII header",
            value=str(file),
            accepted=f"the lines {_HEADER}",
        )
    return header, start


def _count(file: Path, header: dict[str, float], key: str) -> int:
    number = _required(file, header, key)
    if number != number // 1 or number < 1:
        raise MapError(
            "map",
            f"{file.name} has a bad {key}",
            value=number,
            accepted="a whole number, 1 or more",
        )
    return int(number)


def _required(file: Path, header: dict[str, float], *keys: str) -> float:
    for key in keys:
        if key in header:
            number = header[key]
            if not np.isfinite(number):
                raise MapError(
                    "map", f"{file.name} has a bad {key}", value=number, accepted="a finite number"
                )
            return number
    raise MapError(
        "map",
        f"{file.name} has no {' or '.join(keys)} in its header",
        value=str(file),
        accepted=f"the lines {_HEADER}",
    )


def _cell(file: Path, header: dict[str, float]) -> tuple[float, float]:
    if "dx" in header or "dy" in header:
        cell = _required(file, header, "dx"), _required(file, header, "dy")
    else:
        size = _required(file, header, "cellsize")
        cell = size, size
    if min(cell) <= 0:
        raise MapError(
            "map", f"{file.name} has a bad cellsize", value=cell, accepted="metres, above 0"
        )
    return cell


def _origin(file: Path, header: dict[str, float], axis: str, size: float) -> float:
    corner, centre = f"{axis}llcorner", f"{axis}llcenter"
    value = _required(file, header, corner, centre)
    return value + 0.5 * size if corner in header else value


def _read_heights(file: Path, start: int, nx: int, ny: int) -> NDArray[np.float64]:
    size = file.stat().st_size - start
    if size > _MOST_BYTES_A_CELL * nx * ny + 4096:
        raise _wrong_count(file, "many more", nx, ny)
    # Each number takes a digit and a blank; this refuses a lying header before any allocation.
    if size < 2 * nx * ny - 1:
        raise _wrong_count(file, "fewer", nx, ny)
    with file.open("rb") as stream:
        stream.seek(start)
        text = stream.read()
    with warnings.catch_warnings():
        # NumPy reports unreadable text by a DeprecationWarning and returns what came before it.
        warnings.simplefilter("error", DeprecationWarning)
        try:
            values = np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as problem:
            raise MapError(
                "map",
                f"{file.name} holds text that is not a number{_first_bad_word(text)}",
                value=str(file),
                accepted="heights as numbers with a point, parted by blanks",
            ) from problem
    if values.size != nx * ny:
        raise _wrong_count(file, f"{values.size:,}", nx, ny)
    return values.reshape(ny, nx)


def _first_bad_word(text: bytes) -> str:
    for word in text.split():
        try:
            float(word)
        except ValueError:
            return f" ('{word[:20].decode('ascii', 'replace')}')"
    return ""


def _wrong_count(file: Path, found: str, nx: int, ny: int) -> MapError:
    return MapError(
        "map",
        f"{file.name} holds {found} heights than its header says"
        if not found[0].isdigit()
        else f"{file.name} holds {found} heights, its header says {nx * ny:,}",
        value=str(file),
        accepted=f"nrows * ncols = {ny} * {nx} heights; the file may have been cut off",
    )


def _read_prj(
    file: Path, origin: tuple[float, float], cell: tuple[float, float], size: tuple[int, int]
) -> str | None:
    prj = file.with_suffix(".prj")
    if not prj.is_file():
        return None
    from planner.terrain.geotiff import checked_crs

    centre = origin[0] + 0.5 * size[0] * cell[0], origin[1] + 0.5 * size[1] * cell[1]
    return checked_crs(file, prj.read_text(encoding="utf-8", errors="replace"), centre)
