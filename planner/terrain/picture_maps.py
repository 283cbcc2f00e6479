"""Pictures with a YAML file: occupancy grids as ROS's map_server, heights as grid_map pictures.

Occupancy (the floor is flat, at height 0):

    image: floor.png          # .png or .pgm beside the YAML; its top row is the north row
    resolution: 0.05          # m a pixel
    origin: [-10.0, -5.0, 0]  # lower left corner of the picture; its yaw must be 0
    occupied_thresh: 0.65
    free_thresh: 0.196
    negate: 0

With p = (white - gray) / white, or gray / white if negate: p above occupied_thresh is an obstacle,
p below free_thresh is free, anything between is unknown.

Heights (no thresholds):

    image: elevation.png
    resolution: 0.04
    origin: [0.0, 0.0, 0]
    height_max: 2.78          # height of white, m; or height_scale: m a gray step
    height_min: 0.0           # height of black, m
    unknown: 0                # gray value of cells that nobody measured; may be left out

white is 255, or 65535 in a 16-bit picture. The fourth channel of a colour picture is ignored, the
others are averaged. Source: ROS wiki, map_server, "Map format"; grid_map_cv, GridMapCvConverter.
Left out: map_server's modes scale and raw.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import MapError, short
from planner.reading import finite_number
from planner.terrain.grid_checks import beside, check_cells, check_entries, refused, require
from planner.terrain.heightmap import Terrain

SAVED_AS_UNKNOWN = 205
"""Gray value that map_saver of ROS writes where nobody has measured."""
_COMMON = {"image", "resolution", "origin"}
_OCCUPANCY = {"occupied_thresh", "free_thresh", "negate", "mode"}
_HEIGHTS = {"height_min", "height_max", "height_scale", "unknown"}

_EXAMPLE = (
    "a YAML file beside it, for heights: 'image: {0}', 'resolution: 0.04' (m a pixel), "
    "'origin: [0, 0, 0]', 'height_max: 2.78' (m, white), 'unknown: 0'; for a floor plan: "
    "'image', 'resolution', 'origin', 'occupied_thresh: 0.65', 'free_thresh: 0.196', 'negate: 0'"
)


def read_picture(file: Path, *, max_cells: int) -> Terrain:
    """The terrain in a picture whose YAML has the same name.

    Raises:
        MapError: there is no such YAML, or what `read_picture_yaml` raises.
    """
    for ending in (".yaml", ".yml"):
        description = file.with_suffix(ending)
        if description.is_file():
            return read_picture_yaml(description, max_cells=max_cells)
    raise refused(file, "is a picture without a scale in metres", _EXAMPLE.format(file.name))


def read_picture_yaml(file: Path, *, max_cells: int) -> Terrain:
    """The terrain that a YAML file and its picture describe.

    Raises:
        MapError: an entry is missing, unknown or impossible, or the picture cannot be read.
    """
    entries = _read_yaml(file)
    resolution = _number(file, entries, "resolution")
    require(file, resolution > 0, "has a bad 'resolution'", "metres a pixel, above 0")
    west, south = _origin(file, entries)
    gray, white = _read_gray(beside(file, "image", entries["image"]), max_cells)
    gray = gray[::-1]
    if _HEIGHTS & set(entries):
        heights, known = _heights(file, entries, gray, white)
        obstacles = np.zeros(gray.shape, dtype=np.bool_)
        odd: tuple[str, ...] = ()
    else:
        heights = np.zeros(gray.shape)
        known, obstacles = _occupancy(file, entries, gray, white)
        odd = _unknown_as_floor(entries, gray, known & ~obstacles)
    return Terrain.from_arrays(
        heights,
        cell=(resolution, resolution),
        origin=(west + 0.5 * resolution, south + 0.5 * resolution),
        name=file.stem,
        known=known,
        obstacles=obstacles,
        source=str(file),
        odd=odd,
    )


def _read_yaml(file: Path) -> dict[str, Any]:
    import yaml

    try:
        entries = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (yaml.YAMLError, ValueError, RecursionError) as problem:
        raise refused(file, "is not YAML", "lines of 'key: value'") from problem
    accepted = _EXAMPLE.format("NAME.png")
    if not isinstance(entries, dict):
        raise refused(file, "holds no entries", accepted)
    known = _COMMON | _OCCUPANCY | _HEIGHTS
    check_entries(file, entries, accepted, known=known, required=sorted(_COMMON))
    heights, plan = (min(kind & set(entries), default="") for kind in (_HEIGHTS, _OCCUPANCY))
    either = "either a picture of heights or a floor plan"
    require(file, not (heights and plan), f"has '{heights}' and '{plan}'", either)
    return entries


def _number(file: Path, entries: dict[str, Any], key: str, default: float | None = None) -> float:
    value = entries.get(key, default)
    number = finite_number(value)
    if number is None:
        raise refused(file, f"has a bad '{key}', {short(value)}", "a finite number")
    return number


def _origin(file: Path, entries: dict[str, Any]) -> tuple[float, float]:
    origin = entries["origin"]
    if not isinstance(origin, list) or len(origin) not in (2, 3):
        raise refused(file, "has a bad 'origin'", "[x, y, 0] of the lower left corner in metres")
    numbers = [_number(file, {"origin": value}, "origin") for value in origin]
    straight = numbers[2:] in ([], [0])
    require(file, straight, "has a rotated 'origin'", "a yaw of 0; rotate the picture instead")
    return numbers[0], numbers[1]


@contextmanager
def _opened(path: Path, accepted: str, *formats: str) -> Iterator[Any]:
    """A picture of one of these formats, named as Pillow does."""
    import warnings

    from PIL import Image

    try:
        with warnings.catch_warnings():
            # Pillow warns of large pictures; the check of cells decides instead.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path, formats=formats) as opened:
                yield opened
    except MapError:
        raise
    except Image.DecompressionBombError as problem:
        raise refused(path, "is too large a picture", "fewer pixels") from problem
    except (OSError, SyntaxError, ValueError) as problem:
        raise refused(path, "is not a readable picture, or is cut off", accepted) from problem


def _read_gray(path: Path, max_cells: int) -> tuple[NDArray[np.float64], float]:
    with _opened(path, "a PNG or PGM picture", "PNG", "PPM") as opened:
        check_cells(path, opened.width, opened.height, max_cells)
        plain = {"P": "RGB", "PA": "RGB", "1": "L"}
        picture = opened.convert(plain.get(opened.mode, opened.mode))
        mode = picture.mode
        values = np.asarray(picture, dtype=np.float64)
    if values.ndim == 3:
        channels = values.shape[2] - (1 if mode.endswith("A") else 0)
        values = values[:, :, :channels].mean(axis=2)
    return values, 65535.0 if mode.startswith("I") else 255.0


def read_colours(path: Path, size: tuple[int, int]) -> NDArray[np.int64]:
    """Colours of a PNG picture as 0xRRGGBB, (ny, nx), its top row first.

    Args:
        path: the picture.
        size: nx, ny that it must have.

    Raises:
        MapError: it has another size or cannot be read.
    """
    with _opened(path, "a PNG picture", "PNG") as opened:
        given = f"has {opened.width} by {opened.height} pixels"
        require(path, opened.size == size, given, f"{size[0]} by {size[1]}, as the map")
        values = np.asarray(opened.convert("RGB"), dtype=np.int64)
    return (values[:, :, 0] << 16) + (values[:, :, 1] << 8) + values[:, :, 2]


def _heights(
    file: Path, entries: dict[str, Any], gray: NDArray[np.float64], white: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    require(
        file,
        ("height_max" in entries) != ("height_scale" in entries),
        "does not say once how high white is",
        "'height_max' (m, white) or 'height_scale' (m a gray step)",
    )
    lowest = _number(file, entries, "height_min", 0.0)
    if "height_max" in entries:
        scale = (_number(file, entries, "height_max") - lowest) / white
    else:
        scale = _number(file, entries, "height_scale")
    rising = 0.0 < scale * white < math.inf
    require(file, rising, "has white no higher than black", "a finite scale above 0")
    known = np.ones(gray.shape, dtype=np.bool_)
    if "unknown" in entries:
        known = gray != _number(file, entries, "unknown")
    return lowest + gray * scale, known


def _occupancy(
    file: Path, entries: dict[str, Any], gray: NDArray[np.float64], white: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    mode, negate = entries.get("mode", "trinary"), entries.get("negate", 0)
    require(file, mode == "trinary", f"has the mode {short(mode)}", "trinary")
    occupied = _number(file, entries, "occupied_thresh", 0.65)
    free = _number(file, entries, "free_thresh", 0.196)
    order = "0 <= free_thresh < occupied_thresh <= 1"
    require(file, 0 <= free < occupied <= 1, "has thresholds out of order", order)
    require(file, negate in (0, 1), "has a bad 'negate'", "0 or 1")
    probability = gray / white if negate else (white - gray) / white
    obstacles = probability > occupied
    # What is unknown is neither: an obstacle is known to stand on the floor.
    return obstacles | (probability < free), obstacles


def _unknown_as_floor(
    entries: dict[str, Any], gray: NDArray[np.float64], floor: NDArray[np.bool_]
) -> tuple[str, ...]:
    """A sentence where unknown ground is read as floor: Nav2's map_saver writes such thresholds."""
    unknown = floor & (gray == SAVED_AS_UNKNOWN)
    if not unknown.any() or not (floor & (gray > SAVED_AS_UNKNOWN)).any():
        return ()
    share, limit = 100.0 * unknown.mean(), entries["free_thresh"]
    return (
        f"{share:.2g} % of the floor plan is gray {SAVED_AS_UNKNOWN}, which map_saver writes for "
        f"unknown ground, and its free_thresh of {limit:g} makes that floor; 0.196 leaves it "
        "unknown",
    )
