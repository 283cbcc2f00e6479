"""Pictures of a diagnosis: curves go through known residuals, shares add up, the worst is shown."""

import json
from dataclasses import replace

import numpy as np
import pytest

from planner.telemetry.pictures import ELSEWHERE, pictures_of, shares_of, worst_stretch
from planner.telemetry.prediction import predict
from planner.telemetry.quantities_of_motion import all_axes
from planner.telemetry.regimes import regimes_of


@pytest.fixture(scope="module")
def watts(motion, base):
    """(n,) W; in one row of sixteen power flows back."""
    modelled = predict(base, motion)
    return modelled - np.quantile(modelled, 1 / 16)


def logged(motion, watts, extra, noise=0.3):
    scatter = np.random.default_rng(4).normal(0.0, noise, len(watts))
    return replace(motion, power=watts + extra + scatter)


def ripple(axes):
    return np.where(np.isfinite(axes["heading"]), 2.0 * np.cos(3.0 * axes["heading"]), 0.0)


KNOWN = {
    "heading": ripple,
    "slope_along": lambda axes: 3.0 * np.abs(axes["slope_along"]) / 0.1,
    "speed": lambda axes: 4.0 * axes["speed"] ** 2,
    "predicted_power": lambda axes: np.where(axes["predicted_power"] < 0.0, 5.0, 0.0),
}


@pytest.mark.parametrize("quantity", KNOWN)
def test_a_curve_goes_through_a_residual_of_one_quantity(motion, watts, quantity):
    axes = all_axes(motion.rows, watts=watts)
    truth = KNOWN[quantity](axes)
    log = logged(motion, watts, truth)
    (curve,) = pictures_of(log, watts, watts + truth, {"claimed": truth}, ()).curves
    assert (curve.of, curve.quantity) == ("claimed", quantity)
    assert len(curve.x) > 5
    # Dots scatter about the curve by their own standard errors, and both have the curve's size.
    z = (curve.missing - curve.fitted) / (0.3 / np.sqrt(curve.rows))
    assert np.all(np.abs(z) < 4.5)
    assert np.ptp(curve.fitted) > 0.5 * np.ptp(truth)


def test_a_claim_that_is_wrong_misses_the_dots(motion, watts):
    axes = all_axes(motion.rows, watts=watts)
    log = logged(motion, watts, ripple(axes))
    claimed = 4.0 * axes["speed"] ** 2
    (curve,) = pictures_of(log, watts, watts + claimed, {"claimed": claimed}, ()).curves
    assert curve.quantity == "speed"
    assert np.max(np.abs(curve.missing - curve.fitted)) > 1.0


def test_the_most_telling_curve_comes_first(motion, watts):
    axes = all_axes(motion.rows, watts=watts)
    parts = {"small": KNOWN["speed"](axes) * 0.1, "large": ripple(axes)}
    truth = sum(parts.values())
    curves = pictures_of(logged(motion, watts, truth), watts, watts + truth, parts, ()).curves
    assert [curve.of for curve in curves] == ["large", "small"]


def test_without_a_claim_the_worst_regime_says_over_what(motion, watts):
    axes = all_axes(motion.rows, watts=watts)
    log = logged(motion, watts, np.where(axes["speed"] > 0.5, 2.0, 0.0))
    regimes = regimes_of(log, log.power - watts, np.full(len(log), 0.3), watts)
    (curve,) = pictures_of(log, watts, None, {}, regimes).curves
    assert curve.of is None
    assert curve.fitted is None
    assert curve.quantity == "speed"


def test_shares_count_every_row_once(motion, watts):
    axes = all_axes(motion.rows, watts=watts)
    extra = np.where(axes["speed"] > 0.4, 2.0, 0.0) + 0.3 * ripple(axes)
    residual = logged(motion, watts, extra).power - watts
    regimes = regimes_of(motion, residual, np.full(len(motion), 0.3), watts)
    assert len(regimes) > 1
    assert sum(r.share_of_squared_error for r in regimes) > 1.0  # they overlap
    shares = shares_of(residual, axes, regimes)
    assert sum(share.rows for share in shares) == len(motion)
    assert sum(s.share_of_squared_error for s in shares) == pytest.approx(1.0)
    assert sum(s.share_of_squared_error for s in shares[:-1]) <= 1.0
    excess = [s.share_of_squared_error - s.share_of_rows for s in shares[:-1]]
    assert excess == sorted(excess, reverse=True)
    assert shares[-1].where == ELSEWHERE


def test_refused_braking_power_is_listed_first(motion, watts):
    # A robot that cannot feed back: it takes 0 W where the model predicts less.
    residual = logged(motion, watts, np.maximum(-watts, 0.0), 0.1).power - watts
    back = watts < 0.0
    regimes = regimes_of(motion, residual, np.full(len(motion), 0.3), watts)
    first = shares_of(residual, all_axes(motion.rows, watts=watts), regimes)[0]
    assert first.where.startswith("where the model predicts")
    assert first.share_of_squared_error > 0.5
    assert np.average(back, weights=residual**2) > 0.5


def test_the_stretch_is_the_worst_one(motion, watts):
    log = logged(motion, watts, 0.0)
    bad = slice(400, 420)
    power = log.power.copy()
    power[bad] += 20.0
    log = replace(log, power=power)
    shown = worst_stretch(log, {"before": watts, "after": watts + 1.0})
    assert shown is not None
    assert np.max(shown.measured - shown.predicted["before"]) > 15.0
    np.testing.assert_allclose(shown.predicted["after"], shown.predicted["before"] + 1.0)
    run = log.run_names.index(shown.run)
    assert run == log.run[410]


def test_numbers_are_strict_json(motion, watts):
    axes = all_axes(motion.rows, watts=watts)
    log = logged(motion, watts, ripple(axes))
    regimes = regimes_of(log, log.power - watts, np.full(len(log), 0.3), watts)
    made = pictures_of(log, watts, watts + ripple(axes), {"r": ripple(axes)}, regimes).to_json()
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    curve, stretch = made["curves"][0], made["stretch"]
    assert {len(curve[k]) for k in ("x", "missing_w", "stderr_w", "rows", "fitted_w")} == {
        len(curve["x"])
    }
    assert len(stretch["time_s"]) == len(stretch["measured_w"]) == len(stretch["predicted_w"])
