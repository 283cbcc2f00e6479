"""ESRI ASCII: read back what was written, refuse the rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.errors import MapError
from planner.terrain.formats import load_terrain

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


@pytest.mark.parametrize(
    ("name", "text", "helps"),
    [
        ("dem.asc", HEADER.replace("size 2", "size 0,5"), "such as 0.5"),
        ("points.xyz", "1 2 3\n1 3 3\n", "gdal_translate points.xyz points.tif"),
    ],
)
def test_grids_of_other_programs_are_refused_with_what_helps(
    tmp_path: Path, name: str, text: str, helps: str
) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(MapError) as refusal:
        load_terrain(file)
    assert helps in refusal.value.accepted
