"""ESRI ASCII, NumPy arrays and drawn layers: read back what was written, refuse the rest."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from planner.errors import MapError
from planner.terrain import GroundClass, load_terrain

HEADER = "ncols 5\nnrows 4\nxllcorner 100\nyllcorner 200\ncellsize 2\n"
# North row first, as the format has it: 20 is the south-west cell.
ROWS = "50 51 52 53 54\n40 41 42 43 44\n30 31 32 33 34\n20 21 22 23 24\n"
SOUTH_FIRST = np.array([[20, 21, 22, 23, 24], [30, 31, 32, 33, 34], [40, 41, 42, 43, 44]]).astype(
    float
)

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "terrain"


def write(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


def test_ascii_rows_become_south_first_and_corners_become_centres(tmp_path: Path) -> None:
    terrain = load_terrain(write(tmp_path / "dem.asc", HEADER + ROWS))
    np.testing.assert_array_equal(terrain.heights[:3], SOUTH_FIRST)
    assert terrain.origin == (101.0, 201.0)
    assert terrain.cell == (2.0, 2.0)
    assert terrain.extent == (100.0, 200.0, 110.0, 208.0)
    assert terrain.crs is None
    assert terrain.name == "dem"
    assert terrain.height(101.0, 201.0) == pytest.approx(20.0)


@pytest.mark.parametrize(
    "text",
    [
        (HEADER + ROWS).replace("\n", "\r\n"),
        (HEADER + ROWS).upper(),
        HEADER.replace("corner 1", "center 1")
        .replace("corner 2", "center 2")
        .replace("00\n", "01\n")
        + ROWS,
        HEADER.replace("cellsize 2", "dx 2\ndy 2") + ROWS,
        HEADER + "NODATA_value -1\n" + ROWS.replace("\n", " "),
        "\n".join(reversed(HEADER.strip().split("\n"))) + "\n" + ROWS,
    ],
    ids=["CRLF", "upper case", "centres", "dx and dy", "one line", "other order"],
)
def test_ascii_dialects_give_the_same_ground(tmp_path: Path, text: str) -> None:
    plain = load_terrain(write(tmp_path / "plain.asc", HEADER + ROWS))
    assert load_terrain(write(tmp_path / "other.asc", text)).fingerprint == plain.fingerprint


def test_ascii_cells_need_not_be_square(tmp_path: Path) -> None:
    text = HEADER.replace("cellsize 2", "dx 2\ndy 5") + ROWS
    terrain = load_terrain(write(tmp_path / "dem.asc", text))
    assert (terrain.cell, terrain.origin) == ((2.0, 5.0), (101.0, 202.5))


@pytest.mark.parametrize(
    ("line", "mark"), [("", "-9999"), ("NODATA_value 1e31\n", "1e31"), ("", "nan")]
)
def test_ascii_nodata_is_a_hole(tmp_path: Path, line: str, mark: str) -> None:
    text = HEADER + line + ROWS.replace("41", mark)
    terrain = load_terrain(write(tmp_path / "dem.asc", text))
    assert not terrain.known[2, 1]
    assert terrain.known.sum() == 19
    assert np.isfinite(terrain.heights).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER + ROWS[:-4], "holds 19 heights, its header says 20"),
        (HEADER + ROWS + "1 2", "holds 22 heights, its header says 20"),
        (HEADER + "1 2 3", "fewer heights"),
        (HEADER.replace("5\n", "5000\n").replace("4\n", "4000\n") + ROWS, "fewer heights"),
        (HEADER.replace("5\n", "90000\n").replace("4\n", "90000\n") + ROWS, "8,100,000,000 cells"),
        (HEADER + ROWS.replace("31", "4x"), "'4x'"),
        (HEADER + ROWS.replace("31", "3,1"), "'3,1'"),
        (HEADER.replace("cellsize 2\n", "") + ROWS, "no cellsize"),
        (HEADER.replace("cellsize 2", "cellsize 0") + ROWS, "bad cellsize"),
        (HEADER.replace("ncols 5", "ncols") + ROWS, "'ncols' without one number"),
        (HEADER.replace("ncols 5", "ncols 4.5") + ROWS, "bad ncols"),
        (HEADER.replace("cellsize 2", "cellsize 0.000833") + ROWS, "gdalwarp -s_srs EPSG:4326"),
        (HEADER + ROWS.replace("31", "-3.4e38"), "nodata value that it does not declare"),
        (ROWS, "does not begin with an ESRI ASCII header"),
        ("x,y,z\n1,2,3\n", "does not begin with an ESRI ASCII header"),
        ("", "is empty"),
    ],
)
def test_bad_ascii_is_refused_in_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(MapError) as caught:
        load_terrain(write(tmp_path / "dem.asc", text))
    assert words in str(caught.value)
    assert "dem.asc" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "shape", "known", "lowest", "highest"),
    [
        # Counted and read off the files' text with awk.
        ("bijou_gully_5m.asc", (77, 105), 77 * 105, 1673.068, 1729.865),
        ("hugo_site_10m.asc", (55, 76), 2152, 1660.0, 1711.0),
        ("kootenai_1m.asc", (37, 50), 37 * 50, 537.360, 543.810),
    ],
)
def test_surveyed_ground(
    name: str, shape: tuple[int, int], known: int, lowest: float, highest: float
) -> None:
    if not (SHARED / name).is_file():
        pytest.skip(f"the surveyed ground {name} is not on this machine")
    terrain = load_terrain(SHARED / name)
    assert terrain.heights.shape == shape
    assert terrain.known.sum() == known
    assert terrain.heights.min() == pytest.approx(lowest, abs=1e-3)
    assert terrain.heights.max() == pytest.approx(highest, abs=1e-3)


def test_npz_with_everything_comes_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    z = rng.normal(size=(6, 7))
    known, obstacles = rng.random((6, 7)) > 0.2, rng.random((6, 7)) > 0.8
    ground = rng.integers(0, 2, (6, 7))
    np.savez_compressed(
        tmp_path / "map.npz",
        heights=z,
        known=known,
        obstacles=obstacles,
        ground=ground,
        ground_classes=np.array(["floor", "carpet"]),
        ground_factors=np.array([[1.0, 1.0], [2.3, 0.9]]),
        cell=np.array([0.5, 0.25]),
        origin=np.array([-3.0, 4.0]),
        crs=np.array("EPSG:32613"),
    )
    terrain = load_terrain(tmp_path / "map.npz")
    np.testing.assert_array_equal(terrain.heights[known], z[known])
    np.testing.assert_array_equal(terrain.known, known)
    np.testing.assert_array_equal(terrain.obstacles, obstacles)
    np.testing.assert_array_equal(terrain.ground, ground)
    assert terrain.ground_classes == (GroundClass("floor"), GroundClass("carpet", 2.3, 0.9))
    assert (terrain.cell, terrain.origin, terrain.crs) == ((0.5, 0.25), (-3.0, 4.0), "EPSG:32613")


def test_npz_of_an_elevation_model_has_its_north_row_first(tmp_path: Path) -> None:
    z = np.arange(20.0).reshape(4, 5)
    np.savez(tmp_path / "dem.npz", elevation=z, dx=2.0, dy=3.0)
    terrain = load_terrain(tmp_path / "dem.npz")
    np.testing.assert_array_equal(terrain.heights, z[::-1])
    assert terrain.cell == (2.0, 3.0)


def test_npy_takes_its_cells_from_a_toml(tmp_path: Path) -> None:
    z = np.arange(20, dtype=np.int16).reshape(4, 5)
    np.save(tmp_path / "dem.npy", np.asfortranarray(z))
    with pytest.raises(MapError, match=r"dem\.toml beside it with: cell = "):
        load_terrain(tmp_path / "dem.npy")
    write(tmp_path / "dem.toml", f"cell = [2, {'1' * 400}]\n")
    with pytest.raises(MapError, match=r"dem\.toml has a bad 'cell'"):
        load_terrain(tmp_path / "dem.npy")
    write(tmp_path / "dem.toml", "cell = [2, 3]\norigin = [7.0, 8.0]\n")
    terrain = load_terrain(tmp_path / "dem.npy")
    np.testing.assert_array_equal(terrain.heights, z)
    assert (terrain.cell, terrain.origin) == ((2.0, 3.0), (7.0, 8.0))
    write(tmp_path / "dem.toml", 'cell = 2\nfirst_row = "north"\n')
    np.testing.assert_array_equal(load_terrain(tmp_path / "dem.npy").heights, z[::-1])


def npy_bytes(array: object) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.asarray(array), allow_pickle=True)
    return stream.getvalue()


HONEST = npy_bytes(np.zeros((4, 5)))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (HONEST.replace(b"(4, 5), }  ", b"(900000, 900000), }  ")[:-1], "810,000,000,000 cells"),
        (HONEST.replace(b"(4, 5), }      ", b"(9999, 9999), }"), "takes 799,840,008 bytes"),
        (HONEST[:-8], "holds 152"),
        (HONEST[:20], "damaged header"),
        (npy_bytes(np.full((4, 4), None)), "Python objects"),
        (npy_bytes(np.zeros((4, 4), complex)), "complex128"),
        (npy_bytes(np.zeros(16)), "shape (16,)"),
    ],
)
def test_lying_npy_is_refused_before_it_is_allocated(
    tmp_path: Path, content: bytes, words: str
) -> None:
    (tmp_path / "dem.npy").write_bytes(content)
    write(tmp_path / "dem.toml", "cell = [2, 3]")
    with pytest.raises(MapError) as caught:
        load_terrain(tmp_path / "dem.npy")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"other": np.zeros((4, 4))}, "holds no array 'heights' or 'elevation'"),
        ({"heights": np.zeros((4, 4))}, "no array 'cell'"),
        ({"elevation": np.zeros((4, 4)), "dx": 1.0}, "no 'dx' and 'dy'"),
        ({"elevation": np.zeros((4, 4)), "dx": 0.0008, "dy": 0.0008}, "degrees"),
        ({"heights": np.zeros((4, 4)), "cell": [1.0, -1.0]}, "bad 'cell'"),
        ({"heights": np.zeros((4, 4)), "cell": 1.0, "known": np.ones((4, 5))}, "layer 'known'"),
        ({"heights": np.zeros((4, 4)), "cell": 1.0, "crs": np.array("EPSG:4326")}, "degrees"),
        ({"heights": np.zeros((4000, 4000), "u1"), "cell": 1.0}, "16,000,000 cells"),
    ],
)
def test_bad_npz_is_refused(tmp_path: Path, arrays: dict[str, object], words: str) -> None:
    np.savez_compressed(tmp_path / "map.npz", **arrays)  # type: ignore[arg-type]
    with pytest.raises(MapError) as caught:
        load_terrain(tmp_path / "map.npz", max_cells=1_000_000)
    assert words in str(caught.value)


def test_cut_off_npz_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "map.npz", heights=np.zeros((40, 40)), cell=1.0)
    content = (tmp_path / "map.npz").read_bytes()
    (tmp_path / "map.npz").write_bytes(content[: len(content) // 2])
    with pytest.raises(MapError, match="damaged, cut off"):
        load_terrain(tmp_path / "map.npz")


LAYERS = """
rows = ["#..c.", "..cc.", "?....", "....#"]
[legend]
"#" = "obstacle"
"?" = "hole"
"." = "floor"
"c" = "carpet"
[ground.carpet]
rolling = 2.3
traction = 0.9
"""


def test_layers_are_drawn_over_the_heights(tmp_path: Path) -> None:
    write(tmp_path / "dem.layers.toml", LAYERS)
    terrain = load_terrain(write(tmp_path / "dem.asc", HEADER + ROWS))
    assert {tuple(cell) for cell in np.argwhere(terrain.obstacles)} == {(3, 0), (0, 4)}
    assert {tuple(cell) for cell in np.argwhere(~terrain.known)} == {(1, 0)}
    names = [terrain.ground_classes[k].name for k in terrain.ground[2]]
    assert names == ["floor", "floor", "carpet", "carpet", "floor"]
    carpet = next(kind for kind in terrain.ground_classes if kind.name == "carpet")
    assert carpet == GroundClass("carpet", rolling=2.3, traction=0.9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"#..c.", ', "", "draws 3 rows"),
        ('"#..c."', '"#..c.."', "draws 6 characters in row 0"),
        ('"#..c."', '"#..z."', "draws the character 'z'"),
        ("rolling = 2.3", "rolling = -1", "impossible factor"),
        ("rolling = 2.3", "friction = 1", "unknown entries"),
        ("rolling = 2.3", "rolling = inf", "without finite numbers"),
        ("rolling = 2.3", f"rolling = {'1' * 400}", "without finite numbers"),
        ("rolling = 2.3", f"rolling = {'1' * 5000}", "is not TOML"),
        ("[ground.carpet]", "[ground.mud]", "that its legend does not use"),
        ("[legend]", "[legend", "is not TOML"),
        ("rows = ", "lines = ", "unknown entry 'lines'"),
    ],
)
def test_bad_layers_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    write(tmp_path / "dem.layers.toml", LAYERS.replace(old, new, 1))
    with pytest.raises(MapError) as caught:
        load_terrain(write(tmp_path / "dem.asc", HEADER + ROWS))
    assert words in str(caught.value)
    assert "dem.layers.toml" in str(caught.value)
