"""Heightmaps that others made: one door for every file format.

    .tif .tiff      GeoTIFF, north-up, in a projected coordinate system      geotiff.py
    .asc            ESRI ASCII grid                                          esri_ascii.py
    .npy .npz       NumPy arrays                                             numpy_files.py
    .yaml .yml      a picture with its YAML: map_server or height picture    picture_maps.py
    .png .pgm       the same, found by the picture

Beside any of them may lie NAME.layers.toml, which draws obstacles and ground classes over the
heights, one character a cell (layers.py). The kind of file is told by its name and checked by its
first bytes, and sizes are read from the header and checked before anything is allocated.

Units: metres. A file in other units is converted once, said in `Terrain.source`, or refused.
Every failure is a MapError that names the file, what is wrong and what would be accepted.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from planner.errors import MapError
from planner.terrain.heightmap import Terrain
from planner.terrain.layers import add_layers

# 800 MB of heights; a map above this is cut up before a robot of any size can use it.
MOST_CELLS = 100_000_000

ACCEPTED = (
    "a GeoTIFF (.tif), an ESRI ASCII grid (.asc), NumPy arrays (.npz, or .npy with a .toml), "
    "or a picture (.png, .pgm) with its .yaml"
)


def load_terrain(path: str | Path, *, max_cells: int = MOST_CELLS) -> Terrain:
    """The terrain in a file.

    Args:
        path: the file; its ending says the format.
        max_cells: refuse larger maps before reading them.

    Raises:
        MapError: the file is absent, of another kind than its name says, damaged, too large, in
            degrees or otherwise not usable as it is.
    """
    file = Path(path)
    kind = file.suffix.lower()
    try:
        _check_readable(file)
        reader = _READERS.get(kind)
        found = _kind_by_content(file)
        if reader is None:
            what = (
                f"is {found}, not a heightmap"
                if found
                else f"has the ending '{kind}' of no heightmap format"
            )
            raise MapError("map", f"{file.name} {what}", value=str(file), accepted=ACCEPTED)
        _check_kind(file, kind, found)
        terrain = reader(file, max_cells)
    except (OSError, MemoryError) as problem:
        reason = getattr(problem, "strerror", None) or "there is not enough memory"
        raise MapError(
            "map",
            f"{file.name} cannot be read: {reason}",
            value=str(file),
            accepted="a readable file within the memory of this machine",
        ) from problem
    return add_layers(terrain, file)


def _check_readable(file: Path) -> None:
    if file.is_dir():
        raise MapError("map", f"{file.name} is a folder", value=str(file), accepted=ACCEPTED)
    if not file.exists():
        raise MapError("map", f"{file.name} does not exist", value=str(file), accepted=ACCEPTED)
    if not file.is_file():
        raise MapError("map", f"{file.name} is not a file", value=str(file), accepted=ACCEPTED)
    if file.stat().st_size == 0:
        raise MapError("map", f"{file.name} is empty", value=str(file), accepted=ACCEPTED)


# First bytes of the kinds of file that are met under a wrong name, with how a person calls them.
_SIGNATURES = (
    (b"II*\0", "a TIFF"),
    (b"MM\0*", "a TIFF"),
    (b"II+\0", "a TIFF"),
    (b"MM\0+", "a TIFF"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"P5", "a PGM picture"),
    (b"P2", "a PGM picture"),
    (b"GIF8", "a GIF picture"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF document"),
    (b"\x89HDF", "an HDF5 file"),
    (b"CDF", "a netCDF file"),
    (b"<VRT", "a VRT, which points at other files"),
    (b"<", "an XML or HTML document"),
)

_EXPECTED: dict[str, set[str | None]] = {
    ".tif": {"a TIFF"},
    ".tiff": {"a TIFF"},
    ".npy": {"a NumPy array"},
    ".npz": {"a zip archive"},
    ".png": {"a PNG picture"},
    ".pgm": {"a PGM picture"},
    ".asc": {None},
    ".yaml": {None},
    ".yml": {None},
}


def _kind_by_content(file: Path) -> str | None:
    with file.open("rb") as stream:
        start = stream.read(64)
    for signature, name in _SIGNATURES:
        if start.startswith(signature) or start.lstrip().startswith(signature + b" "):
            return name
    return None


def _check_kind(file: Path, kind: str, found: str | None) -> None:
    if found in _EXPECTED[kind]:
        return
    raise MapError(
        "map",
        f"{file.name} is named {kind} but is {found or 'something else'}",
        value=str(file),
        accepted=ACCEPTED,
    )


# Each reader imports its library when called: a run on a catalogue map starts without rasterio.
def _geotiff(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.geotiff import read_geotiff

    return read_geotiff(file, max_cells=max_cells)


def _esri_ascii(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.esri_ascii import read_esri_ascii

    return read_esri_ascii(file, max_cells=max_cells)


def _npy(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.numpy_files import read_npy

    return read_npy(file, max_cells=max_cells)


def _npz(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.numpy_files import read_npz

    return read_npz(file, max_cells=max_cells)


def _picture(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.picture_maps import read_picture

    return read_picture(file, max_cells=max_cells)


def _picture_yaml(file: Path, max_cells: int) -> Terrain:
    from planner.terrain.picture_maps import read_picture_yaml

    return read_picture_yaml(file, max_cells=max_cells)


_READERS: dict[str, Callable[[Path, int], Terrain]] = {
    ".tif": _geotiff,
    ".tiff": _geotiff,
    ".asc": _esri_ascii,
    ".npy": _npy,
    ".npz": _npz,
    ".png": _picture,
    ".pgm": _picture,
    ".yaml": _picture_yaml,
    ".yml": _picture_yaml,
}
