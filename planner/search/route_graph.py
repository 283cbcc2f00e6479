"""A graph of places and edges, as Nav2's route server reads it from GeoJSON.

    graph = RouteGraph.parse(read_graph("nodes.geojson"))
    graph.places[3], graph.edges[0].start

A FeatureCollection holds a Point for each place, with ``properties`` ``id`` and perhaps ``frame``,
and a LineString or MultiLineString for each edge, with ``id``, ``startid`` and ``endid``. An edge
leads one way. The route server draws it straight, whatever its coordinates say. Coordinates are
metres in the map's frame, also where the collection names a ``crs``.

Reading and checking load neither numpy nor numba.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from planner.errors import RequestError
from planner.reading import finite_number
from planner.search.requests import SituationRequest

LINES = ("LineString", "MultiLineString")
COLLECTION = "a GeoJSON FeatureCollection of Points and LineStrings, as Nav2's route server reads"
MOST_ID = 2**32 - 1
"""The route server keeps ids as unsigned numbers of 32 bits."""


class GraphRequest(SituationRequest):
    """The energy of every edge of a graph, in both directions."""

    graph: dict[str, Any] = Field(
        description=COLLECTION,
        examples=[
            {
                "type": "FeatureCollection",
                "features": [
                    {
                        "type": "Feature",
                        "properties": {"id": id_, "frame": "map"},
                        "geometry": {"type": "Point", "coordinates": place},
                    }
                    for id_, place in enumerate(([1.5, 2.0], [1.5, 8.0]))
                ]
                + [
                    {
                        "type": "Feature",
                        "properties": {"id": 2, "startid": 0, "endid": 1},
                        "geometry": {"type": "LineString", "coordinates": [[1.5, 2.0], [1.5, 8.0]]},
                    }
                ],
            }
        ],
    )
    corridor_m: float | None = Field(
        default=None,
        gt=0,
        le=1e9,
        strict=True,
        description="m from the straight edge within which its route runs, above 0 up to 1e9; left "
        "out, anywhere",
    )
    objective: Literal["energy", "time", "length"] = Field(
        default="energy", description='what to minimise: "energy", "time" or "length"'
    )
    add_opposite: bool = False
    """true adds the opposite of every edge that has none"""


@dataclass(frozen=True)
class Edge:
    """One edge, from a place to another.

    Attributes:
        feature: its number among the features.
        id, start, end: ids as in the file.
    """

    feature: int
    id: int
    start: int
    end: int

    @property
    def ends(self) -> tuple[int, int]:
        """Ids of the places where it starts and ends."""
        return self.start, self.end


@dataclass(frozen=True)
class RouteGraph:
    """A graph that was checked.

    Attributes:
        document: as it was read.
        places: x, y in m by id.
        edges: in the order of the file.
    """

    document: Mapping[str, Any]
    places: Mapping[int, tuple[float, float]]
    edges: tuple[Edge, ...]

    @classmethod
    def parse(cls, document: Any) -> Self:
        """Check a graph.

        Raises:
            RequestError: the first feature that cannot be used.
        """
        features = document.get("features") if isinstance(document, Mapping) else None
        if not isinstance(features, list | tuple):
            raise RequestError("graph", "is no collection of features", accepted=COLLECTION)
        places: dict[int, tuple[float, float]] = {}
        frames: dict[str, int] = {}
        lines: list[tuple[int, Mapping[str, Any]]] = []
        for number, feature in enumerate(features):
            kind, properties = _kind(number, feature), _properties(number, feature)
            if kind == "Point":
                id_ = _id(number, properties, "id")
                if id_ in places:
                    raise _wrong(number, "id", "is given twice", id_, "a place's own number")
                places[id_] = _place(number, feature["geometry"])
                frames.setdefault(str(properties.get("frame", "")), number)
            else:
                lines.append((number, properties))
        if len(frames) > 1:
            frame, number = list(frames.items())[1]
            accepted = "the map's frame for all places"
            raise _wrong(number, "frame", "differs from another place's", frame, accepted)
        edges = tuple(_edge(number, properties, places) for number, properties in lines)
        if not edges:
            missing = "places" if not places else "edges"
            raise RequestError("graph.features", f"hold no {missing}", accepted=COLLECTION)
        known: set[int] = set()
        for edge in edges:
            if edge.id in known:
                raise _wrong(edge.feature, "id", "is given twice", edge.id, "an edge's own number")
            known.add(edge.id)
        return cls(document, places, edges)


def read_graph(path: str | PathLike[str]) -> dict[str, Any]:
    """A graph's GeoJSON.

    Raises:
        RequestError: the file cannot be read or is not a JSON object.
    """
    name = str(path)
    try:
        document = json.loads(Path(path).read_bytes())
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}"
        raise RequestError(name, problem, accepted="the path of a graph.geojson") from None
    except (ValueError, RecursionError):
        raise RequestError(name, "is not JSON", accepted=COLLECTION) from None
    if not isinstance(document, dict):
        raise RequestError(name, "is not a JSON object", accepted=COLLECTION)
    return document


def _kind(number: int, feature: Any) -> str:
    """Type of a feature's geometry."""
    geometry = feature.get("geometry") if isinstance(feature, Mapping) else None
    kind = geometry.get("type") if isinstance(geometry, Mapping) else None
    if kind not in ("Point", *LINES):
        where = f"graph.features[{number}].geometry.type"
        accepted = f"Point for a place, {' or '.join(LINES)} for an edge"
        raise RequestError(where, "is none that a graph has", value=kind, accepted=accepted)
    return str(kind)


