"""Maps by name: those in maps/catalogue.toml, each checked against its sha256 when opened.

Three kinds of entry:

    file        a drawn map in maps/fixed; sha256 over the .asc and, if any, its .layers.toml
    fractal     computed by maps.make_fixed_maps; sha256 over the heights in whole mm (int32)
    jacksboro   real relief in maps/relief; sha256 over the array of heights

Jacksboro's heights are those of matplotlib's sample data, whose file names the rows' latitudes
wrongly: `ymin` = 36.733 is larger than `ymax` = 36.446, and neither order fits the ground. The
first row is the NORTH row at latitude `ymax`, and the south edge lies 344 rows below it, at 36.160:
only then do the highest point (1076 m, Cross Mountain at 36.198 N, 84.231 W, 1077 m) and the lowest
(the Clinch River below Norris Dam) lie where they are. Its 3 arc seconds become metres by the radii
of curvature of the WGS 84 ellipsoid at the map's middle latitude,

    dy = M(phi) dphi,   dx = N(phi) cos(phi) dlambda,
    N = a / sqrt(1 - e^2 sin^2 phi),   M = a (1 - e^2) / (1 - e^2 sin^2 phi)^(3/2),

which leaves the cells longer than they are wide. Left out: the convergence of the meridians; from
the middle to the north or south edge dx changes by 0.2 %. The map reduced 1:100 divides all three
axes alike, so slopes are those of the ground and a small robot meets them at its own size.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import os
import tomllib
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import MapError

if TYPE_CHECKING:
    from planner.terrain.heightmap import Terrain

_MAPS = Path(__file__).resolve().parents[2] / "maps"
_LISTED = ("name", "title", "size", "cell", "crs", "source", "licence", "sha256")

# The true north edge of Jacksboro's first row, and the spacing of its rows and columns, degrees.
_JACKSBORO_NORTH = 36.44625
_ARC_SECONDS_3 = 3.0 / 3600.0


def open_map(name_or_path: str | Path) -> Terrain:
    """The map of a catalogue name, otherwise the one in a file.

    Args:
        name_or_path: a name that `list_maps` lists, or a path to a heightmap (see formats.py).

    Raises:
        MapError: neither a name nor a file, a catalogue map whose bytes have changed, or what
            `load_terrain` raises.
    """
    entry = _entries().get(str(name_or_path))
    if entry is None:
        text = str(name_or_path)
        if not text.strip() or "\0" in text or not os.path.exists(text):
            raise MapError(
                "map",
                "there is no map and no file of that name",
                value=text,
                accepted=f"one of {', '.join(_entries())}, or a path to a heightmap "
                "(.tif, .asc, .npz, .npy, .yaml, .png)",
            )
        return _loaded(Path(text))
    openers = {"file": _open_file, "fractal": _open_fractal, "jacksboro": _open_jacksboro}
    return openers[entry["kind"]](entry)


def _loaded(file: Path) -> Terrain:
    # Reading loads a compiler, which a list of maps does without.
    from planner.terrain.formats import load_terrain

    return load_terrain(file)


def list_maps() -> list[dict[str, Any]]:
    """The catalogue, one dict a map.

    Returns:
        name, title, size [x, y] m, cell [dx, dy] m, crs ("local" or a code), source, licence,
        sha256.
    """
    return [{key: entry[key] for key in _LISTED} for entry in _entries().values()]


@cache  # a file of the package
def _entries() -> dict[str, dict[str, Any]]:
    content = tomllib.loads((_MAPS / "catalogue.toml").read_text(encoding="utf-8"))
    return {entry["name"]: entry for entry in content["map"]}


def _open_file(entry: dict[str, Any]) -> Terrain:
    file = _MAPS / entry["file"]
    layers = file.with_name(file.stem + ".layers.toml")
    content = _content(entry, file)
    _verify(entry, content + (_content(entry, layers) if layers.exists() else b""))
    return _named(entry, _loaded(file))


def _content(entry: dict[str, Any], file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as problem:
        raise MapError(
            "map",
            f"{entry['name']} is listed, but its file {file.name} cannot be read",
            accepted="a complete installation of joulepath",
        ) from problem


def _open_fractal(entry: dict[str, Any]) -> Terrain:
    from maps.make_fixed_maps import FRACTAL_CELL, fractal_heights

    heights = fractal_heights()
    _verify(entry, np.round(heights * 1000).astype("<i4").tobytes())
    return _centred(entry, heights, (FRACTAL_CELL, FRACTAL_CELL))


def _open_jacksboro(entry: dict[str, Any]) -> Terrain:
    with np.load(io.BytesIO(_content(entry, _MAPS / entry["file"])), allow_pickle=False) as archive:
        elevation = archive["elevation"]
    _verify(entry, elevation.astype("<i2").tobytes())
    middle = _JACKSBORO_NORTH - 0.5 * elevation.shape[0] * _ARC_SECONDS_3
    # As above: this loads a compiler.
    from planner.terrain.geotiff import local_scale

    dx, dy = local_scale(middle, _ARC_SECONDS_3)
    reduction = float(entry["reduction"])
    heights = elevation[::-1].astype(np.float64) / reduction
    return _centred(entry, heights, (dx / reduction, dy / reduction))


def _centred(
    entry: dict[str, Any], heights: NDArray[np.float64], cell: tuple[float, float]
) -> Terrain:
    """The terrain of an entry whose outer south-west corner is (0, 0)."""
    from planner.terrain.heightmap import Terrain

    origin = 0.5 * cell[0], 0.5 * cell[1]
    return _named(entry, Terrain.from_arrays(heights, cell=cell, origin=origin))


def _named(entry: dict[str, Any], terrain: Terrain) -> Terrain:
    return dataclasses.replace(terrain, name=entry["name"], source=f"catalogue: {entry['source']}")


def _verify(entry: dict[str, Any], content: bytes) -> None:
    found = hashlib.sha256(content).hexdigest()
    if found != entry["sha256"]:
        raise MapError(
            "map",
            f"{entry['name']} is not the map that the catalogue describes: its sha256 differs",
            value=found,
            accepted=f"sha256 {entry['sha256']}; install joulepath anew, or give a changed map "
            "as a path of its own",
        )
