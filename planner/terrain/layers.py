"""Obstacles and ground classes drawn over a heightmap, in a text file beside it.

NAME.layers.toml belongs to NAME.asc, NAME.tif or any other format:

    rows = ["####", "#..#", "#.c#", "####"]     # the NORTH row first, one character a cell

    [legend]                                    # what each character means
    "#" = "obstacle"
    "?" = "hole"
    "." = "concrete"
    "c" = "carpet"

    [ground.carpet]                             # classes not listed have the factors 1, 1
    rolling = 2.3
    traction = 0.9

"obstacle" and "hole" are the two words with a meaning of their own; any other word is a ground
class. Left out: obstacles of limited height, cells of more than one class.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from planner.reading import finite_number, parse_toml
from planner.terrain.grid_checks import check_entries, refused, require
from planner.terrain.heightmap import Terrain
from planner.terrain.surface import PLAIN_GROUND, GroundClass

_ENTRIES = ("rows", "legend", "ground")


def add_layers(terrain: Terrain, file: Path) -> Terrain:
    """The terrain with the layers drawn in the sidecar of its file, if there is one.

    Raises:
        MapError: the sidecar is not TOML, does not fit the map or uses an unknown character.
    """
    sidecar = file.with_name(file.stem + ".layers.toml")
    if not sidecar.is_file():
        return terrain
    rows, legend, ground = _parse(sidecar, read_toml(sidecar), terrain.heights.shape)
    names = [m for m in dict.fromkeys(legend.values()) if m not in ("obstacle", "hole")]
    classes = tuple(ground_class(sidecar, name, ground.get(name, {})) for name in names)
    picture = np.array([list(row) for row in rows])[::-1]
    obstacles = terrain.obstacles.copy()
    known = terrain.known.copy()
    kinds = np.zeros(picture.shape, dtype=np.uint8)
    for character, meaning in legend.items():
        here = picture == character
        if meaning == "obstacle":
            obstacles |= here
        elif meaning == "hole":
            known &= ~here
        else:
            kinds[here] = names.index(meaning)
    some = bool(known.any())
    require(sidecar, some, "makes every cell a hole", "at least one cell of known height")
    return dataclasses.replace(
        terrain,
        obstacles=obstacles,
        known=known,
        ground=kinds,
        ground_classes=classes or PLAIN_GROUND,
    )


def read_toml(file: Path) -> dict[str, Any]:
    """A TOML file's content.

    Raises:
        MapError: the file is not TOML, with the place where it goes wrong.
    """
    try:
        return parse_toml(file.read_bytes())
    except ValueError as problem:
        raise refused(file, f"is not TOML: {problem}", "a TOML file in UTF-8") from problem


def _parse(
    sidecar: Path, content: dict[str, Any], shape: tuple[int, ...]
) -> tuple[list[str], dict[str, str], dict[str, Any]]:
    check_entries(sidecar, content, "'rows', 'legend' and 'ground'", known=_ENTRIES)
    rows, legend, ground = (content.get(key) for key in _ENTRIES)
    ground = {} if ground is None else ground
    ny, nx = shape
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise refused(sidecar, "has no list of 'rows'", f"{ny} strings, the north row first")
    needed = f"{ny} rows, as the heights have"
    require(sidecar, len(rows) == ny, f"draws {len(rows)} rows", needed)
    columns = f"{nx} characters, one for each column of the heights"
    for number, row in enumerate(rows):
        drawn = f"draws {len(row)} characters in row {number}"
        require(sidecar, len(row) == nx, drawn, columns)
    if not isinstance(legend, dict) or not all(
        len(key) == 1 and isinstance(meaning, str) for key, meaning in legend.items()
    ):
        raise refused(sidecar, "has no [legend] of single characters", '"#" = "obstacle" and so on')
    first = min(set().union(*rows) - set(legend), default="")
    characters = f"characters of its legend: {' '.join(sorted(legend))}"
    require(sidecar, not first, f"draws the character '{first}'", characters)
    used = isinstance(ground, dict) and set(ground) <= set(legend.values())
    unused = "has a [ground] class that its legend does not use"
    require(sidecar, used, unused, "classes of the legend")
    return rows, legend, ground


def ground_class(sidecar: Path, name: str, factors: Any) -> GroundClass:
    """A kind of ground from its entries ``rolling`` and ``traction``.

    Raises:
        MapError: an entry is unknown or impossible.
    """
    accepted = f"[ground.{name}] with rolling (0 or more) and traction (above 0)"
    known = isinstance(factors, dict) and set(factors) <= {"rolling", "traction"}
    require(sidecar, known, f"has a ground class '{name}' with unknown entries", accepted)
    rolling = finite_number(factors.get("rolling", 1.0))
    traction = finite_number(factors.get("traction", 1.0))
    if rolling is None or traction is None:
        raise refused(sidecar, f"has a ground class '{name}' without finite numbers", accepted)
    possible = rolling >= 0.0 and traction > 0.0
    require(sidecar, possible, f"has a ground class '{name}' with an impossible factor", accepted)
    return GroundClass(name, rolling=rolling, traction=traction)
