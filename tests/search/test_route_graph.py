"""Graphs of places and edges: what is read, and what is refused in one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from planner.errors import RequestError
from planner.search.route_graph import RouteGraph, read_graph
from tests.search.route_graphs import edge, graph, place

PLACES = [place(0, 1.0, 2.0), place(7, 3, 4)]


def collection(*features: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": list(features)}


def test_places_and_edges_are_found() -> None:
    line = edge(9, 0, 7, cost=3.0, overridable=True)
    line["geometry"] = {"type": "LineString", "coordinates": [[1, 2], [3, 4]]}
    found = RouteGraph.parse(collection(*PLACES, line, edge(12, 7, 0)))
    assert found.places == {0: (1.0, 2.0), 7: (3.0, 4.0)}
    assert [one.ends for one in found.edges] == [(0, 7), (7, 0)]
    assert [one.feature for one in found.edges] == [2, 3]


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ([], ("graph:", "FeatureCollection")),
        ({"features": {}}, ("graph:", "FeatureCollection")),
        (collection(), ("graph.features:", "no places")),
        (collection(*PLACES), ("graph.features:", "no edges")),
        (collection(7), ("features[0].geometry.type", "Point")),
        (collection({"geometry": {"type": "Polygon"}}), ("'Polygon'", "LineString")),
        (collection({"geometry": {"type": "Point"}}), ("features[0].properties", "id")),
        (collection(place(0, float("nan"), 1.0)), ("coordinates", "[x, y] in metres")),
        (collection(place(True, 1.0, 1.0)), ("properties.id", "True", "whole number")),
        (collection(place(-1, 1.0, 1.0)), ("properties.id", "-1", "whole number")),
        (collection(place(0, 1, 1), place(0, 2, 2)), ("features[1]", "given twice", "0")),
        (collection(*PLACES, edge(1, 0, 3)), ("features[2]", "endid", "3", "Point")),
        (collection(*PLACES, edge(1, 0, 0)), ("endid", "start as well")),
        (collection(*PLACES, edge(1, 0, 7), edge(1, 7, 0)), ("features[3]", "given twice")),
        (collection(*PLACES, edge(1, 0, 7, metadata=[2])), ("metadata", "[2]", "object")),
        (collection(*PLACES, edge(1, 0, 7, startid=None)), ("startid", "is missing")),
    ],
)
def test_what_no_graph_is_gets_one_sentence(document: Any, words: tuple[str, ...]) -> None:
    with pytest.raises(RequestError) as caught:
        RouteGraph.parse(document)
    sentence = str(caught.value)
    assert [word for word in words if word not in sentence] == []
    assert "\n" not in sentence


def test_places_in_two_frames_are_refused() -> None:
    other = place(1, 2.0, 2.0)
    other["properties"]["frame"] = "odom"
    with pytest.raises(RequestError, match=r"features\[1\].*frame.*'odom'"):
        RouteGraph.parse(collection(place(0, 1.0, 1.0), other, edge(2, 0, 1)))


@pytest.mark.parametrize(
    ("content", "problem"), [(None, "cannot be read"), (b"{", "not JSON"), (b"[1]", "JSON object")]
)
def test_a_file_without_a_graph(tmp_path: Path, content: bytes | None, problem: str) -> None:
    file = tmp_path / "nodes.geojson"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(RequestError, match=problem) as caught:
        read_graph(file)
    assert str(file) in str(caught.value)


def test_a_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "nodes.geojson"
    file.write_text('{"features": []}')
    assert read_graph(file) == {"features": []}
    assert graph([{"x": 1, "y": 2}], [])["features"][0] == place(0, 1, 2)
