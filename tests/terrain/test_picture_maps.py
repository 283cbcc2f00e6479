"""Pictures with a YAML file: floor plans as map_server writes them, heights as gray values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from planner.errors import MapError
from planner.terrain.formats import load_terrain
from planner.terrain.map_files import describe_map

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "terrain"
# Top row first: the picture's top is north. 0 is a wall, 254 is free, 205 is unknown.
PLAN = np.array(
    [[0, 0, 0, 0, 0], [0, 254, 254, 205, 0], [0, 254, 254, 254, 0], [0, 0, 0, 254, 0]], np.uint8
)
FLOOR = (
    "image: {}\nresolution: 0.05\norigin: [-10.0, -5.0, 0.0]\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n"
)
HEIGHTS = "image: map.png\nresolution: 0.04\norigin: [0, 0, 0]\nheight_max: 2.55\nunknown: 0\n"


def save(path: Path, pixels: NDArray[np.generic]) -> None:
    Image.fromarray(pixels).save(path)


@pytest.mark.parametrize("ending", ["png", "pgm"])
@pytest.mark.parametrize("given", ["picture", "description"])
def test_floor_plan(tmp_path: Path, ending: str, given: str) -> None:
    save(tmp_path / f"map.{ending}", PLAN)
    (tmp_path / "map.yaml").write_text(FLOOR.format(f"map.{ending}"))
    terrain = load_terrain(tmp_path / (f"map.{ending}" if given == "picture" else "map.yaml"))
    np.testing.assert_array_equal(terrain.obstacles, (PLAN == 0)[::-1])
    np.testing.assert_array_equal(terrain.known, (PLAN != 205)[::-1])
    assert not terrain.heights.any()
    assert terrain.cell == (0.05, 0.05)
    # map_server's origin is the corner of the lower left pixel; a node is its centre.
    assert terrain.origin == pytest.approx((-9.975, -4.975))
    assert terrain.extent[:2] == pytest.approx((-10.0, -5.0))


@pytest.mark.parametrize("threshold", ["0.25", "0.196"])
def test_unknown_ground_that_counts_as_floor_is_odd(tmp_path: Path, threshold: str) -> None:
    # map_saver of Nav2 writes 205 for unknown ground beside a threshold that makes it floor.
    save(tmp_path / "map.pgm", PLAN)
    (tmp_path / "map.yaml").write_text(FLOOR.format("map.pgm").replace("0.196", threshold))
    (tmp_path / "both.toml").write_text('plan = "map.yaml"\n')
    for name in ("map.yaml", "both.toml"):
        terrain = load_terrain(tmp_path / name)
        assert terrain.known.all() == (threshold == "0.25")
        found = " ".join([*terrain.odd, *describe_map(terrain)["odd"]])
        assert found.count("5 % of the floor plan is gray 205") == 2 * (threshold == "0.25")


def test_a_dark_floor_without_a_brighter_one_is_not_odd(tmp_path: Path) -> None:
    save(tmp_path / "map.pgm", np.where(PLAN == 0, 0, 205).astype(np.uint8))
    (tmp_path / "map.yaml").write_text(FLOOR.format("map.pgm").replace("0.196", "0.25"))
    assert load_terrain(tmp_path / "map.yaml").odd == ()


def test_negated_and_coloured_floor_plans_are_the_same_floor(tmp_path: Path) -> None:
    for name, pixels, negate in (
        ("plain", PLAN, 0),
        ("negated", 255 - PLAN, 1),
        ("coloured", np.repeat(PLAN[:, :, None], 3, axis=2), 0),
    ):
        save(tmp_path / f"{name}.png", pixels)
        text = FLOOR.format(f"{name}.png").replace("negate: 0", f"negate: {negate}")
        (tmp_path / f"{name}.yaml").write_text(text)
    prints = {
        load_terrain(tmp_path / f"{n}.yaml").fingerprint for n in ("plain", "negated", "coloured")
    }
    assert len(prints) == 1


def test_gray_values_are_heights(tmp_path: Path) -> None:
    gray = np.array([[10, 20, 30, 40], [0, 60, 70, 80], [5, 6, 7, 8], [255, 2, 3, 4]], np.uint8)
    save(tmp_path / "map.png", gray)
    (tmp_path / "map.yaml").write_text(HEIGHTS)
    terrain = load_terrain(tmp_path / "map.png")
    # 2.55 m over 255 steps: a centimetre a step.
    assert terrain.heights[0, 0] == pytest.approx(2.55)
    assert terrain.heights[3, 1] == pytest.approx(0.20)
    np.testing.assert_array_equal(terrain.known, gray[::-1] != 0)
    assert not terrain.obstacles.any()


def test_sixteen_bit_heights_with_a_lowest_and_a_scale(tmp_path: Path) -> None:
    gray = np.arange(20, dtype=np.uint16).reshape(4, 5) * 3000
    save(tmp_path / "map.png", gray)
    head = "image: map.png\nresolution: 0.04\norigin: [0, 0]\nheight_min: -1.0\n"
    (tmp_path / "map.yaml").write_text(head + "height_max: 5.5535\n")
    by_range = load_terrain(tmp_path / "map.yaml").heights
    (tmp_path / "map.yaml").write_text(head + "height_scale: 0.0001\n")
    by_step = load_terrain(tmp_path / "map.yaml").heights
    # (5.5535 + 1) / 65535 = 0.1 mm a step.
    np.testing.assert_allclose(by_range, by_step, atol=1e-9)
    assert by_step[3, 4] == pytest.approx(-1.0 + 4 * 0.3)


def test_a_picture_alone_is_told_what_its_yaml_must_hold(tmp_path: Path) -> None:
    save(tmp_path / "map.png", PLAN)
    with pytest.raises(MapError) as caught:
        load_terrain(tmp_path / "map.png")
    sentence = str(caught.value)
    for word in ("image: map.png", "resolution", "origin", "height_max", "occupied_thresh"):
        assert word in sentence


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("image: map.png", "image: /etc/hostname", "bad 'image'"),
        ("image: map.png", "image: ../map.png", "bad 'image'"),
        ("image: map.png", "image: other.png", "which is absent"),
        ("resolution: 0.04", "resolution: .nan", "bad 'resolution'"),
        ("resolution: 0.04", "resolution: 0", "bad 'resolution'"),
        ("resolution: 0.04\n", "", "no 'resolution'"),
        ("[0, 0, 0]", "[0, 0, 0.1]", "rotated"),
        ("[0, 0, 0]", "0", "bad 'origin'"),
        ("unknown: 0", "unknwon: 0", "unknown entry 'unknwon'"),
        ("unknown: 0", "negate: 0", "'height_max' and 'negate'"),
        ("height_max: 2.55", "height_max: 0", "white no higher than black"),
        ("height_max: 2.55\n", "", "how high white is"),
        ("image: map.png", "image: [", "is not YAML"),
        ("resolution: 0.04", f"resolution: {'1' * 400}", "bad 'resolution'"),
        ("resolution: 0.04", f"resolution: {'1' * 5000}", "is not YAML"),
        ("resolution: 0.04", f"resolution: 0x{'f' * 5000}", "bad 'resolution'"),
        ("resolution: 0.04", "resolution: 2026-13-45", "is not YAML"),
        ("[0, 0, 0]", f"[{'1' * 400}, 0, 0]", "bad 'origin'"),
        ("unknown: 0", f"? 0x{'f' * 5000}\n: 0", "unknown entry"),
        ("height_max: 2.55", "height_min: -1.0e+308\nheight_max: 1.0e+308", "finite scale"),
    ],
)
def test_bad_descriptions_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    save(tmp_path / "map.png", PLAN)
    (tmp_path / "map.yaml").write_text(HEIGHTS.replace(old, new))
    with pytest.raises(MapError) as caught:
        load_terrain(tmp_path / "map.yaml")
    assert words in str(caught.value)
    assert "map.yaml" in str(caught.value)


def test_too_large_and_cut_off_pictures_are_refused(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(HEIGHTS)
    save(tmp_path / "map.png", np.zeros((2000, 3000), np.uint8))
    with pytest.raises(MapError, match="6,000,000 cells"):
        load_terrain(tmp_path / "map.png", max_cells=5_000_000)
    save(tmp_path / "map.png", np.random.default_rng(0).integers(0, 255, (90, 90), np.uint8))
    content = (tmp_path / "map.png").read_bytes()
    (tmp_path / "map.png").write_bytes(content[: len(content) // 2])
    with pytest.raises(MapError, match="cut off"):
        load_terrain(tmp_path / "map.png")


def test_elevation_map_of_a_legged_robot(tmp_path: Path) -> None:
    picture = SHARED / "elevationMap_11_278cm.png"
    if not picture.is_file():
        pytest.skip("the elevation map of the legged robot is not on this machine")
    (tmp_path / "map.png").write_bytes(picture.read_bytes())
    (tmp_path / "map.yaml").write_text(HEIGHTS.replace("2.55", "2.78"))
    terrain = load_terrain(tmp_path / "map.yaml")
    assert terrain.heights.shape == (267, 267)
    assert terrain.heights.max() == pytest.approx(2.78)
    # 63 % of the picture is 0, that is: never seen.
    assert terrain.known.mean() == pytest.approx(0.37, abs=0.01)
