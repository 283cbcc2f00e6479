"""A file that another file names lies in its folder or below, whatever a stranger writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from planner.errors import MapError
from planner.terrain.grid_checks import beside


@pytest.fixture
def file(tmp_path: Path) -> Path:
    folder = tmp_path / "map"
    (folder / "parts").mkdir(parents=True)
    (folder / "parts" / "dem.tif").touch()
    (tmp_path / "secret.tif").touch()
    (folder / "link.tif").symlink_to(tmp_path / "secret.tif")
    return folder / "map.toml"


def test_a_file_in_the_folder_or_below_is_taken(file: Path) -> None:
    assert beside(file, "heights", "parts/dem.tif") == file.parent / "parts" / "dem.tif"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (3, "bad 'heights'"),
        ("", "bad 'heights'"),
        ("../secret.tif", "bad 'heights'"),
        ("/etc/passwd", "bad 'heights'"),
        ("other.tif", "other.tif, which is absent"),
        ("link.tif", "leads elsewhere"),
    ],
)
def test_any_other_is_refused(file: Path, name: Any, words: str) -> None:
    with pytest.raises(MapError, match=words):
        beside(file, "heights", name)
