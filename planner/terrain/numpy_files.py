"""NumPy arrays: .npz with everything in it, or .npy with a .toml beside it.

NAME.npz holds, row 0 the SOUTH row:

    heights         (ny, nx) m, NaN where unknown                               required
    cell            dx, dy in m (one number when they are equal)                required
    origin          x, y of the south-west cell's centre, m                     default 0, 0
    known           (ny, nx) bool, False = hole
    obstacles       (ny, nx) bool
    ground          (ny, nx) integers, index of a ground class
    ground_classes  (n,) names
    ground_factors  (n, 2) rolling and traction factor of each class            default 1, 1
    crs             text, "EPSG:32613"

or, as digital elevation models are often saved, `elevation` with `dx` and `dy` in m and row 0 the
NORTH row, as in a picture. NAME.npy holds the heights alone; NAME.toml beside it says

    cell = [0.5, 0.5]
    origin = [0.0, 0.0]             # may be left out
    first_row = "south"             # or "north"; may be left out

Headers are read and checked before any array is allocated, and pickled objects are never loaded.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from planner.terrain.geotiff import checked_crs
from planner.terrain.grid_checks import check_cells, check_heights, check_not_degrees, refused
from planner.terrain.heightmap import Terrain
from planner.terrain.layers import read_toml
from planner.terrain.surface import PLAIN_GROUND, GroundClass

_LAYERS = ("known", "obstacles", "ground")
_SMALL = ("cell", "origin", "dx", "dy", "ground_classes", "ground_factors", "crs")
# The small members are numbers and names; nothing honest needs more than this.
_MOST_SMALL_BYTES = 100_000


def read_npy(file: Path, *, max_cells: int) -> Terrain:
    """The terrain in NAME.npy, with its cell size from NAME.toml.

    Raises:
        MapError: the header lies, the array is not a grid of numbers, or the .toml is missing.
    """
    with file.open("rb") as stream:
        heights = _read_array(file, stream, "heights", file.stat().st_size, max_cells)
    sidecar = file.with_suffix(".toml")
    example = f"{sidecar.name} beside it with: cell = [0.5, 0.5]  (dx, dy in metres)"
    if not sidecar.is_file():
        raise refused(file, "does not say how large its cells are", example)
    content = read_toml(sidecar)
    unknown = set(content) - {"cell", "origin", "first_row"}
    if unknown:
        raise refused(
            sidecar, f"has the unknown entry '{min(unknown)}'", "cell, origin and first_row"
        )
    if "cell" not in content:
        raise refused(sidecar, "has no 'cell'", "cell = [0.5, 0.5]  (dx, dy in metres)")
    first_row = content.get("first_row", "south")
    if first_row not in ("south", "north"):
        raise refused(sidecar, "has a first_row that is no side", '"south" or "north"')
    return _terrain(
        file,
        heights[::-1] if first_row == "north" else heights,
        cell=_pair(sidecar, "cell", content["cell"]),
        origin=_pair(sidecar, "origin", content.get("origin", (0.0, 0.0))),
    )


def read_npz(file: Path, *, max_cells: int) -> Terrain:
    """The terrain in NAME.npz.

    Raises:
        MapError: an array is missing, does not fit, lies about its size or is not numbers.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            arrays = _read_members(file, archive, max_cells)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as problem:
        raise refused(
            file, "is damaged, cut off or locked", "an archive written by numpy.savez"
        ) from problem
    if "heights" in arrays:
        north_first, heights = False, arrays["heights"]
        if "cell" not in arrays:
            raise refused(file, "has no array 'cell'", "cell = dx, dy in metres")
        cell = _pair(file, "cell", arrays["cell"])
    else:
        north_first, heights = True, arrays["elevation"]
        if "dx" not in arrays or "dy" not in arrays:
            raise refused(file, "has no 'dx' and 'dy'", "dx and dy in metres beside 'elevation'")
        cell = _pair(file, "dx, dy", (arrays["dx"], arrays["dy"]))
    order = slice(None, None, -1) if north_first else slice(None)
    layers = {name: arrays[name][order] for name in _LAYERS if name in arrays}
    return _terrain(
        file,
        heights[order],
        cell=cell,
        origin=_pair(file, "origin", arrays.get("origin", (0.0, 0.0))),
        ground_classes=_ground_classes(file, arrays),
        crs=str(arrays["crs"]) if "crs" in arrays else None,
        **layers,
    )


