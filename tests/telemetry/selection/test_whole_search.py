"""A log that is longer than its sample is searched on the sample, and says the same."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.cache import CACHE
from planner.power.model import PowerModel
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.sampling import LogSource
from tests.power.states import changed
from tests.telemetry.rows import measured

SCRUB = 3.0
LACKING = {"motor_temp", "ambient_temp", "battery_voltage"}
STRONG = {
    "viscous_drag": {"viscous_drag__viscous_torque": 2e-5},
    "stiction": {"stiction__strength": 1.2, "stiction__stiction_speed": 0.05},
}


def test_a_sample_names_what_the_whole_log_names(motion, base, monkeypatch):
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    log = measured(motion, changed(robot, yaw_scrub__scrub_moment=SCRUB), 0.02, seed=31)
    whole = diagnose(log, base)
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", 1400)
    CACHE.clear()  # it knows the diagnosis of the whole log
    found = diagnose(log, base)
    assert found.selected == whole.selected == ("yaw_scrub",)
    assert {c.effect for c in found.candidates} == {c.effect for c in whole.candidates}
    for candidate in found.candidates:
        if candidate.heldout_rmse_w is not None:
            assert candidate.heldout_rmse_w >= 0.98 * found.after.heldout_rmse_w


@pytest.mark.parametrize(
    "slug", ["viscous_drag", pytest.param("stiction", marks=pytest.mark.nightly)]
)
def test_a_long_log_is_asked_for_the_columns_that_it_lacks(slug, motion, base, monkeypatch):
    """What part effects that look alike is worked out on the sample."""
    real = changed(PowerModel.from_vehicle(base.vehicle, effects=(slug,)), **STRONG[slug])
    log = replace(motion, present=motion.present - LACKING)
    log = measured(log, real, 0.02, seed=31)
    whole = diagnose(log, base)
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", 1000)
    CACHE.clear()  # it knows the diagnosis of the whole log
    found = diagnose(log, base)
    assert found.selected == whole.selected == (slug,)
    assert [e.separates for e in found.experiments] == [e.separates for e in whole.experiments]
