"""What a log can tell: borders of the race, and who keeps in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.power.rows import rows_from
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import design_matrix as layout
from planner.telemetry.evidence.design_matrix import DesignColumns, examine
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured, plain_log

NOISE = 0.03


def test_what_an_earlier_round_could_tell_does_not_fall_out_at_a_border(base, monkeypatch):
    """At half the border it stays in the race, at a fifth it does not."""
    rng = np.random.default_rng(3)
    angle, speed = rng.uniform(0.0, 2.0 * np.pi, 1200), rng.uniform(0.1, 0.9, 1200)
    rows = rows_from(vx=speed * np.cos(angle), vy=speed * np.sin(angle))
    log = measured(plain_log([100] * 12, rows), base, NOISE, seed=4)
    plain = DesignColumns(candidate_library(fit(log, base).model, log), Dictionary.of(log))
    first = examine(log, plain)
    assert first.testable["air_drag"] is None
    number = [c.effect for c in plain.library.candidates].index("air_drag")
    over = layout.over_sensor_errors(log, first)[plain.candidate(number)]
    known = replace(plain, testable_before=frozenset({"air_drag"}))
    for share, stays in ((0.5, True), (0.2, False)):
        monkeypatch.setattr(layout, "LEAST_OVER_SENSOR_ERROR", over / share)
        assert examine(log, plain).testable["air_drag"] is not None
        assert (examine(log, known).testable["air_drag"] is None) is stays
