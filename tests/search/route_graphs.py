"""Graphs of places and edges in the GeoJSON that Nav2's route server reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

Feature = dict[str, Any]


def place(id_: int, x: float, y: float) -> Feature:
    """A place."""
    geometry = {"type": "Point", "coordinates": [x, y]}
    return {"type": "Feature", "properties": {"id": id_, "frame": "map"}, "geometry": geometry}


def edge(id_: int, start: int, end: int, **properties: Any) -> Feature:
    """An edge without coordinates, as the route server's own samples have them."""
    ends = {"id": id_, "startid": start, "endid": end}
    geometry = {"type": "MultiLineString"}
    return {"type": "Feature", "properties": {**ends, **properties}, "geometry": geometry}


def graph(
    places: Iterable[Mapping[str, float]], edges: Iterable[tuple[int, int]]
) -> dict[str, Any]:
    """Places with the ids 0, 1, … and edges between them, with ids from 100 on."""
    nodes = [place(id_, one["x"], one["y"]) for id_, one in enumerate(places)]
    lines = [edge(100 + number, *ends) for number, ends in enumerate(edges)]
    return {"type": "FeatureCollection", "name": "graph", "features": [*nodes, *lines]}
