"""Held-out errors from sums: of columns that were examined, and of others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.holdout import LinearHeldout, heldout_residual, rms
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.prediction import predict
from planner.telemetry.quantities_of_motion import motion_axes
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured

WATTS = 2.0


@pytest.fixture(scope="module")
def pulled(motion, base):
    """A log of a robot that a cable pulls to one side, W over the heading, and its examination."""
    axes = motion_axes(motion.rows)
    pull = np.maximum(np.cos(np.nan_to_num(axes["heading"]) - 0.4), 0.0) * axes["speed"]
    log = measured(motion, base, 0.02, seed=8, extra=WATTS * pull)
    fitted = fit(log, base)
    columns = DesignColumns(candidate_library(fitted.model, log), Dictionary.of(log))
    return log, fitted, examine(log, columns), pull


def test_without_more_it_is_the_error_of_the_fit(pulled):
    log, fitted, examination, _ = pulled
    exact = LinearHeldout(log, examination, exact=True)
    assert exact.rmse([]) == pytest.approx(rms(heldout_residual(log, fitted)), rel=0.05)


def test_rows_weigh_as_in_the_fit(motion, base):
    """What starts with the motion misleads weights that trust the quiet rows of a robot at rest."""
    moves = np.hypot(*motion.rows[:, [INDEX["vx"], INDEX["vy"]]].T) > 0.02
    watts = predict(base, motion) + 3.0 * moves
    noise = 0.02 * np.abs(watts) * np.random.default_rng(8).standard_normal(len(motion))
    log = replace(motion, power=watts + noise)
    fitted = fit(log, base, evenly=True)
    library = candidate_library(fitted.model, log)
    columns = DesignColumns(library, Dictionary.of(log), even_w=fitted.noise.even_w)
    examination = examine(log, columns)
    linear = LinearHeldout(log, examination, exact=True)
    assert linear.rmse([]) == pytest.approx(rms(heldout_residual(log, fitted)), rel=0.05)
    column = columns.first_shape + examination.shapes[0]
    examined = linear.residual_with([column])
    assert rms(linear.residual_beside(examination.raw[:, [column]]) - examined) < 1e-6


def test_a_column_is_the_same_examined_or_not(pulled):
    log, _, examination, _ = pulled
    linear = LinearHeldout(log, examination)
    for shape in examination.shapes[::20]:
        column = examination.competitors.first_shape + shape
        known = linear.residual_with([column])
        other = linear.residual_beside(examination.raw[:, [column]])
        assert rms(other - known) < 1e-6 * rms(known)


def test_usual_errors_explain_only_what_they_predict(pulled):
    """Nothing given is wrong here: what they fit of some runs is a mistake on the others."""
    log, _, examination, pull = pulled
    usual, exact = (LinearHeldout(log, examination, exact=exact) for exact in (False, True))
    first = examination.competitors.first_shape
    for shape in examination.shapes[::20]:
        assert usual.rmse([first + shape]) <= exact.rmse([first + shape])
    beside = (rms(linear.residual_beside(pull[:, None])) for linear in (usual, exact))
    assert next(beside) <= next(beside)


def test_the_true_cause_predicts_unseen_runs_best(pulled):
    log, _, examination, pull = pulled
    linear = LinearHeldout(log, examination)
    first = examination.competitors.first_shape
    others = min(linear.rmse([first + shape]) for shape in examination.shapes)
    assert rms(linear.residual_beside(pull[:, None])) < 0.95 * others
