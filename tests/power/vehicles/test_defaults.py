"""What a model takes from defaults is said with value and unit, whoever saved it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from planner.power.model import PowerModel
from planner.power.vehicles.vehicle_file import load_vehicle

PARTIAL = """
[body]
mass = 10.0
length = 0.6
width = 0.5
[wheels]
layout = "omni"
base_radius = 0.2
angles = [0.0, 2.0, 4.0]
radius = 0.05
[drive]
gear_ratio = 20.0
torque_constant = 0.03
resistance = 1.5
gear_efficiency = 0.9
[effects]
active = ["air_drag", "viscous_drag"]
[effects.viscous_drag]
viscous_torque = 1e-6
"""


@pytest.fixture
def model(tmp_path: Path) -> PowerModel:
    path = tmp_path / "robot.toml"
    path.write_text(PARTIAL, encoding="utf-8")
    return PowerModel.from_vehicle(load_vehicle(str(path)))


def said(model: PowerModel) -> dict[str, str]:
    return dict(words.split(" = ") for words in model.defaults_in_words())


def parameter(model: PowerModel, slug: str, name: str) -> int:
    return model.parameter_names.index((slug, name, 0))


def test_defaults_are_the_values_that_the_model_computes_with(model: PowerModel) -> None:
    words = said(model)
    for key, slug, name in (
        ("electronics.power", "electronics", "power"),
        ("body.yaw_inertia", "inertia", "yaw_inertia"),
        ("effects.air_drag.drag_area", "air_drag", "drag_area"),
    ):
        value, unit, *formula = words[key].split(" ", 2)
        assert float(value) == pytest.approx(
            model.parameters[parameter(model, slug, name)],
            rel=1e-3,  # words have four digits
        )
        assert unit == {"electronics.power": "W", "body.yaw_inertia": "kg·m²"}.get(key, "m²")
        assert bool(formula) == (key == "body.yaw_inertia")
    vehicle = model.vehicle
    assert words["limits.speed"] == f"{vehicle.limits.speed:g} m/s"
    assert words["battery.voltage"] == f"{vehicle.battery.voltage:g} V"
    assert words["contact.traction"] == f"{vehicle.traction:g}"
    # The rollers of an omni wheel stand across it.
    assert float(words["wheels.roller_angle"].split(" ")[0]) == pytest.approx(math.pi / 2, abs=1e-3)


def test_no_limit_is_said_in_words(model: PowerModel) -> None:
    assert math.isinf(model.vehicle.battery.capacity)
    assert said(model)["battery.capacity"] == said(model)["limits.current"] == "no limit"


def test_what_the_file_gives_is_no_default(model: PowerModel) -> None:
    given = {"drive.gear_efficiency", "drive.resistance", "effects.viscous_drag.viscous_torque"}
    assert not given & set(said(model))


def test_what_was_fitted_is_no_default_any_more(model: PowerModel) -> None:
    place = parameter(model, "wheel_rolling", "rolling")
    fitted = model.with_parameter(place, 1.5 * model.parameters[place])
    assert set(said(model)) - set(said(fitted)) == {"contact.rolling"}


def test_an_effect_that_the_model_does_not_have_takes_no_default(model: PowerModel) -> None:
    base = PowerModel.from_vehicle(model.vehicle, effects=())
    left_out = set(said(model)) - set(said(base))
    assert "effects.air_drag.drag_area" in left_out
    assert all(key.startswith("effects.air_drag.") for key in left_out)


def test_a_model_saved_when_no_motor_was_required_still_loads(
    model: PowerModel, tmp_path: Path
) -> None:
    # Such a file names the motor's keys among its defaults, and holds their values.
    document = json.loads(json.dumps(model.document()))
    document["vehicle"]["gear_ratio"] = 1.0
    document["vehicle"]["defaults_taken"] += [
        *("drive.gear_ratio", "drive.torque_constant", "drive.resistance"),
        "drive.of_another_version",
    ]
    (tmp_path / "old.json").write_text(json.dumps(document), encoding="utf-8")
    words = said(PowerModel.load(tmp_path / "old.json"))
    assert words["drive.gear_ratio"] == "1"
    assert words["drive.torque_constant"] == "0.03 N·m/A"
    assert words["drive.resistance"] == "1.5 Ω"
    assert set(words) - set(said(model)) == {
        *("drive.gear_ratio", "drive.torque_constant", "drive.resistance")
    }
