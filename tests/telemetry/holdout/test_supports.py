"""When held-out runs support a claim: by the size of the error, or by what every row is sure of."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.telemetry.holdout.heldout import (
    LEAST_FALL,
    LEAST_FORMULA_FALL,
    rms,
    supports,
)
from planner.telemetry.noise import CLIP, counted

ROWS, RUNS = 2000, 10
UNSURE = slice(0, 20)


def runs(count: int) -> Any:
    """So many runs of two hundred rows."""
    return SimpleNamespace(run=np.repeat(np.arange(count), ROWS // RUNS))


@pytest.fixture
def log() -> Any:
    """Ten runs."""
    return runs(RUNS)


def residuals() -> tuple[np.ndarray, np.ndarray]:
    """(n,) residuals in W and their spreads; a hundredth of the rows is twenty times as unsure."""
    rng = np.random.default_rng(5)
    spread = np.full(ROWS, 0.2)
    spread[UNSURE] = 4.0
    return spread * rng.standard_normal(ROWS), spread


def test_a_smaller_error_supports_a_claim(log: Any) -> None:
    before, spread = residuals()
    assert supports(log, before, 0.9 * before, spread)
    assert not supports(log, before, before, spread)
    assert not supports(log, before, 1.1 * before, spread)


@pytest.mark.parametrize("formula", [False, True])
def test_a_formula_needs_more_than_an_effect(log: Any, formula: bool) -> None:
    spread = np.full(ROWS, 0.2)
    before = spread * np.random.default_rng(5).standard_normal(ROWS)
    least = LEAST_FORMULA_FALL if formula else LEAST_FALL
    for share, enough in ((0.8 * least, False), (1.2 * least, True)):
        assert supports(log, before, (1.0 - share) * before, spread, formula=formula) is enough
    assert LEAST_FORMULA_FALL > LEAST_FALL


@pytest.mark.parametrize("formula", [False, True])
def test_a_part_of_the_fall_may_be_no_merit_of_the_claim(log: Any, formula: bool) -> None:
    spread = np.full(ROWS, 0.2)
    before = spread * np.random.default_rng(5).standard_normal(ROWS)
    # Runs gain unevenly: what is no merit says nothing about how many of them gain.
    after = np.linspace(0.86, 0.98, RUNS)[log.run] * before
    for grown, enough in ((1.0, True), (1.02, True), (1.08, False), (1.2, False)):
        found = supports(log, before, after, spread, formula=formula, grown=grown)
        assert found is enough, grown


def test_a_fall_in_one_run_is_no_support(log: Any) -> None:
    before, spread = residuals()
    before += np.where(log.run == 3, 1.0, 0.0)
    after = np.where(log.run == 3, 0.0, before)
    assert rms(after) < 0.9 * rms(before)
    assert not supports(log, before, after, spread)


def test_runs_that_a_claim_hardly_changes_do_not_speak_against_it(log: Any) -> None:
    spread = np.full(ROWS, 0.2)
    rng = np.random.default_rng(2)
    noise = spread * rng.standard_normal(ROWS)
    # What pulls to one side acts in three runs; what is claimed is off a little elsewhere.
    there = np.isin(log.run, (2, 5, 6))
    before = noise + np.where(there, 0.6, 0.0)
    after = noise + np.where(there, 0.1, rng.choice([-0.05, 0.05], RUNS)[log.run])
    assert supports(log, before, after, spread, formula=True)
    # Runs that it changes as much, and that are no better with it, do.
    wrong = np.where(there, after, noise + np.where(log.run % 2, 0.6, 0.0))
    before = noise + 0.6 * np.where(there | (log.run % 2 == 0), 1.0, 0.0)
    assert rms(wrong) < 0.95 * rms(before)
    assert not supports(log, before, wrong, spread, formula=True)


def test_parts_that_gain_the_same_support_a_claim(log: Any) -> None:
    before = np.where(np.arange(ROWS) % 2, 0.2, -0.2)
    assert supports(log, before, 0.8 * before, np.full(ROWS, 0.2), formula=True)


def test_what_chance_may_show_supports_no_claim_that_nothing_asks_for(log: Any) -> None:
    """Errors that fall in some runs and rise in others, by two standard errors altogether."""
    before = np.where(np.arange(ROWS) % 2, 0.2, -0.2)
    shares = np.array([0.07, 0.06, 0.08, -0.05, 0.07, 0.06, 0.08, -0.05, -0.06, 0.07])
    spread = np.full(ROWS, 0.2)
    for shift, enough in ((0.0, False), (0.03, True)):
        after = (1.0 - shares - shift)[log.run] * before
        assert supports(log, before, after, spread)
        assert supports(log, before, after, spread, chosen=True) is enough


def test_a_run_of_one_row_is_no_failure() -> None:
    log = SimpleNamespace(run=np.repeat(np.arange(5), [200, 200, 200, 200, 1]))
    before = 0.2 * np.random.default_rng(1).standard_normal(len(log.run))
    shares = np.linspace(0.7, 0.8, 5)[log.run]
    assert supports(log, before, shares * before, np.full(len(before), 0.2))


@pytest.mark.parametrize("count", [4, 5, 7, 9])
def test_of_few_runs_all_speak_for_a_claim_and_one_does_not(count: int) -> None:
    log = runs(count)
    spread = np.full(len(log.run), 0.2)
    before = spread * np.random.default_rng(count).standard_normal(len(log.run))
    shares = np.random.default_rng(1).uniform(0.7, 1.0, 2 * count)
    everywhere = np.repeat(shares, ROWS // RUNS // 2) * before
    assert supports(log, before, everywhere, spread, formula=True)
    once = np.where(log.run == 1, 0.3, 1.0) * before
    assert rms(once) < 0.96 * rms(before)
    assert not supports(log, before, once, spread)


def test_a_run_of_hard_driving_says_no_more_than_another(log: Any) -> None:
    spread = np.full(ROWS, 0.2)
    before = spread * np.random.default_rng(6).standard_normal(ROWS)
    # Far apart in size, as a run with a load and one without are.
    size = np.where(log.run == 3, 4.0, 1.0)
    shares = np.linspace(0.85, 0.95, RUNS)[log.run]
    assert supports(log, size * before, size * shares * before, size * spread, formula=True)
    shares[log.run > 5] = 1.2
    assert not supports(log, size * before, size * shares * before, size * spread, formula=True)


def test_unsure_rows_do_not_hide_what_all_others_say(log: Any) -> None:
    before, spread = residuals()
    after = 0.8 * before
    after[UNSURE] = 1.03 * before[UNSURE]
    assert supports(log, before, after, spread)
    assert not supports(log, before, after, spread, formula=True)


@pytest.mark.parametrize("rise", [1.0, 1.2])
def test_unsure_rows_alone_speak_for_nothing(log: Any, rise: float) -> None:
    before, spread = residuals()
    after = before.copy()
    after[UNSURE] = rise * before[UNSURE]
    assert not supports(log, before, after, spread)


def test_a_fiftieth_of_the_rows_counts_at_the_clip() -> None:
    spread = np.full(1000, 0.5)
    residual = np.zeros(1000)
    residual[:30] = np.linspace(10.0, 40.0, 30)
    kept = counted(residual, spread)
    assert np.count_nonzero(kept == CLIP * 0.5) == 20
    assert np.array_equal(kept[:10], residual[:10])
    assert np.array_equal(counted(-residual, spread), -kept)
