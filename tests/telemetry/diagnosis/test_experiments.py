"""Runs that are recommended can be driven, and ask no more than they must."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.diagnosis.experiments import feasible_runs
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured

NOISE = 0.02


def test_recommended_runs_are_feasible(motion, base):
    log = measured(motion, base, NOISE, seed=2)
    fitted = fit(log, base)
    competitors = DesignColumns(candidate_library(fitted.model, log), Dictionary.of(log))
    limits = base.vehicle.limits
    runs = feasible_runs(examine(log, competitors), log)
    assert len({run.sentence for run in runs}) == len(runs)
    for run in runs:
        seconds = 0.0
        for one in run.settings["runs"]:
            assert 0.0 <= one["payload"] <= base.vehicle.mass
            for s in one["segments"]:
                seconds += s["seconds"]
                assert np.hypot(s["vx"], s["vy"]) <= limits.speed
                assert abs(s["wz"]) <= limits.yaw_rate
                assert abs(s["acceleration"]) <= limits.acceleration
                assert np.hypot(s["pitch"], s["roll"]) < np.radians(15.0)
                assert s["vx"] or s["vy"] or s["wz"]
        assert seconds == pytest.approx(600.0, rel=0.02)


def test_of_runs_alike_those_with_both_loads_and_motors_as_they_are_ask_least(motion, base):
    """And a robot that has carried half its mass is asked to carry that again."""
    rows = motion.rows.copy()
    heaviest = round(0.5 * base.vehicle.mass, 1)
    rows[: len(rows) // 2, INDEX["payload"]] = heaviest
    log = measured(replace(motion, rows=rows), base, NOISE, seed=2)
    competitors = DesignColumns(candidate_library(fit(log, base).model, log), Dictionary.of(log))
    alike = {}
    for run in feasible_runs(examine(log, competitors), log):
        alike.setdefault(run.sentence.partition(",")[0], []).append(run)
    for runs in alike.values():
        least = min(runs, key=lambda run: run.demands)
        settings = least.settings["runs"]
        assert {one["payload"] for one in settings} == {0.0, heaviest}
        assert {one["motor_temp"] for one in settings} == {None}
