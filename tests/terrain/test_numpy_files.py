"""NumPy arrays: read back what was written, refuse the rest."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from planner.errors import MapError
from planner.terrain.formats import load_terrain
from planner.terrain.surface import GroundClass


def write(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


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
