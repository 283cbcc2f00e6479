"""Uneven wheels and a mass off the centre are one thing to a log that does not know the mass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from planner import Diagnosis, Telemetry, diagnose
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.telemetry.diagnosis.results import Estimate
from planner.telemetry.estimation import fit
from planner.telemetry.selection.known_aliases import (
    BY_LOAD,
    ROLLING,
    SINKAGE,
    with_known_aliases,
)
from planner.telemetry.virtual import Noise, Sensors, VirtualRobot

UNEVEN, OFFSET = "wheel_imbalance", "com_offset"
NO_MASS = Sensors(absent=("com_x", "com_y"))


@pytest.fixture(scope="module")
def unweighed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of uneven wheels without the columns of the centre of mass."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    robot = VirtualRobot("minibalance", hidden={UNEVEN: {"excess": [0.3, -0.3, -0.3, 0.3]}}, seed=4)
    robot.drive("rich", noise=Noise(level=0.02), sensors=NO_MASS).write_csv(path)
    return path


def parameters_of(found: Diagnosis, effect: str) -> dict[str, Estimate]:
    """Of a candidate."""
    return next(c for c in found.candidates if c.effect == effect).parameters


def test_an_offset_that_nobody_measured_is_named_with_its_side(tmp_path: Path) -> None:
    """Slopes and turns show to which side the mass is off; uneven wheels do nothing of it."""
    hidden = {OFFSET: {"gain": 0.0, "offset_x": 0.06, "offset_y": -0.05}}
    robot = VirtualRobot("minibalance", hidden=hidden, seed=2)
    robot.drive("rich", noise=Noise(level=0.01), sensors=NO_MASS).write_csv(tmp_path / "log.csv")
    found = diagnose(tmp_path / "log.csv", "minibalance")
    assert found.selected == (OFFSET,)
    for name, there in hidden[OFFSET].items():
        if name != "gain":
            estimate = parameters_of(found, OFFSET)[name]
            assert abs(estimate.value - there) < 3.0 * estimate.stderr < 0.02


def test_uneven_wheels_are_named_without_a_tie(unweighed: Path) -> None:
    """No offset loads two opposite corners."""
    found = diagnose(unweighed, "minibalance")
    assert found.selected == (UNEVEN,)
    named = next(c for c in found.candidates if c.effect == UNEVEN)
    assert named.indistinguishable_from == ()


@pytest.mark.nightly
def test_uneven_wheels_in_the_pattern_of_an_offset_may_be_one(tmp_path: Path) -> None:
    robot = VirtualRobot("minibalance", hidden={UNEVEN: {"excess": [0.3, 0.3, -0.3, -0.3]}}, seed=4)
    robot.drive("rich", noise=Noise(level=0.02), sensors=NO_MASS).write_csv(tmp_path / "log.csv")
    found = diagnose(tmp_path / "log.csv", "minibalance")
    assert found.selected == (UNEVEN,)
    named = next(c for c in found.candidates if c.effect == UNEVEN)
    assert named.indistinguishable_from == (OFFSET,)
    assert any("com_x" in entry.run for entry in found.experiments)


def test_sinkage_that_took_the_place_of_rolling_is_load_dependent_rolling(unweighed: Path) -> None:
    log = Telemetry.read(unweighed)
    fitted = fit(log, PowerModel.from_vehicle(load_vehicle("minibalance"), effects=(SINKAGE,)))
    place = fitted.model.parameter_names.index(ROLLING)
    for rolling, aliases in ((0.0, (BY_LOAD,)), (0.02, ())):
        there = replace(fitted, model=fitted.model.with_parameter(place, rolling))
        assert with_known_aliases({SINKAGE: ()}, there) == {SINKAGE: aliases}
