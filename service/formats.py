"""Routes in the formats of other programs: GeoJSON, CSV and the shape of ROS 2's nav_msgs/Path.

    written(answer, "geojson")          # text

An answer without a route gives an empty document of the same shape. GeoJSON is in WGS 84 degrees,
as RFC 7946 asks, where the map has a coordinate reference system, and in the map's metres
otherwise; ``properties.crs`` says which.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from planner.errors import RequestError
from service.documents import route_document, strict

if TYPE_CHECKING:
    from planner.search.results import Answer, Route

COLUMNS = ("x", "y", "z", "yaw", "t", "speed", "energy_j")
"""Of a pose: m, m, m, rad, s since the start, m/s, J since the start."""
WGS_84 = "EPSG:4326"
FRAME = "map"
"""Frame of reference of a nav_msgs/Path: Nav2's name for the map's frame."""
NANOSECONDS = 1_000_000_000
"""In a second; ROS keeps times in both."""


def written(answer: Answer, name: str) -> str:
    """An answer as text.

    Args:
        answer: of ``plan_route``.
        name: one of FORMATS.

    Raises:
        RequestError: there is no such format.
    """
    if name not in FORMATS:
        raise RequestError(
            "format", "is not a format of routes", value=name, accepted=", ".join(FORMATS)
        )
    return FORMATS[name](answer)


def as_json(answer: Answer) -> str:
    """ROUTE.json."""
    return strict(route_document(answer.to_json()))


def as_csv(answer: Answer) -> str:
    """A line for each pose of each route; ``route`` 0 is the best, others are alternatives."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("route", *COLUMNS))
    for number, route in enumerate(answer.routes):
        lines.writerows((number, *pose) for pose in _poses(route))
    return text.getvalue()


def as_nav_path(answer: Answer) -> str:
    """The best route as a nav_msgs/Path in JSON.

    A pose's stamp is the time since the start. Its orientation is the yaw alone, as Nav2 plans in
    the plane; the height is z.
    """
    poses = _poses(answer.routes[0]) if answer.routes else ()
    stamped = [
        {
            "header": _header(t),
            "pose": {
                "position": {"x": x, "y": y, "z": z},
                "orientation": {
                    "x": 0.0,
                    "y": 0.0,
                    "z": math.sin(yaw / 2.0),
                    "w": math.cos(yaw / 2.0),
                },
            },
        }
        for x, y, z, yaw, t, _, _ in poses
    ]
    return strict({"header": _header(0.0), "poses": stamped})


def _header(seconds: float) -> dict[str, Any]:
    whole, rest = divmod(round(seconds * NANOSECONDS), NANOSECONDS)
    return {"stamp": {"sec": whole, "nanosec": rest}, "frame_id": FRAME}


def as_geojson(answer: Answer) -> str:
    """A FeatureCollection with one LineString for each route.

    What varies along a route stands in ``properties``, a number for each position.
    """
    crs = answer.terrain.crs
    features = [_feature(number, route, crs) for number, route in enumerate(answer.routes)]
    collection: dict[str, Any] = {
        "type": "FeatureCollection",
        "name": answer.terrain.name,
        "status": answer.status,
        "features": features,
    }
    if answer.reason is not None:
        collection["reason"] = answer.reason
    return strict(collection)


def _feature(number: int, route: Route, crs: str | None) -> dict[str, Any]:
    columns = {name: route.arrays[name].tolist() for name in COLUMNS}
    x, y = _in_wgs_84(columns["x"], columns["y"], crs)
    along = {name: columns[name] for name in ("yaw", "t", "speed", "energy_j")}
    return {
        "type": "Feature",
        "id": number,
        "geometry": {
            "type": "LineString",
            "coordinates": [list(place) for place in zip(x, y, columns["z"], strict=True)],
        },
        "properties": {
            "route": number,
            "crs": WGS_84 if crs else "local, metres",
            "map_crs": crs,
            "energy_j": route.energy_j,
            "duration_s": route.duration_s,
            "length_m": route.length_m,
            "along": along,
        },
    }


def _in_wgs_84(
    x: Sequence[float], y: Sequence[float], crs: str | None
) -> tuple[Sequence[float], Sequence[float]]:
    """Longitudes and latitudes, degrees; a local map's metres as they are."""
    if crs is None:
        return x, y
    from rasterio.warp import transform

    longitudes, latitudes = transform(crs, WGS_84, x, y)
    return longitudes, latitudes


def _poses(route: Route) -> Iterator[tuple[float, ...]]:
    yield from zip(*(route.arrays[name].tolist() for name in COLUMNS), strict=True)


FORMATS: Mapping[str, Callable[[Answer], str]] = {
    "json": as_json,
    "geojson": as_geojson,
    "csv": as_csv,
    "nav-path": as_nav_path,
}
ENDINGS: Mapping[str, str] = {".csv": "csv", ".geojson": "geojson"}
"""Ending of a file → format, where none is named; other files are ROUTE.json."""
MEDIA_TYPES: Mapping[str, str] = {
    "application/json": "json",
    "application/geo+json": "geojson",
    "text/csv": "csv",
    "application/vnd.joulepath.nav-path+json": "nav-path",
}
"""Media type → format, for ``Accept``."""


def accepted(header: str | None) -> tuple[str, str] | None:
    """Media type and format that an ``Accept`` header likes best; None if it accepts none.

    Among equally liked ones the first of MEDIA_TYPES wins, so ``*/*`` is JSON.
    """
    liked: dict[str, float] = {}
    for part in (header or "*/*").split(","):
        media, *parameters = (piece.strip().lower() for piece in part.split(";"))
        quality = next((p.removeprefix("q=") for p in parameters if p.startswith("q=")), "1")
        try:
            liked[media] = float(quality)
        except ValueError:
            liked[media] = 0.0
    best, most = None, 0.0
    for media in MEDIA_TYPES:
        ranges = (media, f"{media.partition('/')[0]}/*", "*/*")
        weight = next((liked[one] for one in ranges if one in liked), 0.0)
        if weight > most:
            best, most = (media, MEDIA_TYPES[media]), weight
    return best
