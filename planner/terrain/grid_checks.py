"""Checks that maps of every format share, and the sentence of the one that fails.

    require(file, cell > 0, "has a bad cellsize", "metres, above 0", value=cell)

The sentences name the file, what is wrong and the command or entry that fixes it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from planner.errors import MapError, short


def refused(which: Path | str, problem: str, accepted: str, value: Any = None) -> MapError:
    """The error for a map that cannot be used.

    Args:
        which: its file, or the name of arrays.
        problem: what is wrong, to follow that name.
        accepted: what would be accepted instead.
        value: as given; of a file its path by default.
    """
    if isinstance(which, Path):
        which, value = which.name, str(which) if value is None else value
    return MapError("map", f"{which} {problem}", value=value, accepted=accepted)


def require(which: Path | str, holds: bool, problem: str, accepted: str, value: Any = None) -> None:
    """Refuse a map for which something does not hold.

    Raises:
        MapError: as ``refused`` words it.
    """
    if not holds:
        raise refused(which, problem, accepted, value)


def check_cells(file: Path, nx: int, ny: int, max_cells: int) -> None:
    """Refuse a header that claims more cells than allowed, or none.

    Raises:
        MapError: nx * ny is above max_cells, or a side is below 1.
    """
    sides = f"says that it has {nx} columns and {ny} rows"
    require(file, min(nx, ny) >= 1, sides, "at least 4 columns and 4 rows")
    require(
        file,
        nx * ny <= max_cells,
        f"says that it has {nx} by {ny} = {nx * ny:,} cells",
        f"at most {max_cells:,} cells; cut it (gdal_translate -srcwin) "
        "or make the cells larger (gdalwarp -tr)",
    )


def check_entries(
    file: Path,
    entries: Mapping[Any, Any],
    accepted: str,
    *,
    known: Collection[str],
    required: Collection[str] = (),
) -> None:
    """Refuse a description with an entry that means nothing, or without one that is needed.

    Raises:
        MapError: a key is not among ``known``, or one of ``required`` is missing.
    """
    unknown = {key if isinstance(key, str) else short(key) for key in entries} - {*known}
    first = min(unknown, default="")
    require(file, not unknown, f"has the unknown entry '{first}'", accepted)
    for key in required:
        require(file, key in entries, f"has no '{key}'", accepted)


def beside(file: Path, key: str, name: Any) -> Path:
    """The file that an entry of another file names, in the same folder or below.

    Raises:
        MapError: there is none. A map from someone else must not point at other files.
    """
    plain = PurePosixPath(name) if isinstance(name, str) else PurePosixPath()
    below = bool(plain.parts) and not plain.is_absolute() and ".." not in plain.parts
    require(file, below, f"has a bad '{key}'", "the name of a file in its folder")
    path = file.parent / plain
    require(file, path.is_file(), f"names the file {plain}, which is absent", "a file beside it")
    inside = path.resolve().is_relative_to(file.parent.resolve())
    require(file, inside, f"has a '{key}' that leads elsewhere", "a file beside it")
    return path
