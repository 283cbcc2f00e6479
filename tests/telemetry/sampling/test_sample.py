"""Long logs: a sample of all runs, chunks that are the whole, and sums in one pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.errors import Cancelled, LogError
from planner.telemetry.sampling.sample import LogSource, open_source
from tests.telemetry.rows import plain_log


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
    assert 0.3 * LogSource.SAMPLE_ROWS < len(kept) <= LogSource.SAMPLE_ROWS
    at = kept.power.astype(int)
    assert np.all(np.diff(at) > 0)
    np.testing.assert_array_equal(kept.run, log.run[at])
    np.testing.assert_array_equal(kept.time, log.time[at])
    # Pieces of consecutive rows, for noise that is correlated.
    breaks = np.flatnonzero((np.diff(at) > 1) | (np.diff(kept.run) != 0))
    pieces = np.diff([-1, *breaks, len(at) - 1])
    assert np.median(pieces) >= LogSource.PIECE_ROWS // 2
    # Every run that is long enough is there in proportion.
    for run, length in enumerate(lengths):
        if length >= 4 * LogSource.PIECE_ROWS:
            share = np.count_nonzero(kept.run == run) / length
            assert share == pytest.approx(len(kept) / len(log), rel=0.6)


@pytest.mark.parametrize("longest", [9000, 5000])
def test_chunks_are_the_whole_log_run_by_run(monkeypatch, longest):
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", 4001)
    monkeypatch.setattr(LogSource, "LONGEST_RUN", longest)
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
    monkeypatch.setattr(LogSource, "SAMPLE_ROWS", 700)
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", 330)  # three runs
    from_file, in_memory = open_source(motion.source), open_source(motion)
    assert not from_file.complete
    assert from_file.rows == in_memory.rows == len(motion)
    assert from_file.describe() == in_memory.describe()
    whole = np.concatenate([chunk.power for chunk in from_file.chunks()])
    np.testing.assert_array_equal(whole, motion.power)
    assert len(from_file.sample) <= 700


def test_reading_is_cancelled_between_chunks(motion):
    with pytest.raises(Cancelled):
        open_source(motion.source, watch=CancellationToken(lambda: True).watched())


def test_what_is_no_log_is_refused():
    with pytest.raises(LogError, match="is not a log"):
        open_source(17)  # type: ignore[arg-type]


def test_content_is_that_of_every_row_and_of_how_it_was_read():
    log = numbered([13_000, 700])
    content = open_source(log).content
    assert open_source(numbered([13_000, 700])).content == content
    power, chunk = log.power.copy(), open_source(log).sample
    left_out = int(np.setdiff1d(np.arange(len(log)), chunk.power.astype(int))[0])
    power[left_out] += 1.0
    others = [
        replace(log, power=power),
        replace(log, power_at="source"),
        replace(log, present=log.present | {"payload"}),
        replace(log, surfaces=("carpet",)),
    ]
    assert content not in {open_source(other).content for other in others}
    assert open_source(log).steady().content != content
