"""Long logs: a sample of all runs, chunks that are the whole, and sums in one pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import Cancelled, LogError
from planner.power.model import PowerModel
from planner.telemetry import sample
from planner.telemetry.candidates import candidate_library
from planner.telemetry.examine import Competitors, examine
from planner.telemetry.fit import fit
from planner.telemetry.rank_effects import diagnose
from planner.telemetry.sample import PIECE_ROWS, SAMPLE_ROWS, open_source
from planner.telemetry.select_effects import select
from planner.telemetry.shapes import shapes_of
from planner.telemetry.stream import examine_all
from tests.power.states import changed
from tests.telemetry.rows import measured, plain_log


def numbered(lengths):
    """A log whose power counts its rows."""
    log = plain_log(lengths)
    return replace(log, power=np.arange(len(log), dtype=float))


def test_a_short_log_is_its_own_sample():
    log = numbered([400, 20])
    source = open_source(log)
    assert source.complete
    assert source.sample is log
    assert [len(chunk) for chunk in source.chunks()] == [420]
    assert source.rows == 420
    assert source.run_rows.tolist() == [400, 20]


@pytest.mark.parametrize(
    "lengths", [[30_000], [4000] * 12, [900] * 30, [13_000, 1, 700, 2]], ids=str
)
def test_the_sample_of_a_long_log(lengths):
    log = numbered(lengths)
    source = open_source(log)
    kept = source.sample
    assert not source.complete
    assert source.rows == len(log)
    assert source.run_rows.tolist() == lengths
    assert 0.3 * SAMPLE_ROWS < len(kept) <= SAMPLE_ROWS
    at = kept.power.astype(int)
    assert np.all(np.diff(at) > 0)
    np.testing.assert_array_equal(kept.run, log.run[at])
    np.testing.assert_array_equal(kept.time, log.time[at])
    # Pieces of consecutive rows, for noise that is correlated.
    breaks = np.flatnonzero((np.diff(at) > 1) | (np.diff(kept.run) != 0))
    pieces = np.diff([-1, *breaks, len(at) - 1])
    assert np.median(pieces) >= PIECE_ROWS // 2
    # Every run that is long enough is there in proportion.
    for run, length in enumerate(lengths):
        if length >= 4 * PIECE_ROWS:
            share = np.count_nonzero(kept.run == run) / length
            assert share == pytest.approx(len(kept) / len(log), rel=0.6)


@pytest.mark.parametrize("longest", [9000, 5000])
def test_chunks_are_the_whole_log_run_by_run(monkeypatch, longest):
    monkeypatch.setattr(sample, "CHUNK_ROWS", 4001)
    monkeypatch.setattr(sample, "LONGEST_RUN", longest)
    log = numbered([9000, 5000, 8003])
    chunks = list(open_source(log).chunks())
    np.testing.assert_array_equal(np.concatenate([c.power for c in chunks]), log.power)
    np.testing.assert_array_equal(np.concatenate([c.run for c in chunks]), log.run)
    assert max(map(len, chunks)) <= longest + 4001
    last = [c.run[-1] for c in chunks[:-1]]
    first = [c.run[0] for c in chunks[1:]]
    # Runs that can be held back are whole; of longer ones only parts come.
    cut = any(a == b for a, b in zip(last, first, strict=True))
    assert bool(cut) is (longest < 9000)


def test_a_file_is_sampled_as_the_log_in_memory(motion, monkeypatch):
    monkeypatch.setattr(sample, "SAMPLE_ROWS", 700)
    monkeypatch.setattr(sample, "CHUNK_ROWS", 330)  # three runs
    from_file, in_memory = open_source(motion.source), open_source(motion)
    assert not from_file.complete
    assert from_file.rows == in_memory.rows == len(motion)
    assert from_file.describe() == in_memory.describe()
    whole = np.concatenate([chunk.power for chunk in from_file.chunks()])
    np.testing.assert_array_equal(whole, motion.power)
    assert len(from_file.sample) <= 700


def test_reading_is_cancelled_between_chunks(motion):
    with pytest.raises(Cancelled):
        open_source(motion.source, cancelled=lambda: True)


def test_what_is_no_log_is_refused():
    with pytest.raises(LogError, match="no log"):
        open_source(17)  # type: ignore[arg-type]


# One pass over a log that is longer than its sample.

SCRUB = 3.0


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
    competitors = Competitors(candidate_library(fitted.model, log), shapes_of(log))
    examination = examine(log, competitors)
    return examination, select(examination)


def streamed(monkeypatch, log, whole, sample_rows: int, chunk_rows: int):
    """The log examined in chunks after its sample."""
    monkeypatch.setattr(sample, "SAMPLE_ROWS", sample_rows)
    monkeypatch.setattr(sample, "CHUNK_ROWS", chunk_rows)
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
    standing = next(s for s in selection.standings if s.name == "yaw_scrub")
    column = standing.member.columns[0]
    return float(standing.coefficients[0]), 1.0 / np.sqrt(
        examination.evidence.clear[column, column]
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
    monkeypatch.setattr(sample, "SAMPLE_ROWS", 1400)
    monkeypatch.setattr(sample, "CHUNK_ROWS", 500)
    found = diagnose(log, base)
    assert found.selected == whole.selected == ("yaw_scrub",)
    assert {c.effect for c in found.candidates} == {c.effect for c in whole.candidates}
    for candidate in found.candidates:
        if candidate.heldout_rmse_w is not None:
            assert candidate.heldout_rmse_w >= 0.98 * found.after.heldout_rmse_w
