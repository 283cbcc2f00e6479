"""Wear is named where drag rises with the distance, and not where something else changes."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.prediction import predict
from tests.power.states import changed
from tests.telemetry.rows import measured

NOISE = 0.02
RISE = 0.4
"""By how much drag or power changes along the log, as a share."""


@pytest.fixture(scope="module")
def course(motion):
    """(n,) share of the whole distance that is driven."""
    driven = motion.rows[:, INDEX["odometer"]]
    return driven / driven[-1]


def test_wear_is_named(motion, base):
    distance = float(motion.rows[-1, INDEX["odometer"]])
    worn = PowerModel.from_vehicle(base.vehicle, effects=("wear",))
    worn = changed(worn, wear__wear_rate=RISE / distance)
    assert diagnose(measured(motion, worn, NOISE, seed=6), base).selected == ("wear",)


def test_electronics_that_warm_up_are_no_wear(motion, base, course):
    mean = float(np.mean(np.abs(predict(base, motion))))
    extra = RISE * mean * (course - 0.5)
    found = diagnose(measured(motion, base, NOISE, seed=7, extra=extra), base)
    assert "wear" not in found.selected
    assert found.verdict == "not_identifiable"


def test_another_ground_on_the_second_day_is_no_wear(motion, base):
    rough = changed(base, wheel_rolling__rolling=0.05, roller_drag__roller=0.065)
    extra = predict(rough, motion) - predict(base, motion)
    second = motion.run > motion.run.max() // 2
    found = diagnose(measured(motion, base, NOISE, seed=8, extra=extra * second), base)
    assert "wear" not in found.selected
    assert found.verdict != "complete"
