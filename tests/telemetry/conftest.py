"""Logs that the tests of identification share; their power comes from a power model with noise."""

from __future__ import annotations

import pytest

from planner.power.model import PowerModel
from planner.telemetry.log import Telemetry
from planner.telemetry.virtual_robot import QUIET, VirtualRobot
from tests.telemetry.rows import base_model


@pytest.fixture(scope="session")
def motion(tmp_path_factory) -> Telemetry:
    """A varied drive of 14 runs of 110 rows with exact inputs, read from its file."""
    path = tmp_path_factory.mktemp("identification") / "varied.csv"
    robot = VirtualRobot("minibalance", seed=21)
    robot.drive(robot.profile("rich", runs=14, rows=110), noise=QUIET).write_csv(path)
    return Telemetry.read(path)


@pytest.fixture(scope="session")
def base() -> PowerModel:
    """The vehicle's base model."""
    return base_model()
