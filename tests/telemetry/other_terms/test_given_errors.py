"""Usual errors of data sheet and sensors: what each does to the power, and how sure a sheet is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.holdout import base_fit, heldout_residual, rms
from planner.telemetry.holdout.heldout import MOST_GIVEN
from planner.telemetry.logs import Meter
from planner.telemetry.other_terms.given_errors import (
    GIVEN,
    ONLY_BY_SIZE,
    SCALE,
    SHEET_SHARE,
    TILT,
    USUAL_TURN,
    given_columns,
    tolerance_of,
)
from planner.telemetry.other_terms.sensor_errors import SENSORS
from planner.telemetry.prediction import predict
from tests.telemetry.rows import measured

MASS, LATE = 0, -GIVEN.moments - 1
"""Columns of the data sheet's mass and of a late attitude."""


@pytest.fixture(scope="module")
def unsure(base):
    """The base model of a vehicle whose file states no uncertainty."""
    known = replace(base.vehicle.provenance, uncertainties={})
    return replace(base, vehicle=replace(base.vehicle, provenance=known))


def heavier(model, share):
    return replace(model, vehicle=replace(model.vehicle, mass=model.vehicle.mass * (1.0 + share)))


def test_a_column_is_what_an_error_of_one_standard_deviation_adds(motion, unsure):
    watts = predict(unsure, motion)
    columns = given_columns(motion, unsure, watts)
    assert columns.shape == (len(motion), GIVEN.total)
    share = 0.2 * SHEET_SHARE
    added = predict(heavier(unsure, share), motion) - watts
    assert 0.2 * columns[:, MASS] == pytest.approx(added, abs=0.03 * rms(added))


def test_a_stated_uncertainty_takes_the_place_of_the_usual_one(motion, unsure):
    watts = predict(unsure, motion)
    known = replace(unsure.vehicle.provenance, uncertainties={"body.mass": 0.5 * SHEET_SHARE})
    surer = replace(unsure, vehicle=replace(unsure.vehicle, provenance=known))
    wide, narrow = (rms(given_columns(motion, m, watts)[:, MASS]) for m in (unsure, surer))
    assert narrow == pytest.approx(0.5 * wide, rel=0.02)
    assert tolerance_of("speed_scale", surer.vehicle, 0.0) == pytest.approx(
        0.5 * tolerance_of("speed_scale", unsure.vehicle, 0.0)
    )
    tilt = (tolerance_of("slope_offset", model.vehicle, 0.0) for model in (unsure, surer))
    assert len(set(tilt)) == 1


def test_a_scale_of_power_is_tolerated_further_where_it_scatters(unsure):
    """By less than the scatter, which is independent of the error of the mass."""
    sure, further = (tolerance_of("power_scale", unsure.vehicle, error) for error in (0.0, 0.04))
    assert tolerance_of("speed_scale", unsure.vehicle, 0.0) < sure
    assert sure < further < sure + ONLY_BY_SIZE * 0.04


def test_an_accelerometer_that_is_not_there_has_no_bias(motion, base):
    watts = predict(base, motion)
    derived = replace(motion, present=motion.present - {"ax", "ay"})
    measured_too = replace(motion, present=motion.present | {"ax", "ay"})
    sums = [
        np.count_nonzero(np.any(given_columns(log, base, watts) != 0.0, axis=0))
        for log in (derived, measured_too)
    ]
    assert sums[0] == sums[1] - 2


def test_at_a_steady_power_its_moment_does_not_count(motion, base):
    steady = replace(motion, rows=np.tile(motion.rows[:1], (len(motion), 1)))
    columns = given_columns(steady, base, predict(base, steady))
    assert np.all(columns[:, -GIVEN.moments :] == 0.0)


