"""Logs that the tests of identification share; their power comes from a power model with noise."""

from __future__ import annotations

import pytest

from planner.power.model import PowerModel
from planner.telemetry.estimation import fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.virtual import QUIET, VirtualRobot
from tests.power.states import changed
from tests.telemetry.rows import TRUTH, base_model, measured


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


@pytest.fixture(scope="session")
def robot(base):
    """A robot of the same kind with other parameters."""
    return changed(base, **TRUTH)


@pytest.fixture(scope="session")
def noisy(motion, robot, base):
    """A log with 2 % of noise, and the fit to it."""
    log = measured(motion, robot, 0.02, seed=5)
    return log, fit(log, base)
