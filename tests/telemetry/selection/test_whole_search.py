"""One pass over a log that is longer than its sample says what memory says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.cache import CACHE
from planner.power.model import PowerModel
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine, examine_all
from planner.telemetry.evidence.evidence import Evidence
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.sampling import LogSource, open_source
from planner.telemetry.selection.select_effects import select
from planner.telemetry.terms import candidate_library
from tests.power.states import changed
from tests.telemetry.rows import measured

SCRUB = 3.0
LACKING = {"motor_temp", "ambient_temp", "battery_voltage"}
STRONG = {
    "viscous_drag": {"viscous_drag__viscous_torque": 2e-5},
    "stiction": {"stiction__strength": 1.2, "stiction__stiction_speed": 0.05},
}


@pytest.fixture(scope="module")
def turning(motion, base):
    """A log of a robot that scrubs when it turns, and the base model fitted to it."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    log = measured(motion, changed(robot, yaw_scrub__scrub_moment=SCRUB), 0.02, seed=31)
    return log, fit(log, base)


@pytest.fixture(scope="module")
def whole(turning):
    """The log examined in memory."""
    log, fitted = turning
    competitors = DesignColumns(candidate_library(fitted.model, log), Dictionary.of(log))
    examination = examine(log, competitors)
    return examination, select(examination)


def streamed(monkeypatch, log, whole, sample_rows: int, chunk_rows: int):
    """The log examined in chunks after its sample."""
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", sample_rows)
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", chunk_rows)
    source = open_source(log)
    assert not source.complete
    first = examine(source.sample, whole[0].competitors)
    chosen = [c for m in select(first).members for c in m.columns]
    shares = []
    found = examine_all(
        source, first, chosen, (), lambda c: c, lambda share, _: shares.append(share)
    )
    assert found.evidence.rows == len(log)
    assert shares == sorted(shares)
    return found, select(found)


def of_scrub(examination, selection):
    """Estimate and standard error."""
    ranked = next(s for s in selection.ranking if s.name == "yaw_scrub")
    column = ranked.member.columns[0]
    return float(ranked.coefficients[0]), 1.0 / np.sqrt(
        examination.evidence.partial[column, column]
    )


def test_one_pass_says_what_memory_says(turning, whole, monkeypatch):
    log, _ = turning
    found, selection = streamed(monkeypatch, log, whole, 1400, 500)
    assert [m.name for m in selection.members] == ["yaw_scrub"]
    assert [m.name for m in whole[1].members] == ["yaw_scrub"]
    mine, error = of_scrub(found, selection)
    theirs, _ = of_scrub(*whole)
    assert abs(mine - theirs) < error
    # Linear around a model that has none of it: near the truth, not within its error.
    assert mine == pytest.approx(SCRUB, rel=0.15)


def test_sums_hardly_depend_on_where_chunks_end(turning, whole, monkeypatch):
    log, _ = turning
    # Runs of 110 rows: chunks of 111 end one row into the second run, of 109 one row before.
    results = [streamed(monkeypatch, log, whole, 1400, rows) for rows in (500, 111, 109)]
    first, selection = results[0]
    value, error = of_scrub(first, selection)
    for found, chosen in results[1:]:
        assert np.all(np.isfinite(found.evidence.total))
        assert [m.name for m in chosen.members] == ["yaw_scrub"]
        assert of_scrub(found, chosen)[0] == pytest.approx(value, abs=error)
        scale = np.sqrt(np.diag(first.evidence.total))
        change = (found.evidence.total - first.evidence.total) / np.outer(scale, scale)
        assert np.abs(change).max() < 0.15


def test_what_the_sample_refuted_is_told_all_the_same(turning, base, monkeypatch):
    log, _ = turning
    whole = diagnose(log, base)
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", 1400)
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", 500)
    CACHE.clear()  # it knows the diagnosis of the whole log
    found = diagnose(log, base)
    assert found.selected == whole.selected == ("yaw_scrub",)
    assert {c.effect for c in found.candidates} == {c.effect for c in whole.candidates}
    for candidate in found.candidates:
        if candidate.heldout_rmse_w is not None:
            assert candidate.heldout_rmse_w >= 0.98 * found.after.heldout_rmse_w


@pytest.mark.parametrize("slug", ["viscous_drag", "stiction"])
def test_a_long_log_is_asked_for_the_columns_that_it_lacks(slug, motion, base, monkeypatch):
    """What part effects that look alike is worked out on the sample."""
    real = changed(PowerModel.from_vehicle(base.vehicle, effects=(slug,)), **STRONG[slug])
    log = replace(motion, present=motion.present - LACKING)
    log = measured(log, real, 0.02, seed=31)
    whole = diagnose(log, base)
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", 1000)
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", 500)
    CACHE.clear()  # it knows the diagnosis of the whole log
    found = diagnose(log, base)
    assert found.selected == whole.selected == (slug,)
    assert [e.separates for e in found.experiments] == [e.separates for e in whole.experiments]


def test_what_the_model_holds_is_summed_up(turning, whole, monkeypatch):
    """An effect that refits have left behind is in what they leave, refuted or not."""
    log, fitted = turning
    rows = {"sample_rows": 700, "chunk_rows": 300}
    all_rows, _ = streamed(monkeypatch, log, whole, **rows)
    library, kept = whole[0].competitors.library, all_rows.competitors.library.candidates
    dropped = [n for n, one in enumerate(library.candidates) if not any(one is k for k in kept)]
    around = library.around(fitted.model, 1e-6 * library.amplitudes, dropped)
    held = examine(log, replace(whole[0].competitors, library=around))
    found, _ = streamed(monkeypatch, log, (held, None), **rows)
    reduced = found.competitors.library
    assert [reduced.candidates[n] for n in reduced.held] == [around.candidates[n] for n in dropped]
    np.testing.assert_array_equal(
        reduced.amplitudes[list(reduced.held)], around.amplitudes[dropped]
    )


def test_what_resembles_an_effect_that_the_model_holds_is_summed_up(turning, whole, monkeypatch):
    """It may be there in that one's place, however little the sample shows of it."""
    log, fitted = turning
    library = whole[0].competitors.library
    held = [n for n, one in enumerate(library.candidates) if of(library, one) == "yaw_scrub"]
    around = library.around(fitted.model, library.amplitudes, held)
    examined = examine(log, replace(whole[0].competitors, library=around)), None
    kept = []
    for alike in (False, True):
        monkeypatch.setattr(Evidence, "aliased", lambda _self, _one, _other, same=alike: same)
        found, _ = streamed(monkeypatch, log, examined, sample_rows=700, chunk_rows=300)
        reduced = found.competitors.library
        kept.append({of(reduced, one) for one in reduced.candidates})
    apart, together = kept
    assert apart < together


def of(library, candidate):
    """The effect that a candidate belongs to."""
    return library.model.slots[candidate.place][0].slug
