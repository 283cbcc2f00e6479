"""A map in several files, put together by a TOML file in their folder.

    plan = "floor.yaml"            # floor plan of map_server: obstacles, unknown ground, the grid
    heights = "survey.tif"         # any heightmap, also a picture with metres a gray step
    ramps = "ramps.geojson"        # polygons with [x, y, z] corners, or a property "height"
    ground = "ground.geojson"      # polygons with a property "ground"; or a picture, with [colours]
    crs = "EPSG:32632"             # of a map that names none; may be left out

    [colours]                      # of a picture as ground: the meaning of each colour
    "#ff0000" = "carpet"
    [factors.carpet]               # as in NAME.layers.toml
    rolling = 2.3
    traction = 0.9

``plan`` or ``heights`` is needed. The grid is the plan's, and that of the heights without one.
Heights are interpolated onto it; where they end, the ground is unknown. A ramp is the plane through
its corners, drawn over the heights. "obstacle" and "hole" are meanings as in layers.py.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.terrain.grid_checks import beside, check_entries, refused, require
from planner.terrain.heightmap import Terrain
from planner.terrain.layers import ground_class, read_toml
from planner.terrain.map_files.polygons import read_polygons
from planner.terrain.surface import PLAIN_GROUND

LEAST_COVER = 0.5
"""Share of the plan's known floor that the heights must cover; less is another frame or site."""
FLATNESS = 0.02
"""m that a corner of a ramp may lie off the plane through all of them."""
ROWS_AT_ONCE = 200
"""Rows of a grid that are interpolated together, for memory."""
_FILES = ("plan", "heights", "ramps", "ground")
_TABLES = ("colours", "factors")
_ACCEPTED = (
    'plan = "floor.yaml", heights = "dem.tif", ramps, ground, crs, [colours], [factors.NAME]'
)

Layer = NDArray[np.bool_]


def read_map_toml(file: Path, load: Callable[[Path], Terrain]) -> Terrain:
    """The terrain that a TOML file puts together.

    Args:
        file: the TOML file.
        load: reads the plan and the heights.

    Raises:
        MapError: an entry is unknown or impossible, a file is absent or misfits the others.
    """
    content = read_toml(file)
    check_entries(file, content, _ACCEPTED, known=(*_FILES, *_TABLES, "crs"))
    needed = "plan" in content or "heights" in content
    require(file, needed, "names neither a plan nor heights", _ACCEPTED)
    paths = {key: beside(file, key, content[key]) for key in _FILES if key in content}
    given = [key for key in ("plan", "heights") if key in paths]
    for key in given:
        plain = paths[key].suffix.lower() != ".toml"
        require(file, plain, f"names another map file as {key}", _ACCEPTED)
    parts = {key: load(paths[key]) for key in given}
    base = parts.get("plan", parts.get("heights"))
    assert base is not None
    z, known, obstacles = base.heights.copy(), base.known.copy(), base.obstacles.copy()
    if len(parts) == 2:
        z, covered = _sampled(file, parts["heights"], base)
        known &= covered
        obstacles |= _nearest(parts["heights"], base, parts["heights"].obstacles)
    if "ramps" in paths:
        _draw_ramps(paths["ramps"], base, z, known)
    kinds, classes = base.ground, base.ground_classes
    if "ground" in paths:
        kinds, classes = _ground(file, paths["ground"], content, base, (known, obstacles))
    crs = content.get("crs", parts["heights"].crs if "heights" in parts else None)
    if crs is not None:
        from planner.terrain.geotiff import checked_crs

        require(file, isinstance(crs, str), "has a bad 'crs'", 'text such as "EPSG:32632"')
        xmin, ymin, xmax, ymax = base.extent
        crs = checked_crs(file, crs, (0.5 * (xmin + xmax), 0.5 * (ymin + ymax)))
    return Terrain.from_arrays(
        z,
        cell=base.cell,
        origin=base.origin,
        name=file.parent.name if file.stem == "map" else file.stem,
        known=known,
        obstacles=obstacles,
        ground=kinds,
        ground_classes=classes,
        crs=crs,
        source=f"{file}: {', '.join(f'{key} {path.name}' for key, path in paths.items())}",
        odd=tuple(sentence for part in parts.values() for sentence in part.odd),
    )


def _centres(terrain: Terrain) -> tuple[NDArray[Any], NDArray[Any]]:
    ny, nx = terrain.heights.shape
    (x0, y0), (dx, dy) = terrain.origin, terrain.cell
    return x0 + dx * np.arange(nx), y0 + dy * np.arange(ny)


def _nearest(source: Terrain, grid: Terrain, layer: Layer) -> Layer:
    """A layer of one grid at the cells of another; False beyond it."""
    x, y = _centres(grid)
    ny, nx = layer.shape
    i = np.floor((x - source.origin[0]) / source.cell[0] + 0.5).astype(np.int64)
    j = np.floor((y - source.origin[1]) / source.cell[1] + 0.5).astype(np.int64)
    inside = ((j >= 0) & (j < ny))[:, None] & ((i >= 0) & (i < nx))[None, :]
    taken: Layer = layer[np.ix_(np.clip(j, 0, ny - 1), np.clip(i, 0, nx - 1))]
    return np.asarray(taken & inside)


