"""A comparison starts from a vehicle or from a model."""

from __future__ import annotations

import numpy as np

from planner.power.vehicles import load_vehicle
from planner.telemetry.starting_model import starting_model


def test_a_comparison_starts_from_a_vehicle_or_a_model(base, robot):
    assert starting_model(robot) is robot
    for given in ("minibalance", load_vehicle("minibalance")):
        start = starting_model(given)
        assert all(effect.base for effect in start.effects)
        np.testing.assert_array_equal(start.parameters, base.parameters)
