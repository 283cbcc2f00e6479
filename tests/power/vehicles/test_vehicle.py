"""Vehicles in saved models: the same numbers without the vehicle's file."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.vehicles.vehicle_file import VEHICLE_FOLDER, load_vehicle
from tests.power.states import model_with


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("own", {"current = { value = 6.0": "current = { value = 2.5"}),
        ("minibalance", {"speed = { value = 1.2": "speed = { value = 0.7"}),
        (
            "no_limits",
            {"\nvoltage = { value = 22.8": "\n# voltage", "capacity = {": "# capacity = {"},
        ),
    ],
)
def test_a_model_brings_its_own_vehicle(tmp_path: Path, name: str, changes: dict[str, str]) -> None:
    text = (VEHICLE_FOLDER / "minibalance.toml").read_text("utf-8")
    for old, new in {'name = "minibalance"': f'name = "{name}"', **changes}.items():
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    vehicle = load_vehicle(str(tmp_path / "mine.toml"))
    PowerModel.from_vehicle(vehicle).save(tmp_path / "model.json")
    (tmp_path / "mine.toml").unlink()
    back = PowerModel.load(tmp_path / "model.json").vehicle
    assert np.array_equal(back.layout.table, vehicle.layout.table)
    assert back.layout.table.flags["C_CONTIGUOUS"]
    for field in fields(vehicle):
        if field.name != "layout":
            assert getattr(back, field.name) == getattr(vehicle, field.name), field.name
    assert back.layout.radius == vehicle.layout.radius
    installed = load_vehicle("minibalance")
    assert (back.limits, back.battery) != (installed.limits, installed.battery)


def test_no_limit_is_null_in_a_model_file(tmp_path: Path) -> None:
    vehicle = load_vehicle("minibalance")
    vehicle = replace(
        vehicle,
        limits=replace(vehicle.limits, voltage=math.inf),
        battery=replace(vehicle.battery, capacity=math.inf),
    )
    PowerModel.from_vehicle(vehicle).save(tmp_path / "model.json")

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is not JSON")

    written = json.loads((tmp_path / "model.json").read_text(), parse_constant=refuse)["vehicle"]
    assert written["limits"]["voltage"] is None
    assert written["battery"]["capacity"] is None
    back = PowerModel.load(tmp_path / "model.json").vehicle
    assert (back.limits, back.battery) == (vehicle.limits, vehicle.battery)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("vehicle", "minibalance"),
        ("mass", None),
        ("mass", -12.0),
        ("gear_ratio", "many"),
        ("wheels", {"radius": 0.1, "table": [[0.0, 1.0]]}),
        ("limits", {}),
        ("parameters", [1.0]),
    ],
)
def test_a_model_file_whose_vehicle_cannot_be_used(tmp_path: Path, key: str, value: object) -> None:
    model_with().save(tmp_path / "model.json")
    document = json.loads((tmp_path / "model.json").read_text())
    (document if key == "vehicle" else document["vehicle"])[key] = value
    (tmp_path / "model.json").write_text(json.dumps(document))
    with pytest.raises(ModelError, match=r"incomplete|vehicle: input should be"):
        PowerModel.load(tmp_path / "model.json")
