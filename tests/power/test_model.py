"""PowerModel: rows, shares, derivatives, saving and loading, and compiled code on disk."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.catalogue import all_effects
from planner.power.compile_kernel import cache_folder, compile_kernel
from planner.power.energy_error import EnergyError, ParameterCovariance
from planner.power.model import PowerModel, gravity_columns, rows_from
from planner.power.pipeline import kernel_source
from planner.power.vehicle import VEHICLE_FOLDER, load_vehicle
from planner.quantities import INDEX, QUANTITIES, ROW_LENGTH
from tests.power.states import column, model_with, random_columns


def test_vocabulary_has_every_name_once() -> None:
    assert len(INDEX) == len(QUANTITIES) == ROW_LENGTH
    assert all(quantity.meaning and quantity.unit for quantity in QUANTITIES)


def test_unknown_column() -> None:
    with pytest.raises(ModelError, match=r"speed.*no such quantity.*vx"):
        rows_from(speed=1.0)


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


@pytest.mark.parametrize(
    ("roll", "pitch", "expected"),
    [
        (0.0, 0.0, (0.0, 0.0, 1.0)),
        # Nose down by 30°: gravity pulls forward. Left side up by 30°: it pulls to the right.
        (0.0, np.pi / 6, (0.5, 0.0, np.sqrt(0.75))),
        (np.pi / 6, 0.0, (0.0, -0.5, np.sqrt(0.75))),
    ],
)
def test_gravity_of_roll_and_pitch(
    roll: float, pitch: float, expected: tuple[float, float, float]
) -> None:
    columns = gravity_columns(roll, pitch, gravity=10.0)
    assert [float(value) for value in columns.values()] == pytest.approx(
        [10.0 * part for part in expected], abs=1e-12
    )


def test_one_row_at_a_time_or_all_at_once() -> None:
    model = model_with()
    rows = rows_from(**random_columns(20, seed=16))
    single = [model.watts(row[None])[0] for row in rows]
    assert np.array_equal(model.watts(rows), single)
    assert model.watts(rows[:0]).shape == (0,)


def test_jacobian_shape_and_a_derivative_by_hand() -> None:
    # dP/dP_0 is 1/η of the converter; dP/d(b) is Σω² plus the current it takes.
    model = model_with()
    rows = rows_from(vx=[0.3, 0.6])
    slopes = model.jacobian(rows)
    assert slopes.shape == (2, len(model.parameters))
    names = [(effect.slug, name) for effect, name, _, _ in model.slots]
    electronics = slopes[:, names.index(("electronics", "power"))]
    assert electronics == pytest.approx([1.0 / 0.88] * 2, rel=1e-12)
    viscous = slopes[:, names.index(("viscous_drag", "viscous_torque"))]
    assert np.all(viscous > 4.0 * (26.85 * np.array([0.3, 0.6]) / 0.076) ** 2)


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


def test_a_covariance_goes_by_name() -> None:
    """In whatever order a model has its parameters; zero for those that it does not name."""
    covariance = ParameterCovariance.from_document(covariance_document())
    power, resistance = covariance.names
    other = ("inertia", "yaw_inertia", 0)
    assert np.array_equal(
        covariance.matrix([resistance, other, power]),
        [[1.0, 0.0, 0.1], [0.0, 0.0, 0.0], [0.1, 0.0, 0.04]],
    )


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


def test_uncertainty_is_the_prior_spread_until_fitted() -> None:
    model = model_with()
    place = next(k for k, slot in enumerate(model.slots) if slot[1] == "rolling")
    assert model.uncertainty[place] == pytest.approx(0.25 * 0.035)
    stderr = np.full(len(model.parameters), math.nan)
    stderr[place] = 0.001
    assert replace(model, stderr=stderr).uncertainty[place] == 0.001


def test_default_surface_and_labels_beyond_the_model() -> None:
    model = model_with("surface_rolling", surface_rolling__excess=0.5)
    inside, none, beyond, unknown = model.watts(
        rows_from(vx=0.5, surface=[1.0, -1.0, 7.0, math.nan])
    )
    assert inside > none
    assert none == beyond == unknown


def test_same_effects_same_text_other_effects_other_text() -> None:
    effects = list(all_effects().values())
    text = kernel_source(effects, wheel_count=4, surface_count=1, number="float64")
    assert text == kernel_source(effects, wheel_count=4, surface_count=1, number="float64")
    assert text != kernel_source(effects[:-1], wheel_count=4, surface_count=1, number="float64")
    assert text != kernel_source(effects, wheel_count=3, surface_count=1, number="float64")


def test_a_kernel_is_compiled_once() -> None:
    effects = tuple(all_effects()[slug] for slug in load_vehicle("minibalance").active)
    first, second = (
        compile_kernel(effects, wheel_count=4, surface_count=1, number="float64") for _ in range(2)
    )
    assert first is second


START = """
import time
from planner.power.model import PowerModel, rows_from
from planner.power.vehicle import VEHICLE_FOLDER, load_vehicle
model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["vibration"])
before = time.perf_counter()
print(model.watts(rows_from(vx=0.5))[0], time.perf_counter() - before)
"""


def test_a_model_seen_before_starts_without_compiling(tmp_path: Path) -> None:
    environment = {**os.environ, "JOULEPATH_CACHE_DIR": str(tmp_path)}
    answers = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", START],
            env=environment,
            cwd=Path(__file__).resolve().parents[2],
            capture_output=True,
            text=True,
            check=True,
        )
        answers.append(done.stdout.split())
    files = sorted(path.name for path in (tmp_path / "kernels").glob("*.py"))
    assert len(files) == 1
    assert answers[0][0] == answers[1][0]
    assert float(answers[1][1]) < 1.0


def test_a_cache_that_cannot_be_written_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "file"))
    folder = cache_folder()
    assert folder.is_dir()
    assert os.access(folder, os.W_OK)


def test_payload_counts_in_mass_and_loads() -> None:
    model = model_with()
    rows = rows_from(vx=0.5, payload=[0.0, 6.0])
    account = model.account(rows)
    assert account["least_load"] == pytest.approx(np.array([12.0, 18.0]) * 9.80665 / 4.0)
    assert account["shaft"][1] / account["shaft"][0] == pytest.approx(1.5, rel=1e-9)
    assert column(rows, "payload")[1] == 6.0
