"""What is looked at of a log, and where the residual lies."""

from __future__ import annotations

import numpy as np
import pytest

from planner.report.workbench.residuals import lacking, look_of
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import RIPPLE_W, Material


def test_what_is_looked_at(made: Material) -> None:
    look = look_of(results.diagnosis(made))
    assert set(look.predicted) == set(look.residuals) == {"before", "after"}
    assert look.stretch is not None
    before = look.predicted["before"]
    assert look.measured - before == pytest.approx(look.residuals["before"][: len(before)])
    # The ripple is the largest thing that is missing, and the heading shows it.
    assert next(iter(look.curves)) == "heading"
    curve = look.curves["heading"]
    angles = np.array(curve["before"].x, float)
    assert np.corrcoef(np.cos(3 * angles), curve["before"].bias)[0, 1] > 0.85
    assert np.abs(curve["after"].bias).max() < 0.25
    # The stretch is the worst of all that have its length.
    log, rows = made.log, len(look.stretch.time)
    worst = float(((look.stretch.measured - look.stretch.predicted["before"]) ** 2).sum())
    for run in range(len(log.run_names)):
        squares = (log.power - made.base.watts)[log.run == run] ** 2
        assert np.convolve(squares, np.ones(rows), "valid").max() <= worst * (1 + 1e-9)


def test_what_the_formula_is_held_against_is_what_the_robot_hides(made: Material) -> None:
    found = lacking(results.diagnosis(made))
    assert found is not None
    angles = np.array(found.x, float)
    sector = np.sinc(3 * np.pi / 24 / np.pi)  # mean of the ripple over a bin of 15°
    expected = RIPPLE_W * sector * np.cos(3 * angles)
    enough = found.rows > 20
    assert np.abs(found.bias - expected)[enough].max() < 0.35
    assert lacking(results.complete(made)) is None
