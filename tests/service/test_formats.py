"""Routes in other programs' formats: every one holds the same poses as ROUTE.json."""

import csv
import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rasterio.warp import transform

from planner.errors import RequestError
from planner.search.results import Answer
from service.formats import COLUMNS, MEDIA_TYPES, accepted, written
from tests.report import synthetic

UTM = "EPSG:32613"
EAST, NORTH = 500_000.0, 4_400_000.0


def turning() -> Answer:
    """The route of synthetic, turning left by 3 rad on the way; once more as an alternative."""
    made = synthetic.route()
    yaw = np.linspace(0.0, 3.0, len(made.arrays["x"]))
    turned = replace(made, arrays={**made.arrays, "yaw": yaw})
    return synthetic.answer(routes=(turned, made))


def surveyed() -> Answer:
    """The same in UTM zone 13."""
    answer = turning()
    moved = [
        replace(r, arrays={**r.arrays, "x": r.arrays["x"] + EAST, "y": r.arrays["y"] + NORTH})
        for r in answer.routes
    ]
    terrain = replace(answer.terrain, crs=UTM) if hasattr(answer.terrain, "__dict__") else None
    assert terrain is not None
    return replace(answer, routes=tuple(moved), terrain=terrain)


def nowhere() -> Answer:
    return replace(turning(), status="no_route", routes=(), reason="a wall at (3, 4)")


def poses(answer: Answer) -> list[dict[str, float]]:
    document: dict[str, Any] = json.loads(written(answer, "json"))
    found: list[dict[str, float]] = document["routes"][0]["poses"]
    return found


def test_csv_has_every_pose_of_every_route() -> None:
    lines = list(csv.DictReader(written(turning(), "csv").splitlines()))
    best = [line for line in lines if line["route"] == "0"]
    assert len(lines) == 2 * len(best)
    for line, pose in zip(best, poses(turning()), strict=True):
        assert {name: float(line[name]) for name in COLUMNS} == pose


def test_a_nav_path_stands_at_the_poses_and_points_along_the_yaw() -> None:
    path = json.loads(written(turning(), "nav-path"))
    assert path["header"]["frame_id"] == "map"
    for stamped, pose in zip(path["poses"], poses(turning()), strict=True):
        assert stamped["pose"]["position"] == {name: pose[name] for name in "xyz"}
        turn = stamped["pose"]["orientation"]
        assert (turn["x"], turn["y"]) == (0.0, 0.0)
        assert turn["z"] ** 2 + turn["w"] ** 2 == pytest.approx(1.0, abs=1e-12)
        # The quaternion turns the x axis into the direction of the yaw.
        direction = (1.0 - 2.0 * turn["z"] ** 2, 2.0 * turn["z"] * turn["w"])
        expected = (math.cos(pose["yaw"]), math.sin(pose["yaw"]))
        assert direction == pytest.approx(expected, abs=1e-12)
        stamp = stamped["header"]["stamp"]
        assert 0 <= stamp["nanosec"] < 1_000_000_000
        assert stamp["sec"] + 1e-9 * stamp["nanosec"] == pytest.approx(pose["t"], abs=1e-9)


def test_geojson_of_a_local_map_is_in_its_metres_and_says_so() -> None:
    collection = json.loads(written(turning(), "geojson"))
    best, other = collection["features"]
    assert [best["id"], other["id"]] == [0, 1]
    assert best["geometry"]["type"] == "LineString"
    expected = [[pose[name] for name in "xyz"] for pose in poses(turning())]
    assert best["geometry"]["coordinates"] == expected
    assert best["properties"]["crs"] == "local, metres"
    assert best["properties"]["map_crs"] is None
    for name, values in best["properties"]["along"].items():
        assert values == [pose[name] for pose in poses(turning())]


def test_geojson_of_a_surveyed_map_is_in_wgs_84() -> None:
    best = json.loads(written(surveyed(), "geojson"))["features"][0]
    assert (best["properties"]["crs"], best["properties"]["map_crs"]) == ("EPSG:4326", UTM)
    longitudes, latitudes, _ = zip(*best["geometry"]["coordinates"], strict=True)
    # Zone 13 has its central meridian at 105° west, where its x is 500 km.
    assert longitudes[0] == pytest.approx(-105.0, abs=1e-4)
    assert 39.0 < latitudes[0] < 40.0
    x, _ = transform("EPSG:4326", UTM, longitudes, latitudes)
    assert x == pytest.approx([pose["x"] for pose in poses(surveyed())], abs=1e-3)


def test_no_route_is_an_empty_document() -> None:
    collection = json.loads(written(nowhere(), "geojson"))
    assert (collection["features"], collection["reason"]) == ([], "a wall at (3, 4)")
    assert json.loads(written(nowhere(), "nav-path"))["poses"] == []
    assert written(nowhere(), "csv").splitlines() == [",".join(("route", *COLUMNS))]


def test_another_format_is_refused_with_those_there_are() -> None:
    with pytest.raises(RequestError, match="accepted: json, geojson, csv, nav-path"):
        written(turning(), "kml")


@pytest.mark.parametrize(
    ("header", "format_"),
    [
        (None, "json"),
        ("*/*", "json"),
        ("text/html,application/xhtml+xml,*/*;q=0.8", "json"),
        ("text/csv", "csv"),
        ("text/*", "csv"),
        ("application/geo+json; charset=utf-8", "geojson"),
        ("application/json;q=0.5, application/geo+json", "geojson"),
        ("application/json;q=0.5, text/csv;q=0.6, */*;q=0.1", "csv"),
        ("application/json;q=0, application/*", "geojson"),
        ("application/vnd.joulepath.nav-path+json", "nav-path"),
    ],
)
def test_accept_chooses_the_format(header: str | None, format_: str) -> None:
    best = accepted(header)
    assert best is not None
    assert best[1] == format_ == MEDIA_TYPES[best[0]]


@pytest.mark.parametrize("header", ["image/png", "application/json;q=0", "text/csv;q=many", ";"])
def test_accept_that_no_format_meets(header: str) -> None:
    assert accepted(header) is None
