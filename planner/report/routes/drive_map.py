"""Where a vehicle can go on a map, and in which directions, as a page.

page, shares = drive_page(terrain, vehicle)

A cell is blocked, leaves no room for the body at any yaw, is too steep to be left in any direction,
or is free: for every yaw, or for some. Where a slope or the room leaves only some directions of
travel, rays show them. Slopes are those that the wheels feel (Terrain.riding_surface).
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from planner.errors import MapError
from planner.power.model import PowerModel
from planner.power.sanity import steepest_slopes
from planner.power.vehicles import Vehicle
from planner.report.axes import Axes
from planner.report.markup import Markup, bullets, document, dot, element, figure, joined, paragraph
from planner.report.routes.relief_image import ground_colours
from planner.report.routes.relief_map import ground_axes, relief_map
from planner.terrain.heightmap import Terrain
from planner.terrain.obstacles import yaw_mask

MOST_MAPPED_CELLS = 4_000_000
"""Cells that are looked at; the rectangles of a larger map would take minutes."""
BODY_YAWS = 32
"""Yaws at which the body is tried, 5.6° apart: over half a turn, as a rectangle needs no more."""
RAYS = 16
"""Directions of driving over a full turn, as many as rays of a star; 22.5° apart."""
RAY_SPACING = 22.0
"""Pixels between the centres of rays."""
KINDS = {
    "blocked or unknown": "#475569",
    "no room for the body": "#b91c1c",
    "too steep": "#c2410c",
    "room for some yaws": "#f59e0b",
    "free": "#16a34a",
}
"""Kind of a cell → its colour, in the order of their numbers."""
_BLOCKED, _NO_ROOM, _STEEP, _SOME, _FREE = range(len(KINDS))
_LAYERED = (_NO_ROOM, _STEEP, _SOME)


def drive_page(terrain: Terrain, vehicle: Vehicle) -> tuple[str, dict[str, float]]:
    """The page, and the share of cells of each kind.

    Args:
        terrain: the map.
        vehicle: whose room and slopes are meant.

    Raises:
        MapError: the map has more than MOST_MAPPED_CELLS cells.
    """
    if terrain.heights.size > MOST_MAPPED_CELLS:
        raise MapError(
            "map",
            f"{terrain.name} has {terrain.heights.size:,} cells, too many for this picture",
            accepted=f"at most {MOST_MAPPED_CELLS:,} cells",
        )
    kinds, slopes, allowed = _looked_at(terrain, vehicle)
    shares = {name: float((kinds == number).mean()) for number, name in enumerate(KINDS)}
    ground = ground_axes(terrain.extent, 900)
    marks = joined(_overlay(kinds, ground), *_rays(terrain, ground, kinds, allowed))
    title = f"Where {vehicle.title or vehicle.name} can go on {terrain.name}"
    limits = "; ".join(
        f"{math.degrees(math.atan(slope)):.1f}° {name}" for name, slope in slopes.items()
    )
    legend = bullets(
        joined(dot(colour), f" {name}: {shares[name]:.1%} of the cells")
        for name, colour in KINDS.items()
    )
    body = joined(
        figure(relief_map(terrain, ground, marks, title)),
        legend,
        paragraph(
            "Rays point in the directions of travel that are left where not all are. Steepest "
            f"slopes that the drive, the traction and the wheel loads allow: {limits}."
        ),
    )
    return document(title, body), shares


def ground_layer(terrain: Terrain, vehicle: Vehicle, *, width: int = 720) -> Markup:
    """Where a vehicle cannot go, as a layer for ``whole_map``, with a legend of the ground.

    Free and blocked ground are left out: the relief shows them. A map with more than
    MOST_MAPPED_CELLS cells gets no layer.

    Args:
        terrain: the map.
        vehicle: whose room and slopes are meant.
        width: of that map, pixels.
    """
    colours = ground_colours(terrain)
    grounds = [joined(dot(c), name) for name, c in colours.items() if len(colours) > 1]
    if terrain.heights.size > MOST_MAPPED_CELLS:
        return joined(element("svg", element("g", kind="drivable")), bullets(grounds, "legend"))
    kinds = _looked_at(terrain, vehicle)[0]
    shown = [name for number, name in enumerate(KINDS) if number in _LAYERED]
    overlay = _overlay(kinds, ground_axes(terrain.extent, width), _LAYERED)
    entries = [
        joined(dot(KINDS[name]), name) for name in shown if (kinds == list(KINDS).index(name)).any()
    ]
    layer = element("svg", element("g", overlay, kind="drivable"))
    return joined(layer, bullets([*entries, *grounds], "legend"))


def _looked_at(
    terrain: Terrain, vehicle: Vehicle
) -> tuple[NDArray[np.uint8], dict[str, float], NDArray[np.bool_]]:
    """Kind of every cell, steepest slopes, and (RAYS, ny, nx) directions left."""
    blocked = terrain.blocked_cells(vehicle.step_height)
    half_length = 0.5 * vehicle.length + vehicle.limits.clearance
    half_width = 0.5 * vehicle.width + vehicle.limits.clearance
    mask = yaw_mask(
        np.ascontiguousarray(blocked), *terrain.cell, half_length, half_width, BODY_YAWS
    )
    fits = np.bitwise_count(mask)
    slopes = steepest_slopes(PowerModel.from_vehicle(vehicle))
    north, east = np.gradient(terrain.riding_surface(vehicle.half_footprint), *terrain.cell[::-1])
    angles = 2.0 * math.pi * np.arange(RAYS) / RAYS
    rise = np.cos(angles)[:, None, None] * east + np.sin(angles)[:, None, None] * north
    steep = np.hypot(east, north) > max(slopes.values())
    allowed = (rise <= slopes["up"]) & (-rise <= slopes["down"]) & (fits > 0) & ~steep
    kinds = np.full(blocked.shape, _FREE, np.uint8)
    kinds[fits < BODY_YAWS] = _SOME
    kinds[~allowed.any(axis=0)] = _STEEP
    kinds[fits == 0] = _NO_ROOM
    kinds[blocked] = _BLOCKED
    return kinds, slopes, allowed


def _overlay(
    kinds: NDArray[np.uint8], ground: Axes, shown: Collection[int] = range(len(KINDS))
) -> Any:
    """Colours of the cells of some kinds over the relief, half transparent."""
    colours = [
        (*bytes.fromhex(colour[1:]), 110 if number in shown else 0)
        for number, colour in enumerate(KINDS.values())
    ]
    step = max(1, math.ceil(max(kinds.shape) / 1200))
    picture = np.array(colours, np.uint8)[kinds[::step, ::step][::-1]]
    buffer = io.BytesIO()
    Image.fromarray(picture, "RGBA").save(buffer, "PNG", optimize=True)
    href = "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
    return element(
        "image", href=href, preserveAspectRatio="none", width=ground.width, height=ground.height
    )


def _rays(
    terrain: Terrain, ground: Axes, kinds: NDArray[np.uint8], allowed: NDArray[np.bool_]
) -> list[Any]:
    """Directions that are left, where not all of them are."""
    (x0, x1), (y0, y1) = ground.x_range, ground.y_range
    spacing = RAY_SPACING * (x1 - x0) / ground.width
    rays = []
    for y in np.arange(y0 + 0.5 * spacing, y1, spacing):
        for x in np.arange(x0 + 0.5 * spacing, x1, spacing):
            j, i = terrain.cell_index(float(x), float(y))
            here = allowed[:, j, i]
            if kinds[j, i] < _SOME or here.all():
                continue
            path = "".join(
                f"M{ground.x(x):.1f} {ground.y(y):.1f}"
                f"l{9 * math.cos(angle):.1f} {-9 * math.sin(angle):.1f}"
                for angle in 2.0 * math.pi * np.flatnonzero(here) / RAYS
            )
            rays.append(element("path", d=path, stroke="#111827", stroke_width=1, fill="none"))
    return rays
