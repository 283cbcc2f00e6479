"""A floor plan with heights, ramps and ground beside it is one map; what misfits is said."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from planner.errors import MapError
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain
from planner.terrain.map_files import describe_map

NX, NY, CELL = 40, 20, 0.25  # 10 m by 5 m


def polygon(corners: list[list[float]], **properties: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
    }


def collection(*features: dict[str, Any]) -> str:
    return json.dumps({"type": "FeatureCollection", "features": list(features)})


RAMP = polygon([[4, 1, 0.0], [6, 1, 0.2], [6, 3, 0.2], [4, 3, 0.0]])
PLATFORM = polygon([[6, 1], [8, 1], [8, 3], [6, 3]], height=0.2)
CARPET = polygon([[1, 1], [3, 1], [3, 4], [1, 4]], ground="carpet")


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A folder with a floor plan, a tilted survey that is larger, ramps and ground."""
    gray = np.full((NY, NX), 254, np.uint8)
    gray[0], gray[:, 0] = 0, 0  # walls in the north and the west
    gray[-1, -4:] = 205  # unknown in the south-east
    Image.fromarray(gray).save(tmp_path / "floor.png")
    (tmp_path / "floor.yaml").write_text(
        f"image: floor.png\nresolution: {CELL}\norigin: [0, 0, 0]\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n"
    )
    # 1 m cells from (-2, -2) on, z = 0.05·x - 0.02·y.
    x, y = np.meshgrid(-1.5 + np.arange(15.0), -1.5 + np.arange(10.0))
    np.save(tmp_path / "survey.npy", 0.05 * x - 0.02 * y)
    (tmp_path / "survey.toml").write_text("cell = [1.0, 1.0]\norigin = [-1.5, -1.5]\n")
    (tmp_path / "ramps.geojson").write_text(collection(RAMP, PLATFORM))
    (tmp_path / "ground.geojson").write_text(collection(CARPET))
    return tmp_path


def write(hall: Path, text: str) -> Terrain:
    (hall / "map.toml").write_text(text)
    return open_map(str(hall))


def test_heights_lie_under_the_plan(hall: Path) -> None:
    terrain = write(hall, 'plan = "floor.yaml"\nheights = "survey.npy"\n')
    assert terrain.heights.shape == (NY, NX)
    assert terrain.extent == (0.0, 0.0, NX * CELL, NY * CELL)
    for x, y in ((1.0, 1.0), (5.3, 2.2), (9.1, 4.4)):
        assert terrain.height(x, y) == pytest.approx(0.05 * x - 0.02 * y, abs=1e-9)
    assert terrain.obstacles[-1].all()
    assert terrain.obstacles[:, 0].all()
    assert not terrain.known[0, -4:].any()
    assert terrain.name == hall.name
    assert open_map(str(hall / "map.toml")).fingerprint == terrain.fingerprint


def test_a_second_picture_gives_heights(hall: Path) -> None:
    gray = np.tile(np.arange(NX, dtype=np.uint8), (NY, 1))
    Image.fromarray(gray).save(hall / "relief.png")
    (hall / "relief.yaml").write_text(
        f"image: relief.png\nresolution: {CELL}\norigin: [0, 0, 0]\nheight_scale: 0.01\n"
    )
    terrain = write(hall, 'plan = "floor.yaml"\nheights = "relief.yaml"\n')
    # 1 cm a cell of 25 cm.
    assert terrain.gradient(5.0, 2.5)[0] == pytest.approx(0.04, abs=1e-9)


def test_ground_beyond_the_heights_is_unknown(hall: Path) -> None:
    (hall / "survey.toml").write_text("cell = [1.0, 1.0]\norigin = [3.5, -1.5]\n")
    terrain = write(hall, 'plan = "floor.yaml"\nheights = "survey.npy"\n')
    assert not terrain.known[5, : int(3.0 / CELL)].any()
    assert terrain.known[5, int(3.0 / CELL) : -4].all()


def test_ramps_are_planes(hall: Path) -> None:
    terrain = write(hall, 'plan = "floor.yaml"\nramps = "ramps.geojson"\n')
    slope = math.degrees(math.atan(terrain.gradient(5.0, 2.0)[0]))
    assert slope == pytest.approx(math.degrees(math.atan(0.1)), abs=1e-6)
    assert terrain.height(7.0, 2.0) == pytest.approx(0.2)
    assert terrain.height(2.0, 2.0) == pytest.approx(0.0)


def test_ground_as_polygons_and_as_a_picture(hall: Path) -> None:
    polygons = write(
        hall,
        'plan = "floor.yaml"\nground = "ground.geojson"\n[factors.carpet]\nrolling = 2.3\n',
    )
    kinds = polygons.ground_classes
    j, i = polygons.cell_index(2.0, 2.0)
    assert kinds[polygons.ground[j, i]].name == "carpet"
    assert kinds[polygons.ground[j, i]].rolling == 2.3
    assert (polygons.ground > 0).sum() == round(2.0 * 3.0 / CELL**2)
    picture = np.zeros((NY, NX, 3), np.uint8)
    picture[::-1][polygons.ground > 0] = (255, 0, 0)
    Image.fromarray(picture).save(hall / "ground.png")
    drawn = write(
        hall,
        'plan = "floor.yaml"\nground = "ground.png"\n'
        '[colours]\n"#000000" = "concrete"\n"#ff0000" = "carpet"\n',
    )
    names = [drawn.ground_classes[k].name for k in (drawn.ground[j, i], drawn.ground[0, 5])]
    assert names == ["carpet", "concrete"]


