"""Layers drawn over heights: ground classes and obstacles, refused where they are wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.errors import MapError
from planner.terrain.formats import load_terrain
from planner.terrain.surface import GroundClass

HEADER = "ncols 5\nnrows 4\nxllcorner 100\nyllcorner 200\ncellsize 2\n"
# North row first, as the format has it: 20 is the south-west cell.
ROWS = "50 51 52 53 54\n40 41 42 43 44\n30 31 32 33 34\n20 21 22 23 24\n"


def write(path: Path, text: str) -> Path:
    path.write_bytes(text.encode())
    return path


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