def _terrain(
    file: Path,
    heights: NDArray[Any],
    *,
    cell: tuple[float, float],
    origin: tuple[float, float],
    ground_classes: tuple[GroundClass, ...] = PLAIN_GROUND,
    crs: str | None = None,
    **layers: NDArray[Any],
) -> Terrain:
    ny, nx = heights.shape
    if crs is None:
        check_not_degrees(file, cell, origin, nx, ny)
    else:
        centre = origin[0] + 0.5 * nx * cell[0], origin[1] + 0.5 * ny * cell[1]
        crs = checked_crs(file, crs, centre)
    metres = heights.astype(np.float64)
    metres[~np.isfinite(metres)] = np.nan
    check_heights(file, metres, nodata_declared=False)
    return Terrain.from_arrays(
        metres,
        cell=cell,
        origin=origin,
        name=file.stem,
        ground_classes=ground_classes,
        crs=crs,
        source=str(file),
        **layers,
    )


def _read_members(file: Path, archive: zipfile.ZipFile, max_cells: int) -> dict[str, NDArray[Any]]:
    infos = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    if "heights" not in infos and "elevation" not in infos:
        raise refused(
            file,
            "holds no array 'heights' or 'elevation'",
            "heights (m, south row first) with cell = dx, dy, "
            "or elevation (m, north row first) with dx, dy",
        )
    wanted = [name for name in ("heights", "elevation", *_LAYERS, *_SMALL) if name in infos]
    arrays: dict[str, NDArray[Any]] = {}
    for name in wanted:
        info = infos[name]
        if name in _SMALL and info.file_size > _MOST_SMALL_BYTES:
            raise refused(file, f"has an array '{name}' of {info.file_size:,} bytes", "a short one")
        with archive.open(info) as stream:
            arrays[name] = _read_array(file, stream, name, info.file_size, max_cells)
    return arrays


def _read_array(
    file: Path, stream: BinaryIO | Any, name: str, size: int, max_cells: int
) -> NDArray[Any]:
    """One array of a stream whose length is known, its header checked before it is believed."""
    try:
        version = npy_format.read_magic(stream)
        read_header = {
            (1, 0): npy_format.read_array_header_1_0,
            (2, 0): npy_format.read_array_header_2_0,
        }[version]
        shape, fortran_order, dtype = read_header(stream)
        body = size - stream.tell()
    except (ValueError, KeyError, EOFError, SyntaxError, TypeError) as problem:
        raise refused(
            file, f"has a damaged header of its array '{name}'", "an array written by numpy.save"
        ) from problem
    _check_header(file, name, shape, dtype, max_cells)
    count = math.prod(shape)
    if count * dtype.itemsize != body:
        raise refused(
            file,
            f"says that '{name}' takes {count * dtype.itemsize:,} bytes but holds {body:,}",
            "an array as long as its header says; the file may have been cut off",
        )
    data = stream.read(body)
    if len(data) != body:
        raise refused(file, f"ends within its array '{name}'", "a complete file")
    array = np.frombuffer(data, dtype=dtype, count=count)
    return array.reshape(shape, order="F" if fortran_order else "C")


def _check_header(
    file: Path, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], max_cells: int
) -> None:
    if dtype.hasobject:
        raise refused(
            file,
            f"holds Python objects in '{name}', which could run code when loaded",
            "numbers or text",
        )
    if name not in _SMALL:
        if len(shape) != 2:
            raise refused(file, f"has an array '{name}' of shape {shape}", "two dimensions")
        check_cells(file, shape[1], shape[0], max_cells)
    is_text = name in ("ground_classes", "crs")
    if dtype.kind not in ("U" if is_text else "fiub"):
        raise refused(
            file,
            f"has an array '{name}' of type {dtype}",
            "text" if is_text else "integers, booleans or floating-point numbers",
        )


def _pair(file: Path, name: str, value: Any) -> tuple[float, float]:
    try:
        numbers = np.asarray(value, dtype=np.float64).ravel()
    except (ValueError, TypeError, OverflowError):
        numbers = np.empty(0)
    if numbers.size == 1 and name == "cell":
        numbers = np.repeat(numbers, 2)
    if numbers.size != 2 or not np.isfinite(numbers).all():
        raise refused(file, f"has a bad '{name}'", "two finite numbers in metres")
    if name != "origin" and numbers.min() <= 0:
        raise refused(file, f"has a bad '{name}'", "two lengths above 0 in metres")
    return float(numbers[0]), float(numbers[1])


def _ground_classes(file: Path, arrays: dict[str, NDArray[Any]]) -> tuple[GroundClass, ...]:
    if "ground_classes" not in arrays:
        return PLAIN_GROUND
    names = [str(name) for name in arrays["ground_classes"].ravel()]
    factors = arrays.get("ground_factors", np.ones((len(names), 2)))
    if factors.shape != (len(names), 2):
        raise refused(
            file,
            f"has 'ground_factors' of shape {factors.shape}",
            f"({len(names)}, 2): rolling and traction of each ground class",
        )
    return tuple(
        GroundClass(name, rolling=float(rolling), traction=float(traction))
        for name, (rolling, traction) in zip(names, factors, strict=True)
    )