def test_obstacles_and_holes_may_be_polygons(hall: Path) -> None:
    pillar = polygon([[5, 2], [5.5, 2], [5.5, 2.5], [5, 2.5]], ground="obstacle")
    pit = polygon([[7, 2], [7.5, 2], [7.5, 2.5], [7, 2.5]], ground="hole")
    (hall / "ground.geojson").write_text(collection(pillar, pit))
    terrain = write(hall, 'plan = "floor.yaml"\nground = "ground.geojson"\n')
    assert terrain.obstacles[terrain.cell_index(5.2, 2.2)]
    assert not terrain.known[terrain.cell_index(7.2, 2.2)]


def test_figures_of_a_map(hall: Path) -> None:
    report = describe_map(write(hall, 'plan = "floor.yaml"\nheights = "survey.npy"\n'))
    assert report["cells"] == [NX, NY]
    assert report["obstacles_share"] == pytest.approx((NX + NY - 1) / (NX * NY))
    assert report["unknown_share"] == pytest.approx(4 / (NX * NY))
    assert report["slopes"]["steepest_deg"] == pytest.approx(
        math.degrees(math.atan(math.hypot(0.05, 0.02)))
    )
    assert report["slopes"]["share_steeper_than_deg"]["5"] == 0.0
    assert report["ground_shares"] == {"ground": 1.0}


@pytest.mark.parametrize(
    ("files", "text", "words"),
    [
        ({}, "# nothing\n", ["neither a plan nor heights"]),
        ({}, 'plan = "floor.yaml"\nheight = "x"\n', ["unknown entry 'height'"]),
        ({}, 'plan = "absent.yaml"\n', ["absent.yaml", "absent"]),
        ({}, 'plan = "/etc/passwd"\n', ["bad 'plan'"]),
        ({}, 'plan = "../floor.yaml"\n', ["bad 'plan'"]),
        ({}, 'plan = "map.toml"\n', ["names another map file"]),
        ({}, "plan = 3\n", ["bad 'plan'"]),
        ({}, "plan = [", ["not TOML"]),
        ({"floor.yaml": "image: [\n"}, 'plan = "floor.yaml"\n', ["floor.yaml", "not YAML"]),
        (
            {"survey.toml": "cell = [1.0, 1.0]\norigin = [431000.0, 4070000.0]\n"},
            'plan = "floor.yaml"\nheights = "survey.npy"\n',
            ["cover 0% of the plan's floor", "431000", "one frame of metres"],
        ),
        (
            {"ramps.geojson": "{"},
            'plan = "floor.yaml"\nramps = "ramps.geojson"\n',
            ["ramps.geojson", "not JSON"],
        ),
        (
            {"ramps.geojson": '{"type": "Topology"}'},
            'plan = "floor.yaml"\nramps = "ramps.geojson"\n',
            ["not GeoJSON"],
        ),
        (
            {"ramps.geojson": collection(polygon([[4, 1], [6, 1], [6, 3]]))},
            'plan = "floor.yaml"\nramps = "ramps.geojson"\n',
            ["polygon 1", "without heights", "[x, y, z]"],
        ),
        (
            {"ramps.geojson": collection(polygon([[4, 1, 0], [6, 1, 1], [6, 3, 0], [4, 3, 1]]))},
            'plan = "floor.yaml"\nramps = "ramps.geojson"\n',
            ["polygon 1", "0.5 m off a plane"],
        ),
        (
            {"ground.geojson": collection(polygon([[400, 1], [600, 1], [600, 3]], ground="mud"))},
            'plan = "floor.yaml"\nground = "ground.geojson"\n',
            ["polygon 1 outside the map"],
        ),
        (
            {"ground.geojson": collection(polygon([[4, 1], [6, 1], [6, 3]], kind="mud"))},
            'plan = "floor.yaml"\nground = "ground.geojson"\n',
            ["without a property 'ground'"],
        ),
        (
            {"ground.geojson": collection(polygon([[4, 1], [6, math.nan], [6, 3]], ground="mud"))},
            'plan = "floor.yaml"\nground = "ground.geojson"\n',
            ["polygon 1", "no number"],
        ),
        (
            {},
            'plan = "floor.yaml"\nground = "ground.geojson"\n[factors.mud]\nrolling = 2\n',
            ["[factors]", "not drawn", "carpet"],
        ),
        (
            {},
            'plan = "floor.yaml"\nground = "floor.png"\n',
            ["no [colours]"],
        ),
        (
            {},
            'plan = "floor.yaml"\nground = "floor.png"\n[colours]\n"#000000" = "wall"\n',
            ["the colour #cdcdcd"],
        ),
        ({}, 'plan = "floor.yaml"\ncrs = "EPSG:4326"\n', ["degrees"]),
    ],
)
def test_one_sentence_for_what_misfits(
    hall: Path, files: dict[str, str], text: str, words: list[str]
) -> None:
    for name, content in files.items():
        (hall / name).write_text(content)
    with pytest.raises(MapError) as caught:
        write(hall, text)
    sentence = str(caught.value)
    assert "\n" not in sentence
    for word in ("accepted:", *words):
        assert word in sentence


def test_a_folder_without_a_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"is a folder.*map\.toml"):
        open_map(str(tmp_path))
