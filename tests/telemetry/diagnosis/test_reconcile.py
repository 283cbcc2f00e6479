"""The second search is believed where it is clearly better, or as good and tamer."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from planner.telemetry.diagnosis import reconcile as two_searches
from planner.telemetry.diagnosis.reconcile import more_credible
from tests.telemetry.rows import plain_log

LOG = plain_log([10] * 40)


def found(error, *, verdict="missing_effect", ends=0, outside=None, sensors=(), by_run=None):
    """A diagnosis whose held-out residual is ``error`` W in every row, or differs by run."""
    spread = np.full(40, error) if by_run is None else by_run
    residual = np.repeat(spread, 10)
    return SimpleNamespace(
        verdict=verdict,
        proposed=() if verdict == "complete" else ("stiction",),
        outside=outside,
        sensors=sensors,
        corrected=LOG,
        after=SimpleNamespace(heldout_rmse_w=float(np.sqrt(np.mean(residual**2)))),
        fitted=SimpleNamespace(
            residual=residual, parameters=[SimpleNamespace(at_the_end=True)] * ends
        ),
    )


@pytest.fixture(autouse=True)
def known_residuals(monkeypatch):
    """Held-out residuals are those that a test gives."""
    monkeypatch.setattr(two_searches, "heldout_residual", lambda log, fitted: fitted.residual)


def test_a_clearly_lower_error_is_believed_however_wild():
    first, second = found(1.0), found(0.9, ends=4, outside=object())
    assert more_credible(first, second) is second


def test_of_two_alike_the_first_stays():
    first, second = found(1.0), found(0.99)
    assert more_credible(first, second) is first


@pytest.mark.parametrize("wild", [{"ends": 2}, {"outside": object()}])
def test_the_tamer_of_two_that_chance_orders_is_believed(wild):
    by_run = 0.97 + 0.3 * np.random.default_rng(2).standard_normal(40)
    first, second = found(1.0, **wild), found(1.0, by_run=by_run)
    assert 0.98 < second.after.heldout_rmse_w < 1.05
    assert more_credible(first, second) is second


def test_tameness_is_no_excuse_for_an_error_that_is_higher_in_every_run():
    assert more_credible(first := found(1.0, ends=3), found(1.03)) is first


def test_nothing_missing_gives_way_to_what_no_complete_model_is_above():
    """A complete model has at most 1.2 times the error of noise."""
    first = found(1.0, verdict="complete")
    assert more_credible(first, found(1.0 / 1.15)) is first
    assert more_credible(first, second := found(1.0 / 1.25)) is second


def test_a_sensor_is_not_blamed_for_what_effects_alone_explain_better():
    first = found(1.0, sensors=(object(),))
    assert more_credible(first, second := found(0.99)) is second
    assert more_credible(first, found(0.99, verdict="complete")) is first
    assert more_credible(first, found(0.99, sensors=(object(),))) is first


def test_simplicity_does_not_decide_where_a_sensor_fault_is_named():
    # The two would be errors of different logs.
    first = found(1.0, ends=3, sensors=(object(),))
    assert more_credible(first, found(1.0)) is first
