"""Heightmaps that others made: one door for every file format.

    .tif .tiff      GeoTIFF, north-up, in a projected coordinate system      geotiff.py
    .asc            ESRI ASCII grid                                          esri_ascii.py
    .npy .npz       NumPy arrays                                             numpy_files.py
    .yaml .yml      a picture with its YAML: map_server or height picture    picture_maps.py
    .png .pgm       the same, found by the picture
    .toml           a map in several files; a folder with map.toml             map_files

Beside any of them may lie NAME.layers.toml, which draws obstacles and ground classes over the
heights, one character a cell (layers.py). The kind of file is told by its name and checked by its
first bytes, and sizes are read from the header and checked before anything is allocated.

Units: metres. A file in other units is converted once, said in `Terrain.source`, or refused.
Every failure is a MapError that names the file, what is wrong and what would be accepted.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from planner.terrain.esri_ascii import read_esri_ascii
from planner.terrain.geotiff import read_geotiff
from planner.terrain.grid_checks import refused, require
from planner.terrain.heightmap import Terrain
from planner.terrain.layers import add_layers
from planner.terrain.map_files import read_map_toml
from planner.terrain.numpy_files import read_npy, read_npz
from planner.terrain.picture_maps import read_picture, read_picture_yaml

# 800 MB of heights; a map above this is cut up before a robot of any size can use it.
MOST_CELLS = 100_000_000

ACCEPTED = (
    "a GeoTIFF (.tif), an ESRI ASCII grid (.asc), NumPy arrays (.npz, or .npy with a .toml), "
    "a picture (.png, .pgm) with its .yaml, or a .toml (a folder with map.toml) of several files"
)


# First bytes of the kinds of file that are met under a wrong name, with how a person calls them.
_SIGNATURES = {
    "a TIFF": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    "a NumPy array": (b"\x93NUMPY",),
    "a zip archive": (b"PK\x03\x04",),
    "a PNG picture": (b"\x89PNG\r\n\x1a\n",),
    "a JPEG picture": (b"\xff\xd8\xff",),
    "a PGM picture": (b"P5", b"P2"),
    "a GIF picture": (b"GIF8",),
    "a gzip archive": (b"\x1f\x8b",),
    "a PDF document": (b"%PDF",),
    "an HDF5 file": (b"\x89HDF",),
    "a netCDF file": (b"CDF",),
    "a VRT, which points at other files": (b"<VRT",),
    "an XML or HTML document": (b"<",),
}


def _read_map_toml(file: Path, *, max_cells: int) -> Terrain:
    return read_map_toml(file, partial(load_terrain, max_cells=max_cells))


# Of every ending the reader, and the kind that the first bytes must show.
_READERS = {
    ".tif": (read_geotiff, "a TIFF"),
    ".tiff": (read_geotiff, "a TIFF"),
    ".asc": (read_esri_ascii, None),
    ".npy": (read_npy, "a NumPy array"),
    ".npz": (read_npz, "a zip archive"),
    ".png": (read_picture, "a PNG picture"),
    ".pgm": (read_picture, "a PGM picture"),
    ".yaml": (read_picture_yaml, None),
    ".yml": (read_picture_yaml, None),
    ".toml": (_read_map_toml, None),
}


def load_terrain(path: str | Path, *, max_cells: int = MOST_CELLS) -> Terrain:
    """The terrain in a file.

    Args:
        path: the file; its ending gives the format.
        max_cells: refuse larger maps before reading them.

    Raises:
        MapError: the file is absent, of another kind than its name says, damaged, too large, in
            degrees or otherwise not usable as it is.
    """
    file = Path(path)
    if (file / "map.toml").is_file():
        file = file / "map.toml"
    ending = file.suffix.lower()
    try:
        require(file, not file.is_dir(), "is a folder", ACCEPTED)
        require(file, file.exists(), "does not exist", ACCEPTED)
        require(file, file.is_file(), "is not a file", ACCEPTED)
        require(file, file.stat().st_size > 0, "is empty", ACCEPTED)
        found = _kind_by_content(file)
        no_format = f"has the ending '{ending}' of no heightmap format"
        named = f"is {found}, not a heightmap" if found else no_format
        translated = f"; other grids after: gdal_translate {file.name} {file.stem}.tif"
        require(file, ending in _READERS, named, ACCEPTED + translated)
        read, expected = _READERS[ending]
        other = f"is named {ending} but is {found or 'something else'}"
        require(file, found == expected, other, ACCEPTED)
        terrain = read(file, max_cells=max_cells)
    except (OSError, MemoryError) as problem:
        reason = getattr(problem, "strerror", None) or "there is not enough memory"
        raise refused(
            file, f"cannot be read: {reason}", "a readable file within the memory of this machine"
        ) from problem
    return add_layers(terrain, file)


def _kind_by_content(file: Path) -> str | None:
    with file.open("rb") as stream:
        start = stream.read(64)
    for name, signatures in _SIGNATURES.items():
        marked = tuple(signature + b" " for signature in signatures)
        if start.startswith(signatures) or start.lstrip().startswith(marked):
            return name
    return None
