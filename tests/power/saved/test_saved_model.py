"""Saved models: read back bit by bit, and refused where they are broken."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.saved.energy_error import EnergyError, ParameterCovariance
from planner.power.vehicles import load_vehicle
from tests.power.states import model_with, random_columns


def covariance_document(
    names: tuple[str, str] = ("power", "resistance"), values: Any = ((0.04, 0.1), (0.1, 1.0))
) -> dict[str, Any]:
    effects = {"power": "electronics", "resistance": "copper_loss"}
    return {
        "parameters": [{"effect": effects[name], "name": name, "element": 0} for name in names],
        "values": [list(row) for row in values],
    }


def error_document(**changes: Any) -> dict[str, Any]:
    noise = {
        "powers_w": [1.0, 20.0],
        "spreads_w": [0.1, 0.4],
        "correlation_time_s": 0.7,
        "run_offset_w": 0.02,
        "run_gain": 0.003,
    }
    held_out = {"runs": 16, "scale": 1.2, "degrees_of_freedom": 12.0}
    return {"noise": {**noise, **changes}, "held_out": held_out}


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"name": 3}, "name"),
        ({"version": "2"}, "version"),
        ({"version": float("nan")}, "version"),
        ({"parent": ["x"]}, "parent"),
        ({"surfaces": "hard"}, "surfaces"),
        ({"surfaces": {"hard": 1}}, "surfaces"),
        ({"history": {"a": 1}}, "history"),
        ({"history": [3]}, "history.0"),
        ({"effects": None}, "effects"),
        ({"effects": {"electronics": {"power": float("nan")}}}, ""),
        ({"effects": {"electronics": {"power": 10**400}}}, ""),
        ({"custom": 10**400}, ""),
        ({"stderr": 5}, ""),
        ({"covariance": {}}, "parameters"),
        ({"covariance": covariance_document(values=[[1.0, 0.0]])}, "covariance"),
        ({"covariance": covariance_document(values=[[1.0, 0.5], [0.4, 1.0]])}, "covariance"),
        ({"covariance": covariance_document(values=[[1.0, 2.0], [2.0, 1.0]])}, "covariance"),
        ({"covariance": covariance_document(values=[[1.0, float("inf")]] * 2)}, "values.0.1"),
        ({"covariance": covariance_document(values=[[1e300, 1.0], [1.0, -1.0]])}, "covariance"),
        ({"covariance": covariance_document(names=("power", "power"))}, "covariance"),
        ({"energy_error": {"noise": {}}}, "powers_w"),
        ({"energy_error": error_document(powers_w=[2.0, 1.0])}, "noise"),
        ({"energy_error": error_document(spreads_w=[0.1])}, "noise"),
        ({"energy_error": error_document(run_gain=-1.0)}, "run_gain"),
        ({"energy_error": {**error_document(), "covered": {"speed_mps": -1.0}}}, "speed_mps"),
        ({"energy_error": error_document(correlation_time_s="1")}, "correlation_time_s"),
        ({"vehicle": {}}, ""),
        ({"kind": "cubist"}, ""),
    ],
)
def test_a_broken_file_is_refused_where_it_is_broken(
    tmp_path: Path, changes: dict[str, Any], where: str
) -> None:
    path = tmp_path / "model.json"
    path.write_text(json.dumps({**model_with("stiction").document(), **changes}))
    with pytest.raises(ModelError) as caught:
        PowerModel.load(path)
    assert caught.value.field.endswith(where)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "[1]", "null", '{"format": 7}'])
def test_a_file_that_is_no_model_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "model.json"
    path.write_text(text)
    with pytest.raises(ModelError, match=r"model\.json"):
        PowerModel.load(path)


def test_what_is_known_of_energies_is_saved_and_loaded_bit_by_bit(tmp_path: Path) -> None:
    covariance = ParameterCovariance.from_document(covariance_document())
    error = EnergyError.from_document(error_document())
    model = replace(model_with("stiction"), covariance=covariance, energy_error=error)
    model.save(tmp_path / "model.json")
    back = PowerModel.load(tmp_path / "model.json")
    assert back.covariance is not None
    assert back.covariance.names == covariance.names
    assert np.array_equal(back.covariance.values, covariance.values)
    assert back.energy_error == error
    assert back.document() == model.document()


def test_a_file_from_before_energies_had_errors_is_read(tmp_path: Path) -> None:
    document = model_with("stiction").document()
    del document["covariance"], document["energy_error"]
    (tmp_path / "model.json").write_text(json.dumps(document))
    back = PowerModel.load(tmp_path / "model.json")
    assert back.covariance is None
    assert back.energy_error is None


def test_saved_and_loaded_bit_by_bit(tmp_path: Path) -> None:
    model = model_with("wheel_imbalance", "surface_rolling", "stiction")
    values = np.random.default_rng(17).uniform(0.6, 0.9, len(model.parameters))
    stderr = np.where(np.arange(len(values)) % 2 == 0, 0.01, np.nan)
    model = replace(model, parameters=values, stderr=stderr, version=3, parent="minibalance 2")
    model.save(tmp_path / "model.json")
    back = PowerModel.load(tmp_path / "model.json")
    assert np.array_equal(back.parameters, model.parameters)
    assert back.stderr is not None
    assert np.array_equal(back.stderr, stderr, equal_nan=True)
    assert (back.version, back.parent, back.surfaces) == (3, "minibalance 2", ("hard", "carpet"))
    rows = rows_from(**random_columns(20, seed=18))
    assert np.array_equal(back.watts(rows), model.watts(rows))


def test_no_number_of_a_model_file_can_be_too_large(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    # The vehicle has values of effects that the model does not have.
    PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"]).save(path)
    written = json.loads(path.read_text())

    def places(part: Any, *above: Any) -> list[tuple[Any, ...]]:
        if isinstance(part, dict | list):
            entries = part.items() if isinstance(part, dict) else enumerate(part)
            return [place for key, value in entries for place in places(value, *above, key)]
        return [above] if isinstance(part, float) else []

    found = places(written)
    assert ("vehicle", "mass") in found
    assert ("vehicle", "parameters", "driver_loss", "switching_power") in found
    for *above, key in found:
        document = json.loads(path.read_text())
        part = document
        for step in above:
            part = part[step]
        part[key] = 10**400
        (tmp_path / "spoilt.json").write_text(json.dumps(document))
        with pytest.raises(ModelError, match="; accepted: "):
            PowerModel.load(tmp_path / "spoilt.json")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot be read"),
        ("{", "not JSON"),
        ("[]", "not a joulepath model"),
        ('{"format": "joulepath-model/9"}', "not a joulepath model"),
        ('{"format": "joulepath-model/1"}', "name: field required"),
    ],
)
def test_what_is_wrong_with_a_model_file(tmp_path: Path, text: str | None, words: str) -> None:
    path = tmp_path / "model.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ModelError, match=words) as caught:
        PowerModel.load(path)
    assert "accepted:" in str(caught.value)


def test_a_model_file_with_an_unknown_effect(tmp_path: Path) -> None:
    model_with().save(tmp_path / "model.json")
    document = json.loads((tmp_path / "model.json").read_text())
    document["effects"]["ether_drag"] = {}
    (tmp_path / "model.json").write_text(json.dumps(document))
    with pytest.raises(ModelError, match="ether_drag"):
        PowerModel.load(tmp_path / "model.json")
