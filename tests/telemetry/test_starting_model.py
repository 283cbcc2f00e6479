"""A comparison starts from a vehicle or from a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.telemetry.starting_model import starting_model


def test_a_comparison_starts_from_a_vehicle_or_a_model(base, robot):
    assert starting_model(robot) is robot
    for given in ("minibalance", load_vehicle("minibalance")):
        start = starting_model(given)
        assert all(effect.base for effect in start.effects)
        np.testing.assert_array_equal(start.parameters, base.parameters)


SMALL_ROBOT = """
[body]
mass = 3.0
length = 0.3
width = 0.28
[wheels]
layout = "mecanum"
half_wheelbase = 0.11
half_track = 0.11
radius = 0.03
[drive]
gear_ratio = 30.0
torque_constant = 0.015
resistance = 25.0
"""


def rotating(model: PowerModel) -> float:
    """kg that everything that turns with the wheels acts like."""
    wheel, rotor = (
        model.parameters[model.parameter_names.index(("inertia", name, 0))]
        for name in ("wheel_inertia", "rotor_inertia")
    )
    layout, gear = model.vehicle.layout, model.vehicle.gear_ratio
    return float(layout.wheel_count * (wheel + gear**2 * rotor) / layout.radius**2)


def test_a_fit_may_find_lighter_rotors_than_were_assumed(tmp_path: Path) -> None:
    sheet = tmp_path / "small.toml"
    sheet.write_text(SMALL_ROBOT, "utf-8")
    vehicle = load_vehicle(str(sheet))
    start = starting_model(str(sheet))
    assert rotating(start) == pytest.approx(rotating(PowerModel.from_vehicle(vehicle)))
    # The whole of it is fitted, whose bound is zero.
    without = start.parameters[start.parameter_names.index(("inertia", "rotor_inertia", 0))]
    assert without == 0.0


def test_rotors_that_a_data_sheet_states_are_kept(tmp_path: Path) -> None:
    sheet = tmp_path / "small.toml"
    sheet.write_text(SMALL_ROBOT + "rotor_inertia = 1.5e-7\n", "utf-8")
    start = starting_model(str(sheet))
    kept = start.parameters[start.parameter_names.index(("inertia", "rotor_inertia", 0))]
    assert kept == 1.5e-7
