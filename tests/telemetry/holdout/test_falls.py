"""When a held-out error counts as fallen: by its size, or by what every row is sure of."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.holdout.heldout import deviance, falls, rms

ROWS = 2000
UNSURE = slice(0, 20)


def residuals() -> tuple[np.ndarray, np.ndarray]:
    """(n,) residuals in W and their spreads; a hundredth of the rows is twenty times as unsure."""
    rng = np.random.default_rng(5)
    spread = np.full(ROWS, 0.2)
    spread[UNSURE] = 4.0
    return spread * rng.standard_normal(ROWS), spread


def test_a_smaller_error_has_fallen() -> None:
    before, spread = residuals()
    assert falls(before, 0.9 * before, spread)
    assert not falls(before, before, spread)
    assert not falls(before, 1.1 * before, spread)


def test_unsure_rows_do_not_hide_what_all_others_say() -> None:
    before, spread = residuals()
    after = 0.8 * before
    after[UNSURE] = 1.15 * before[UNSURE]
    assert rms(after) > rms(before)
    assert deviance(after, spread) < 0.9 * deviance(before, spread)
    assert falls(before, after, spread)


@pytest.mark.parametrize("rise", [1.0, 1.2])
def test_unsure_rows_alone_speak_for_nothing(rise: float) -> None:
    before, spread = residuals()
    after = before.copy()
    after[UNSURE] = rise * before[UNSURE]
    assert not falls(before, after, spread)


def test_a_little_clarity_does_not_excuse_a_great_rise() -> None:
    before, spread = residuals()
    after = 0.97 * before
    after[UNSURE] = 1.6 * before[UNSURE]
    assert rms(after) > 1.25 * rms(before)
    assert not falls(before, after, spread)