def test_held_out_runs_do_not_forgive_what_no_data_sheet_has(motion, unsure):
    """Of a robot that is half as heavy again as its data sheet says."""
    log = measured(motion, heavier(unsure, 4.0 * MOST_GIVEN * SHEET_SHARE), 0.01, seed=3)
    fitted = base_fit(log, unsure)
    given = given_columns(log, unsure, fitted.watts)
    plain, relaxed = (rms(heldout_residual(log, fitted, beside)) for beside in (None, given))
    assert fitted.noise.floor_w < relaxed < plain


def test_a_turned_velocity_is_among_them(motion, base):
    """A column of its own for every error that sensor_errors corrects, but for the power's."""
    watts = predict(base, motion)
    rows = motion.rows.copy()
    x, y = rows[:, INDEX["vx"]].copy(), rows[:, INDEX["vy"]].copy()
    rows[:, INDEX["vx"]], rows[:, INDEX["vy"]] = x - 0.003 * y, y + 0.003 * x
    turned = predict(base, replace(motion, rows=rows)) - watts
    columns = given_columns(motion, base, watts)
    norms = np.linalg.norm(columns, axis=0)
    used = columns[:, norms > 0.0] / norms[norms > 0.0]
    cosines = np.abs(used.T @ turned) / np.linalg.norm(turned)
    assert cosines.max() > 0.9


def test_a_meter_shows_another_motion_as_it_shows_the_one_at_hand(motion, base):
    """One that reads every 2 s, and averages."""
    log = replace(motion, meter=Meter(0.4, 0.2, sampling="held", period_s=2.0))
    watts = predict(base, log)
    by_turned = given_columns(log, base, watts)[:, GIVEN.own["heading_misalignment"]]
    turned = SENSORS["heading_misalignment"].correct(log, USUAL_TURN)
    assert np.any(np.diff(watts) == 0.0)
    assert by_turned == pytest.approx(predict(base, turned) - watts, abs=1e-12)


def test_pitch_and_roll_behind_a_filter_are_among_them(motion, base):
    """A filter of 0.1 s, on slopes that the robot turns on; without a slope there is no column."""
    rows, smooth = motion.rows.copy(), 0.1 / motion.interval.mean()
    rows[:, INDEX["gravity_x"]] = np.sin(0.3 * motion.time)
    rows[:, INDEX["gravity_y"]] = np.cos(0.3 * motion.time)
    true = replace(motion, rows=rows)
    late = replace(motion, rows=rows.copy())
    for name in ("gravity_x", "gravity_y"):
        read = late.rows[:, INDEX[name]]
        for start, stop in late.segments():
            for k in range(start + 1, stop):
                read[k] = (smooth * read[k - 1] + rows[k, INDEX[name]]) / (1.0 + smooth)
    watts = predict(base, late)
    missed = predict(base, true) - watts
    column = given_columns(late, base, watts)[:, LATE]
    assert abs(column @ missed) > 0.95 * np.linalg.norm(column) * np.linalg.norm(missed)
    level = replace(late, present=late.present - {"pitch", "roll"})
    assert not given_columns(level, base, watts)[:, LATE].any()


@pytest.mark.parametrize("kind", sorted(set(SENSORS) - {"power_scale"}))
def test_a_sensor_is_tested_without_the_column_that_is_its_own(motion, base, kind):
    """What is left out is the error itself; what stays is another one."""
    derived = replace(motion, present=motion.present - {"ax", "ay"})
    watts = predict(base, derived)
    columns = given_columns(derived, base, watts)
    usual = {"speed_scale": -SCALE, "heading_misalignment": USUAL_TURN}
    error = SENSORS[kind].column(derived, base, watts, usual.get(kind, TILT))
    error /= np.linalg.norm(error)

    def likest(some):
        norms = np.linalg.norm(some, axis=0)
        return float(np.abs(error @ some[:, norms > 0.0] / norms[norms > 0.0]).max())

    kept = GIVEN.beside(columns, {kind})
    assert kept.shape == (len(motion), GIVEN.total - 1)
    assert likest(columns) > 0.99 > likest(kept)
