"""Names that a request from outside may use: nothing else on the disk can be reached."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.errors import RequestError
from planner.search.requests import PlanRequest
from service.jobs import Names


@pytest.fixture
def names(tmp_path: Path) -> Names:
    """A catalogue, a stored model, and a folder with a link that leads out of it."""
    folder = tmp_path / "data"
    (folder / "deep").mkdir(parents=True)
    for name in ("hill.TIF", "deep/cart.toml", "saved.json", "notes.txt"):
        (folder / name).touch()
    (tmp_path / "secret.tif").touch()
    (folder / "link.tif").symlink_to(tmp_path / "secret.tif")
    catalogue = {"map": ["valley"], "vehicle": ["minibalance"], "model": ["sound"]}
    return Names(catalogue, folder, {"m1": tmp_path / "store" / "m1.json"}.get)


def test_a_name_of_the_catalogue_stays(names: Names) -> None:
    assert names.find("map", "valley") == "valley"


def test_files_of_the_folder_and_stored_models_become_paths(names: Names, tmp_path: Path) -> None:
    folder = (tmp_path / "data").resolve()
    assert names.find("map", "hill.TIF") == str(folder / "hill.TIF")
    assert names.find("vehicle", "deep/cart.toml") == str(folder / "deep" / "cart.toml")
    assert names.find("model", "m1") == str(tmp_path / "store" / "m1.json")


def test_files_are_those_of_the_field_inside_the_folder(names: Names) -> None:
    found = {field: names.files(field) for field in ("map", "vehicle", "model")}
    assert found == {"map": ["hill.TIF"], "vehicle": ["deep/cart.toml"], "model": ["saved.json"]}


def test_a_folder_with_a_map_in_it_is_a_map(names: Names, tmp_path: Path) -> None:
    """Its parts may be maps too; what puts them together is neither a map nor a vehicle."""
    hall = tmp_path / "data" / "site" / "hall"
    hall.mkdir(parents=True)
    for name in ("map.toml", "floor.yaml"):
        (hall / name).touch()
    assert names.find("map", "site/hall") == str(hall.resolve())
    assert names.files("map") == ["hill.TIF", "site/hall", "site/hall/floor.yaml"]
    assert names.files("vehicle") == ["deep/cart.toml"]
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "map.toml").touch()
    (tmp_path / "data" / "link").symlink_to(outside)
    for other in ("site", "link", "site/hall/map.toml", "site/../site/hall"):
        with pytest.raises(RequestError, match="no such map"):
            names.find("map", other)


def test_a_toml_that_puts_a_map_together_is_a_map(names: Names, tmp_path: Path) -> None:
    folder = (tmp_path / "data").resolve()
    (folder / "floor.toml").write_text('plan = "floor.yaml"\n')
    (folder / "broken.toml").write_text("plan = ")
    assert names.find("map", "floor.toml") == str(folder / "floor.toml")
    assert names.files("map") == ["floor.toml", "hill.TIF"]
    assert names.files("vehicle") == ["broken.toml", "deep/cart.toml"]


@pytest.mark.parametrize(
    "name",
    [
        "../secret.tif",
        "link.tif",
        "deep/../hill.TIF",
        "cart.toml",
        "notes.txt",
        "m1",
        "/etc/passwd",
    ],
)
def test_anything_else_is_refused(names: Names, name: str, tmp_path: Path) -> None:
    for asked in (name, str(tmp_path / "secret.tif")):
        with pytest.raises(RequestError, match="no such map") as caught:
            names.find("map", asked)
        assert "valley" in str(caught.value)


def test_the_mapping_file_of_a_log_is_neither(names: Names, tmp_path: Path) -> None:
    before = {field: names.files(field) for field in ("map", "vehicle", "model")}
    (tmp_path / "data" / "log.toml").write_text('power_at = "source"\n[columns]\nstamp = "time"\n')
    assert {field: names.files(field) for field in before} == before
    with pytest.raises(RequestError, match="no such vehicle"):
        names.find("vehicle", "log.toml")


def test_without_a_folder_there_are_no_files(names: Names) -> None:
    assert Names(names.catalogue, None).files("map") == []


def test_a_request_is_resolved_field_by_field(names: Names, tmp_path: Path) -> None:
    pose = {"x": 1.0, "y": 2.0}
    asked = PlanRequest(map="hill.TIF", vehicle="minibalance", start=pose, goal=pose)
    found = names.resolve(asked)
    assert found.map == str((tmp_path / "data" / "hill.TIF").resolve())
    assert found.vehicle == "minibalance"
    assert asked.map == "hill.TIF"