def _sampled(file: Path, heights: Terrain, grid: Terrain) -> tuple[NDArray[np.float64], Layer]:
    """Heights at the cells of another grid, and where they are known."""
    covered = _nearest(heights, grid, heights.known)
    floor = max(int(grid.known.sum()), 1)
    share = float((covered & grid.known).sum()) / floor
    spans = [", ".join(f"{edge:.6g}" for edge in part.extent) for part in (heights, grid)]
    require(
        file,
        share >= LEAST_COVER,
        f"has heights that cover {share:.0%} of the plan's floor (heights {spans[0]}; plan "
        f"{spans[1]}: xmin, ymin, xmax, ymax)",
        "plan and heights in one frame of metres; the origin in their YAML or GeoTIFF says where "
        "they lie",
    )
    x, y = _centres(grid)
    z = np.zeros(grid.heights.shape)
    for start in range(0, len(y), ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        z[rows] = heights.height(x[None, :], y[rows, None])
    return z, covered


def _draw_ramps(file: Path, base: Terrain, z: NDArray[np.float64], known: Layer) -> None:
    """Planes of the polygons over the heights; changed in place."""
    x, y = _centres(base)
    for polygon in read_polygons(file):
        cells = polygon.cells(base)
        outside = f"has {polygon.place} outside the map, or smaller than a cell"
        require(file, bool(cells.any()), outside, "polygons in metres in the map's frame")
        corners = np.unique(polygon.rings[0], axis=0)  # The last one is the first again.
        height = polygon.properties.get("height")
        if corners.shape[1] == 2:
            number = height if isinstance(height, int | float) else float("nan")
            finite = bool(np.isfinite(number)) and not isinstance(height, bool)
            accepted = 'corners [x, y, z], or a property "height" in metres'
            require(file, finite, f"has {polygon.place} without heights", accepted)
            corners = np.column_stack([corners, np.full(len(corners), float(number))])
        flat = np.column_stack([corners[:, :2], np.ones(len(corners))])
        plane, *_ = np.linalg.lstsq(flat, corners[:, 2], rcond=None)
        off = float(np.abs(flat @ plane - corners[:, 2]).max())
        require(
            file,
            off <= FLATNESS,
            f"has {polygon.place} whose corners lie {off:.3g} m off a plane",
            "a polygon for each plane of a ramp",
        )
        j, i = np.nonzero(cells)
        z[j, i] = plane[0] * x[i] + plane[1] * y[j] + plane[2]
        known[j, i] = True


def _ground(
    file: Path, path: Path, content: dict[str, Any], base: Terrain, layers: tuple[Layer, Layer]
) -> tuple[NDArray[np.uint8], Any]:
    """Ground of every cell and its classes; obstacles and holes go into ``layers``."""
    drawn = path.suffix.lower() == ".png"
    parts = _of_picture(file, path, content, base) if drawn else _of_polygons(path, base)
    names = [n for n in dict.fromkeys(name for name, _ in parts) if n not in ("obstacle", "hole")]
    factors = content.get("factors", {})
    known_names = isinstance(factors, dict) and set(factors) <= set(names)
    require(file, known_names, "has [factors] of a ground that is not drawn", ", ".join(names))
    require(file, len(names) < 255, "has too many kinds of ground", "at most 254")
    known, obstacles = layers
    kinds = np.zeros(base.heights.shape, np.uint8)
    for name, cells in parts:
        if name == "obstacle":
            obstacles |= cells
        elif name == "hole":
            known &= ~cells
        else:
            kinds[cells] = 1 + names.index(name)
    classes = tuple(ground_class(file, name, factors.get(name, {})) for name in names)
    return kinds, (*PLAIN_GROUND, *classes)


def _of_polygons(file: Path, base: Terrain) -> list[tuple[str, Layer]]:
    parts = []
    for polygon in read_polygons(file):
        name = polygon.properties.get("ground")
        good = isinstance(name, str) and bool(name.strip())
        accepted = '"properties": {"ground": "carpet"}'
        require(file, good, f"has {polygon.place} without a property 'ground'", accepted)
        cells = polygon.cells(base)
        outside = f"has {polygon.place} outside the map, or smaller than a cell"
        require(file, bool(cells.any()), outside, "polygons in metres in the map's frame")
        parts.append((str(name), cells))
    return parts


def _of_picture(
    file: Path, path: Path, content: dict[str, Any], base: Terrain
) -> list[tuple[str, Layer]]:
    from planner.terrain.picture_maps import read_colours

    colours = content.get("colours")
    good = isinstance(colours, dict) and all(
        re.fullmatch("#[0-9a-fA-F]{6}", key) and isinstance(name, str) and name
        for key, name in colours.items()
    )
    if not good or not isinstance(colours, dict):
        raise refused(file, "has no [colours] of its picture", '"#ff0000" = "carpet" and so on')
    ny, nx = base.heights.shape
    picture = read_colours(path, (nx, ny))[::-1]
    meaning = {int(key[1:], 16): name for key, name in colours.items()}
    strange = sorted(set(np.unique(picture).tolist()) - {*meaning})
    named = f"has the colour #{strange[0]:06x}" if strange else ""
    require(path, not strange, named, f"colours of [colours]: {', '.join(colours)}")
    return [(name, picture == colour) for colour, name in meaning.items()]
