"""Uneven wheels and a mass off the centre are one thing to a log that does not know the mass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from planner import Telemetry, diagnose
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.telemetry.estimation import fit
from planner.telemetry.selection.known_aliases import (
    BY_LOAD,
    OFFSET,
    ROLLING,
    SINKAGE,
    UNEVEN,
    with_known_aliases,
)
from planner.telemetry.virtual import Noise, Sensors, VirtualRobot

NO_MASS = Sensors(absent=("com_x", "com_y"))


@pytest.fixture(scope="module")
def unweighed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of uneven wheels without the columns of the centre of mass."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    robot = VirtualRobot("minibalance", hidden={UNEVEN: {"excess": [0.3, -0.3, -0.3, 0.3]}}, seed=4)
    robot.drive("rich", noise=Noise(level=0.02), sensors=NO_MASS).write_csv(path)
    return path


@pytest.mark.parametrize(
    ("excess", "alike"),
    [
        ([0.3, 0.3, -0.3, -0.3], True),  # front and back
        ([0.2, -0.2, 0.2, -0.2], True),  # left and right
        ([0.25, 0.05, -0.05, -0.25], True),  # both
        ([0.3, -0.3, -0.3, 0.3], False),  # across: no offset loads two opposite corners
        ([0.3, -0.1, -0.1, -0.1], False),
    ],
)
def test_patterns_that_an_offset_can_have(
    unweighed: Path, excess: list[float], alike: bool
) -> None:
    log = Telemetry.read(unweighed)
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=(UNEVEN,))
    fitted = fit(log, model)
    values = fitted.model.parameters.copy()
    for place, (effect, _, _, wheel) in enumerate(model.slots):
        if effect.slug == UNEVEN:
            values[place] = excess[wheel]
    there = replace(fitted, model=replace(fitted.model, parameters=values))
    aliases = with_known_aliases({UNEVEN: ()}, there, log)
    assert (OFFSET in aliases[UNEVEN]) == alike
    weighed = replace(log, present=log.present | {"com_x", "com_y"})
    assert with_known_aliases({UNEVEN: ()}, there, weighed) == {UNEVEN: ()}
    assert with_known_aliases({"air_drag": ()}, there, log) == {"air_drag": ()}


def test_an_offset_is_not_named_as_uneven_wheels_alone(tmp_path: Path) -> None:
    hidden = {OFFSET: {"gain": 0.0, "offset_x": 0.06, "offset_y": -0.05}}
    robot = VirtualRobot("minibalance", hidden=hidden, seed=2)
    robot.drive("rich", noise=Noise(level=0.01), sensors=NO_MASS).write_csv(tmp_path / "log.csv")
    found = diagnose(tmp_path / "log.csv", "minibalance")
    assert found.selected == (UNEVEN,)
    named = next(c for c in found.candidates if c.effect == UNEVEN)
    assert OFFSET in named.indistinguishable_from
    assert any("com_x" in entry.run for entry in found.experiments)


def test_uneven_wheels_are_named_without_a_tie(unweighed: Path) -> None:
    found = diagnose(unweighed, "minibalance")
    assert found.selected == (UNEVEN,)
    named = next(c for c in found.candidates if c.effect == UNEVEN)
    assert named.indistinguishable_from == ()


def test_sinkage_that_took_the_place_of_rolling_is_load_dependent_rolling(unweighed: Path) -> None:
    log = Telemetry.read(unweighed)
    fitted = fit(log, PowerModel.from_vehicle(load_vehicle("minibalance"), effects=(SINKAGE,)))
    place = fitted.model.parameter_names.index(ROLLING)
    for rolling, aliases in ((0.0, (BY_LOAD,)), (0.02, ())):
        there = replace(fitted, model=fitted.model.with_parameter(place, rolling))
        assert with_known_aliases({SINKAGE: ()}, there, log) == {SINKAGE: aliases}


def test_an_offset_that_was_not_measured_may_be_uneven_wheels(unweighed: Path) -> None:
    log = Telemetry.read(unweighed)
    fitted = fit(log, PowerModel.from_vehicle(load_vehicle("minibalance"), effects=(OFFSET,)))
    weighed = replace(log, present=log.present | {"com_x", "com_y"})
    assert with_known_aliases({OFFSET: ()}, fitted, log) == {OFFSET: (UNEVEN,)}
    assert with_known_aliases({OFFSET: ()}, fitted, weighed) == {OFFSET: ()}
