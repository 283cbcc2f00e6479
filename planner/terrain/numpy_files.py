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

from planner.terrain.geotiff import raster_terrain
from planner.terrain.grid_checks import check_cells, check_entries, refused, require
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
    require(file, sidecar.is_file(), "does not say how large its cells are", example)
    content = read_toml(sidecar)
    accepted = "cell = [0.5, 0.5]  (dx, dy in metres), and perhaps origin and first_row"
    known = ("cell", "origin", "first_row")
    check_entries(sidecar, content, accepted, known=known, required=["cell"])
    first_row = content.get("first_row", "south")
    sides = first_row in ("south", "north")
    require(sidecar, sides, "has a first_row that is no side", '"south" or "north"')
    return raster_terrain(
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
        order, heights = slice(None), arrays["heights"]
        require(file, "cell" in arrays, "has no array 'cell'", "cell = dx, dy in metres")
        cell = _pair(file, "cell", arrays["cell"])
    else:
        order, heights = slice(None, None, -1), arrays["elevation"]
        both = {"dx", "dy"} <= set(arrays)
        require(file, both, "has no 'dx' and 'dy'", "dx and dy in metres beside 'elevation'")
        cell = _pair(file, "dx, dy", (arrays["dx"], arrays["dy"]))
    layers: dict[str, Any] = {name: arrays[name][order] for name in _LAYERS if name in arrays}
    return raster_terrain(
        file,
        heights[order],
        cell=cell,
        origin=_pair(file, "origin", arrays.get("origin", (0.0, 0.0))),
        crs=str(arrays["crs"]) if "crs" in arrays else None,
        ground_classes=_ground_classes(file, arrays),
        **layers,
    )


def _read_members(file: Path, archive: zipfile.ZipFile, max_cells: int) -> dict[str, NDArray[Any]]:
    infos = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    require(
        file,
        "heights" in infos or "elevation" in infos,
        "holds no array 'heights' or 'elevation'",
        "heights (m, south row first) with cell = dx, dy, "
        "or elevation (m, north row first) with dx, dy",
    )
    wanted = [name for name in ("heights", "elevation", *_LAYERS, *_SMALL) if name in infos]
    arrays: dict[str, NDArray[Any]] = {}
    for name in wanted:
        info = infos[name]
        fits = name not in _SMALL or info.file_size <= _MOST_SMALL_BYTES
        require(file, fits, f"has an array '{name}' of {info.file_size:,} bytes", "a short one")
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
    require(
        file,
        count * dtype.itemsize == body,
        f"says that '{name}' takes {count * dtype.itemsize:,} bytes but holds {body:,}",
        "an array as long as its header says; the file may have been cut off",
    )
    data = stream.read(body)
    require(file, len(data) == body, f"ends within its array '{name}'", "a complete file")
    array = np.frombuffer(data, dtype=dtype, count=count)
    return array.reshape(shape, order="F" if fortran_order else "C")


def _check_header(
    file: Path, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], max_cells: int
) -> None:
    code = f"holds Python objects in '{name}', which could run code when loaded"
    require(file, not dtype.hasobject, code, "numbers or text")
    if name not in _SMALL:
        flat = len(shape) == 2
        require(file, flat, f"has an array '{name}' of shape {shape}", "two dimensions")
        check_cells(file, shape[1], shape[0], max_cells)
    kinds, accepted = "fiub", "integers, booleans or floating-point numbers"
    if name in ("ground_classes", "crs"):
        kinds, accepted = "U", "text"
    require(file, dtype.kind in kinds, f"has an array '{name}' of type {dtype}", accepted)


def _pair(file: Path, name: str, value: Any) -> tuple[float, float]:
    try:
        numbers = np.asarray(value, dtype=np.float64).ravel()
    except (ValueError, TypeError, OverflowError):
        numbers = np.empty(0)
    if numbers.size == 1 and name == "cell":
        numbers = np.repeat(numbers, 2)
    finite = numbers.size == 2 and bool(np.isfinite(numbers).all())
    require(file, finite, f"has a bad '{name}'", "two finite numbers in metres")
    lengths = name == "origin" or numbers.min() > 0
    require(file, lengths, f"has a bad '{name}'", "two lengths above 0 in metres")
    return float(numbers[0]), float(numbers[1])


def _ground_classes(file: Path, arrays: dict[str, NDArray[Any]]) -> tuple[GroundClass, ...]:
    if "ground_classes" not in arrays:
        return PLAIN_GROUND
    names = [str(name) for name in arrays["ground_classes"].ravel()]
    factors = arrays.get("ground_factors", np.ones((len(names), 2)))
    require(
        file,
        factors.shape == (len(names), 2),
        f"has 'ground_factors' of shape {factors.shape}",
        f"({len(names)}, 2): rolling and traction of each ground class",
    )
    return tuple(
        GroundClass(name, rolling=float(rolling), traction=float(traction))
        for name, (rolling, traction) in zip(names, factors, strict=True)
    )
