"""Probabilities of candidates: what noise that lasts for a run must not make of them."""

from __future__ import annotations

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, Examination, examine
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.selection.select_effects import select, with_robust_probabilities
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured

NOISE = 0.02
GUST = 2.0
"""W at 1 m/s, of what a run has more or less."""


def summed_up(log: Telemetry, model) -> Examination:
    """The log around the fit to it."""
    fitted = fit(log, model)
    library = candidate_library(fitted.model, log)
    return examine(log, DesignColumns(library, Dictionary.of(log)))


def square_of_speed(log: Telemetry):
    return log.rows[:, INDEX["vx"]] ** 2 + log.rows[:, INDEX["vy"]] ** 2


@pytest.mark.parametrize("seed", [4, pytest.param(0, marks=pytest.mark.nightly)])
def test_what_runs_have_either_way_is_hardly_an_effect(motion, base, seed):
    """Fourteen runs, each with more or less drag than the data sheet says: none on average."""
    by_run = np.random.default_rng(seed).standard_normal(int(motion.run.max()) + 1)
    gusts = GUST * by_run[motion.run] * square_of_speed(motion)
    examination = summed_up(measured(motion, base, NOISE, seed=seed, extra=gusts), base)
    selection = select(examination)
    assert not selection.members
    likely = [ranked.name for ranked in selection.ranking if ranked.probability > 0.9]
    assert likely, "rows that are taken for independent make something of it"
    told = with_robust_probabilities(examination, selection)
    assert all(told.ranked(name).probability < 0.4 for name in likely)


def test_what_every_run_has_stays_likely(motion, base):
    drag = GUST * square_of_speed(motion) ** 1.5
    examination = summed_up(measured(motion, base, NOISE, seed=1, extra=drag), base)
    selection = select(examination)
    (name,) = [member.name for member in selection.members]
    told = with_robust_probabilities(examination, selection)
    assert told.ranking[0].name == name
    assert told.ranking[0].probability > 0.9
    others = [ranked.probability for ranked in told.ranking[1:]]
    assert others == sorted(others, reverse=True)
