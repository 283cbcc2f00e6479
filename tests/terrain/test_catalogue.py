"""The catalogue: drawn maps byte for byte, checked when opened; Jacksboro on its place."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import maps
from maps import make_fixed_maps
from planner.errors import MapError
from planner.terrain.catalogue import list_maps, open_map
from planner.terrain.heightmap import Terrain
from planner.terrain.obstacles import yaw_mask

FIXED = Path(maps.__file__).parent / "fixed"
NAMES = [entry["name"] for entry in list_maps()]


def slope_degrees(terrain: Terrain) -> NDArray[np.float64]:
    gy, gx = np.gradient(terrain.heights, terrain.cell[1], terrain.cell[0])
    slope: NDArray[np.float64] = np.degrees(np.arctan(np.hypot(gx, gy)))
    return slope


def test_drawn_maps_are_regenerated_byte_for_byte(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_fixed_maps.main(tmp_path)
    drawn = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert drawn == {file.name: file.read_bytes() for file in FIXED.iterdir()}
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    listed = {entry["name"]: entry["sha256"] for entry in list_maps()}
    assert printed == {name: listed[name] for name in printed}


@pytest.mark.parametrize("name", NAMES)
def test_every_listed_map_opens_as_listed(name: str) -> None:
    entry = next(entry for entry in list_maps() if entry["name"] == name)
    terrain = open_map(name)
    assert terrain.name == name
    assert terrain.cell == pytest.approx(entry["cell"], rel=1e-4)
    xmin, ymin, xmax, ymax = terrain.extent
    assert (xmin, ymin) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert (xmax, ymax) == pytest.approx(entry["size"], rel=1e-4)
    assert all(entry[key] for key in ("title", "source", "licence", "crs"))


def test_a_changed_map_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    original = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: original(path) + b"\n")
    with pytest.raises(MapError, match=r"cone is not the map .* sha256"):
        open_map("cone")


@pytest.mark.parametrize("name", ["", "nowhere", "nowhere/dem.tif", "x" * 5000, "bad\0name"])
def test_unknown_names_are_told_what_there_is(name: str) -> None:
    with pytest.raises(MapError) as caught:
        open_map(name)
    assert caught.value.value == name
    assert all(known in str(caught.value) for known in NAMES)
    assert "or a path to a heightmap" in str(caught.value)


def test_a_path_opens_as_a_path() -> None:
    by_path, by_name = open_map(FIXED / "cone.asc"), open_map("cone")
    assert by_path.fingerprint == by_name.fingerprint


def test_bench_is_flat_up_flat_down_flat() -> None:
    terrain = open_map("test-bench")
    run, top = 4.0 * math.cos(math.radians(8.0)), 4.0 * math.sin(math.radians(8.0))
    for x, slope, height in (
        (1.0, 0.0, 0.0),
        (2.0 + run / 2, math.tan(math.radians(8.0)), top / 2),
        (3.0 + run, 0.0, top),
        (4.0 + 1.5 * run, -math.tan(math.radians(8.0)), top / 2),
        (13.0, 0.0, 0.0),
    ):
        for y in (0.2, 1.5, 2.8):
            assert terrain.height(x, y) == pytest.approx(height, abs=1e-4)
            gx, gy = terrain.gradient(x, y)
            assert gx == pytest.approx(slope, abs=3e-4)
            assert gy == pytest.approx(0.0, abs=1e-9)


def test_tilted_plane_cone_and_saddle_have_the_slopes_they_say() -> None:
    plane = open_map("tilted-plane")
    gx, gy = plane.gradient(*np.random.default_rng(0).uniform(1, 23, (2, 200)))
    np.testing.assert_allclose(np.degrees(np.arctan(np.hypot(gx, gy))), 5.0, atol=0.01)
    np.testing.assert_allclose(np.degrees(np.arctan2(gy, gx)), 30.0, atol=0.1)
    assert 11.0 < slope_degrees(open_map("cone")).max() < 12.2
    saddle = open_map("saddle")
    steepest = slope_degrees(saddle).max(axis=1)
    rows = (np.arange(160) + 0.5) * 0.25
    assert steepest[np.abs(rows - 20) < 0.5].max() < 11.0
    # Everywhere else the ridge is beyond what the robot climbs, 16 degrees.
    assert steepest[np.abs(rows - 20) > 4].min() > 16.0


def test_fractal_ground_is_mostly_but_not_everywhere_passable() -> None:
    slope = slope_degrees(open_map("fractal-512"))
    assert np.sqrt((np.tan(np.radians(slope)) ** 2).mean()) == pytest.approx(
        math.tan(math.radians(7.5)), rel=0.03
    )
    assert 0.001 < (slope > 16.4).mean() < 0.02


def test_warehouse_passage_dock_and_ground() -> None:
    terrain = open_map("warehouse")
    blocked = terrain.blocked_cells(0.03)
    # Half of 0.86 m x 0.52 m, with 5 cm of clearance.
    mask = yaw_mask(blocked, *terrain.cell, 0.48, 0.31, 32)
    through = [mask[terrain.cell_index(x, 9.45)] for x in (14.05, 14.75, 15.45)]
    assert all(int(bits) & 1 and not int(bits) >> 16 & 1 for bits in through)
    # The dock's edge blocks, the ramps lead up.
    assert blocked[terrain.cell_index(24.05, 9.0)]
    assert blocked[terrain.cell_index(23.95, 9.0)]
    assert terrain.height(28.0, 10.0) == pytest.approx(0.6)
    for y, angle in ((3.5, 5.0), (14.5, 8.0)):
        gx, _ = terrain.gradient(22.0, y)
        assert math.degrees(math.atan(gx)) == pytest.approx(angle, abs=0.02)
        assert not blocked[terrain.cell_index(24.0, y)]
    kinds = {
        name: terrain.ground_classes[terrain.ground[terrain.cell_index(x, y)]]
        for name, x, y in (("concrete", 1.0, 1.0), ("carpet", 20.0, 9.0), ("wet", 17.0, 18.0))
    }
    assert all(kind.name == name for name, kind in kinds.items())
    assert (kinds["carpet"].rolling, kinds["carpet"].traction) == (2.3, 0.9)
    assert (kinds["wet"].rolling, kinds["wet"].traction) == (1.0, 0.5)


def test_jacksboro_lies_where_its_landmarks_are() -> None:
    terrain = open_map("jacksboro")
    dx, dy = terrain.cell
    # One degree at 36.3 degrees north, from the usual series in cosines of the latitude:
    # 111132.95 - 559.85 cos 2p + 1.17 cos 4p along, 111412.88 cos p - 93.50 cos 3p across.
    p = math.radians(36.303)
    along = 111132.95 - 559.85 * math.cos(2 * p) + 1.17 * math.cos(4 * p)
    across = 111412.88 * math.cos(p) - 93.50 * math.cos(3 * p)
    assert (dx, dy) == pytest.approx((across / 1200, along / 1200), rel=1e-4)

    def at(latitude: float, longitude: float) -> tuple[float, float]:
        return (longitude + 84.41375) * 1200 * dx, (latitude - 36.44625 + 344 / 1200) * 1200 * dy

    # Cross Mountain, 1077 m, at 36 11' 54" N, 84 13' 50" W, is the highest point of the map.
    j, i = np.unravel_index(int(terrain.heights.argmax()), terrain.heights.shape)
    x, y = at(36 + 11 / 60 + 54 / 3600, -(84 + 13 / 60 + 50 / 3600))
    assert math.hypot(x - (i + 0.5) * dx, y - (j + 0.5) * dy) < 2 * dy
    assert terrain.height(x, y) == pytest.approx(1077, abs=15)
    # The town of Jacksboro (36.330 N, 84.184 W) lies in the valley, at about 330 m.
    assert terrain.height(*at(36.330, -84.184)) == pytest.approx(330, abs=25)


def test_jacksboro_reduced_has_the_same_slopes() -> None:
    full, small = open_map("jacksboro"), open_map("jacksboro-1to100")
    x, y = np.random.default_rng(0).uniform(1000, 30000, (2, 200))
    np.testing.assert_allclose(small.height(x / 100, y / 100), full.height(x, y) / 100)
    np.testing.assert_allclose(small.gradient(x / 100, y / 100), full.gradient(x, y), atol=1e-12)