def _properties(number: int, feature: Mapping[str, Any]) -> Mapping[str, Any]:
    """A feature's properties, with metadata that an energy can be put into."""
    properties = feature.get("properties")
    if not isinstance(properties, Mapping):
        where = f"graph.features[{number}].properties"
        raise RequestError(where, "are missing", accepted="an object with id")
    if not isinstance(properties.get("metadata", {}), Mapping):
        given = properties["metadata"]
        raise _wrong(number, "metadata", "is not an object", given, "an object, or none")
    return properties


def _id(number: int, properties: Mapping[str, Any], key: str) -> int:
    """An id, as the route server can keep it."""
    value = properties.get(key)
    accepted = f"a whole number from 0 to {MOST_ID}"
    if value is None:
        raise _wrong(number, key, "is missing", None, accepted)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_ID:
        raise _wrong(number, key, "is not an id", value, accepted)
    return value


def _place(number: int, geometry: Mapping[str, Any]) -> tuple[float, float]:
    """Coordinates of a place, m."""
    given = geometry.get("coordinates")
    pair = given[:2] if isinstance(given, list | tuple) else []
    x, y = (finite_number(value) for value in (*pair, None, None)[:2])
    if x is None or y is None:
        where = f"graph.features[{number}].geometry.coordinates"
        accepted = "[x, y] in metres in the map's frame"
        raise RequestError(where, "are not a place", value=given, accepted=accepted)
    return x, y


def _edge(number: int, properties: Mapping[str, Any], places: Mapping[int, Any]) -> Edge:
    """An edge between places that are there."""
    id_, start, end = (_id(number, properties, key) for key in ("id", "startid", "endid"))
    for key, place in (("startid", start), ("endid", end)):
        if place not in places:
            raise _wrong(number, key, "is no place's id", place, "the id of a Point of the graph")
    if start == end:
        raise _wrong(number, "endid", "is the start as well", end, "another place's id")
    return Edge(number, id_, start, end)


def _wrong(number: int, key: str, problem: str, value: Any, accepted: str) -> RequestError:
    where = f"graph.features[{number}].properties.{key}"
    return RequestError(where, problem, value=value, accepted=accepted)
