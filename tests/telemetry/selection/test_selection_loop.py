"""The selection loop: meter and effects are found in turn."""

from __future__ import annotations

from dataclasses import replace

from planner.power.model import PowerModel
from planner.telemetry.logs import Meter
from planner.telemetry.prediction import predict
from planner.telemetry.selection import selection_loop
from tests.power.states import changed
from tests.telemetry.rows import TRUTH, measured


def test_a_meter_is_estimated_around_effects_until_it_stays(motion, base, monkeypatch):
    """Each estimate is half way to the truth, as beside a misfit that the last meter leaves."""
    true = Meter(0.2)
    scrubs = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    robot = changed(scrubs, **TRUTH, yaw_scrub__scrub_moment=6.0)
    shown = predict(robot, replace(motion, power=predict(robot, motion), meter=true))
    log = measured(motion, robot, 0.02, seed=1, extra=shown - predict(robot, motion))

    def nearer(log, _model, _places):
        before = log.meter.time_constant_s
        after = max(0.5 * before, true.time_constant_s)
        return replace(log, meter=replace(log.meter, time_constant_s=after))

    monkeypatch.setattr(selection_loop, "meter_beside", nearer)
    sample = replace(log, meter=Meter(8.0 * true.time_constant_s))
    found = selection_loop.investigate(sample, base, (), lambda _share, _what: None)
    assert [member.name for member in found.selection.members] == ["yaw_scrub"]
    assert found.log.meter.time_constant_s == true.time_constant_s
