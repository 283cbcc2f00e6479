"""A log of any length as a sample that fits into memory, and as chunks that stream past.

    source = open_source("drive.parquet")      # or a Telemetry
    source.sample                              # the whole log up to SAMPLE_ROWS rows
    for chunk in source.chunks(): ...          # all of it, in the order of the file

What is nonlinear (fits, the noise, the size of an effect) is settled on the sample; sums over all
rows are then formed in one pass over the chunks. The sample of a long log is made of pieces of
consecutive rows, evenly spread over all runs, because noise is correlated along the run.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from planner.arrays import Integers
from planner.errors import LogError
from planner.progress import Progress, silent
from planner.telemetry.logs import (
    Finding,
    LogLike,
    MappingLike,
    Meter,
    Telemetry,
    pieces_of,
)
from planner.telemetry.sampling.even_clock import with_even_clock
from planner.telemetry.sampling.held_motion import (
    Holds,
    holds_of,
    with_motion_between_updates,
)
from planner.telemetry.sampling.late_odometry import (
    has_tilt,
    with_earlier_tilt,
    with_tilt_freed,
)
from planner.telemetry.sampling.motion_reading import (
    AS_LOGGED,
    USUAL,
    MotionReading,
    averaged_for,
    motions_for,
    readings_for,
)
from planner.telemetry.sampling.noisier_motion import with_more_noise

FEWEST_ROWS = 10
"""Rows of a log that anything is fitted to: more than a base model has parameters."""
TILT_LAGS = (0.05, 0.1, 0.15, 0.2, 0.25)
"""s by which pitch and roll may be late."""
TILT_FILTERS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
"""s, time constants by which pitch and roll may follow an accelerometer; usual ones, √2 apart."""
NOISIER_COPIES = 2
"""Copies of a log with noise added, over which the chance of what was added averages out."""


@dataclass(frozen=True, eq=False)
class LogSource:
    """A log, opened.

    Attributes:
        sample: at most SAMPLE_ROWS rows, with the labels and the report of the whole log.
        rows: number of rows of the whole log.
        run_rows: (runs,) rows of every run.
        complete: True when the sample is the whole log.
        path, mapping: where the chunks come from; None for a log in memory.
        reading: how their motion is taken in ``sample`` and chunks.
        tilt_lag: s by which pitch and roll were late; they are earlier in ``sample`` and chunks.
        tilt_filter: s, time constant by which they follow an accelerometer, 0 for none; what it
            makes of accelerations is not in ``sample`` and chunks.
        rested: whether that filter felt nothing before each run.
        even: whether rows stand at the even moments at which they were measured, not at those at
            which they arrived.
        holds: rows between updates of speeds and of angles that go from one to the next; 0 where
            they are as read.
        derived: whether accelerations follow from the speeds though the log measured some.
    """

    sample: Telemetry
    rows: int
    run_rows: Integers
    complete: bool
    log: Telemetry | None
    path: Path | None
    mapping: MappingLike | None
    reading: MotionReading = AS_LOGGED
    tilt_lag: float = 0.0
    tilt_filter: float = 0.0
    rested: bool = False
    even: bool = False
    holds: Holds = (0.0, 0.0)
    derived: bool = False

    SAMPLE_ROWS: ClassVar[int] = 12_000
    PIECE_ROWS: ClassVar[int] = 200
    CHUNK_ROWS: ClassVar[int] = 50_000
    LONGEST_RUN: ClassVar[int] = 20_000
    """Most rows of a run that are held back until its end is there."""

    def read_as(self, reading: MotionReading) -> LogSource:
        """The same log, as it was opened, its motion read so."""
        return replace(self, sample=reading.of(self.sample), reading=reading)

    def steady(self) -> LogSource:
        """The same log in its usual reading: the speeds of steady drives at their means."""
        return self.read_as(USUAL)

    def noisier_as(self, read: LogSource) -> tuple[Telemetry, ...]:
        """Samples of this log, as it was opened, with as much noise of the motion again.

        Args:
            read: the same log in the reading that the samples get, too.
        """
        copies = []
        for number in range(NOISIER_COPIES):
            noisier = with_more_noise(self.sample, np.random.default_rng(number))
            copies.append(read.reading.of(noisier))
        return tuple(copies)

    def with_meter(self, meter: Meter | None) -> LogSource:
        """The same log, its power read from a meter."""
        return replace(self, sample=replace(self.sample, meter=meter))

    def evenly_timed(self) -> LogSource | None:
        """The log, as it was opened, on an even clock; None where its runs are too short."""
        sample = with_even_clock(self.sample)
        return None if sample is None else replace(self, sample=sample, even=True)

    def between_updates(self) -> LogSource | None:
        """The log, as it was opened, with motion between updates; None where none is held."""
        holds = holds_of(self.sample)
        if not any(holds):
            return None
        return replace(self, sample=with_motion_between_updates(self.sample, holds), holds=holds)

    def by_changes_of_speed(self) -> LogSource | None:
        """The log, as it was opened, without its measured accelerations; None where it has none."""
        sample = self.sample.without_accelerometer()
        measured = sample.present != self.sample.present
        return replace(self, sample=sample, derived=True) if measured else None

    def earlier_tilts(self) -> tuple[LogSource, ...]:
        """The log, as it was opened, with pitch and roll by each of TILT_LAGS earlier."""
        return tuple(
            replace(self, sample=with_earlier_tilt(self.sample, lag), tilt_lag=lag)
            for lag in TILT_LAGS
            if has_tilt(self.sample)
        )

    def freed_tilts(self) -> tuple[LogSource, ...]:
        """The log, as it was opened, with tilts without accelerations by each of TILT_FILTERS."""
        tried = TILT_FILTERS if has_tilt(self.sample) else ()
        return tuple(self.freed_tilt(seconds) for seconds in tried)

    def freed_tilt(self, seconds: float, *, rested: bool = False) -> LogSource:
        """The log, as it was opened, with tilts without what such a filter makes of accelerations.

        Args:
            seconds, rested: as ``tilt_filter`` and ``rested``.
        """
        freed = with_tilt_freed(self.sample, seconds, rested=rested)
        return replace(self, sample=freed, tilt_filter=seconds, rested=rested)

    def with_findings(self, findings: Sequence[Finding]) -> LogSource:
        """The same log, its report longer by what showed only beside a model."""
        report = (*self.sample.report, *findings)
        return replace(self, sample=replace(self.sample, report=report))

    def without_findings(self, kind: str) -> LogSource:
        """The same log, its report without those of a kind that another clock makes false."""
        report = tuple(finding for finding in self.sample.report if finding.kind != kind)
        return replace(self, sample=replace(self.sample, report=report))

    def readings(self) -> tuple[LogSource, ...]:
        """The log, as it was opened, in each reading of its rows; the usual one comes first."""
        return tuple(map(self.read_as, readings_for(self.sample)))

    def motions(self) -> tuple[LogSource, ...]:
        """The log, as it was opened, with motions of other moments that its power may follow."""
        return tuple(map(self.read_as, motions_for(self.sample)))

    def averaged(self) -> tuple[Telemetry, ...]:
        """The sample with its motion averaged over neighbouring rows, as little as ``motions``."""
        return averaged_for(self.sample)

    def chunks(self) -> Iterator[Telemetry]:
        """The whole log in chunks of about CHUNK_ROWS rows, and of whole runs as far as they go.

        What belongs together within a run, its noise and its steady drives, is then the same
        wherever the file was cut. Of runs beyond LONGEST_RUN rows only parts come at a time.
        """
        if self.complete:
            yield self.sample
        else:
            for chunk in _whole_runs(self._read()):
                if self.even:
                    even = with_even_clock(chunk)
                    chunk = chunk if even is None else even
                if any(self.holds):
                    chunk = with_motion_between_updates(chunk, self.holds)
                if self.derived:
                    chunk = chunk.without_accelerometer()
                if self.tilt_lag:
                    chunk = with_earlier_tilt(chunk, self.tilt_lag)
                if self.tilt_filter:
                    chunk = with_tilt_freed(chunk, self.tilt_filter, rested=self.rested)
                yield self.reading.of(chunk)

    def _read(self) -> Iterator[Telemetry]:
        if self.log is not None:
            for start in range(0, len(self.log), LogSource.CHUNK_ROWS):
                yield self.log.take(slice(start, start + LogSource.CHUNK_ROWS))
        else:
            assert self.path is not None
            yield from Telemetry.chunks(self.path, self.mapping, rows=LogSource.CHUNK_ROWS)

    @property
    def content(self) -> str:
        """SHA-256 of all that the log says, under this mapping and in this reading."""
        whole = self.sample if self.log is None else self.log
        tilt = self.tilt_lag, self.tilt_filter, self.rested
        recorded = self.even, self.holds, self.derived
        said = self.mapping, self.reading, *tilt, *recorded, whole.run_names, whole.surfaces
        read = sorted(whole.present), whole.power_at, whole.meter
        digest = hashlib.sha256(repr((said, read)).encode())
        digest.update(json.dumps(self.describe()).encode())
        for name, values in whole.arrays().items():
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(values).data)
        return digest.hexdigest()

    def describe(self) -> dict[str, Any]:
        """Source, hash, size and findings, ready for JSON."""
        log = self.sample
        return {
            "source": log.source,
            "sha256": log.sha256 if log.source and Path(log.source).exists() else None,
            "rows": self.rows,
            "runs": len(self.run_rows),
            "report": [asdict(finding) for finding in log.report],
            "derived": list(log.derived),
            "assumed": list(log.assumed),
        }


def open_source(
    log: LogLike, mapping: MappingLike | None = None, watch: Progress = silent
) -> LogSource:
    """Open a log that was read already, is a table in memory or stands on disk.

    Args:
        log: what Telemetry.read gave, or what it takes.
        mapping: a mapping file for other names, units and signs, or its content.
        watch: progress, called after every chunk; raises when the caller cancelled.

    Raises:
        LogError: the log cannot be used, or has too few rows.
        Cancelled: raised by ``watch``.
    """
    if not isinstance(log, Telemetry | str | Path):
        log = Telemetry.read(log, mapping)
    kept, path = (log, None) if isinstance(log, Telemetry) else (None, Path(log))
    if isinstance(log, Telemetry):
        chunks = iter([log])
    else:
        chunks = Telemetry.chunks(log, mapping, rows=LogSource.CHUNK_ROWS)
    picker = _Picker()
    for last in chunks:
        picker.add(last)
        watch(0.0, f"reading {picker.rows:,} rows")
    in_memory = kept is not None and picker.stride == 1
    sample = last if in_memory else picker.sample(last)  # Telemetry.chunks refuses an empty log
    if len(sample) < FEWEST_ROWS:
        raise LogError(
            sample.source or "log",
            f"has only {len(sample)} usable rows",
            accepted=f"{FEWEST_ROWS} rows or more, better some minutes in several runs",
        )
    run_rows = np.array([picker.run_rows.get(run, 0) for run in range(len(sample.run_names))])
    return LogSource(sample, picker.rows, run_rows, picker.stride == 1, kept, path, mapping)


class _Picker:
    """Keeps every ``stride``-th piece of a run; the stride doubles whenever too much is kept.

    Each run starts to count at another piece, so that the sample holds the beginnings of some runs
    and the ends of others, and of many short runs an even choice.
    """

    def __init__(self) -> None:
        self.kept: list[tuple[int, Telemetry]] = []
        self.stride = 1
        self.rows = 0
        self.run_rows: dict[int, int] = {}
        self._pieces: dict[int, int] = {}
        self._size = 0

    def add(self, chunk: Telemetry) -> None:
        """Take a chunk in; chunks come in the order of the log."""
        self.rows += len(chunk)
        runs, counts = np.unique(chunk.run, return_counts=True)
        for run, count in zip(runs.tolist(), counts.tolist(), strict=True):
            self.run_rows[run] = self.run_rows.get(run, 0) + count
        for start, stop in _pieces(chunk.run):
            run = int(chunk.run[start])
            number = run + self._pieces.get(run, 0)
            self._pieces[run] = self._pieces.get(run, 0) + 1
            if number % self.stride:
                continue
            self.kept.append((number, chunk.take(np.arange(start, stop))))  # a copy
            self._size += stop - start
            while self._size > LogSource.SAMPLE_ROWS and len(self.kept) > 1:
                self.stride *= 2
                self.kept = [(n, piece) for n, piece in self.kept if n % self.stride == 0]
                self._size = sum(len(piece) for _, piece in self.kept)

    def sample(self, last: Telemetry) -> Telemetry:
        """The pieces as one log, with the labels of the last chunk."""
        return Telemetry.joined([piece for _, piece in self.kept], last)


def _whole_runs(chunks: Iterator[Telemetry]) -> Iterator[Telemetry]:
    """The chunks, each ending with a run, unless the run is too long to be held back."""
    waiting: list[Telemetry] = []
    for chunk in chunks:
        known = Telemetry.joined([*waiting, chunk], chunk)
        end = int(np.searchsorted(known.run, known.run[-1]))  # runs are numbered as they come
        if len(known) - end > LogSource.LONGEST_RUN:
            end = len(known)
        if end:
            yield known.take(slice(0, end))
        waiting = [known.take(slice(end, None))] if end < len(known) else []
    yield from waiting


def _pieces(run: Integers) -> Iterator[tuple[int, int]]:
    for start, stop in pieces_of(run):
        for at in range(start, stop, LogSource.PIECE_ROWS):
            yield at, min(at + LogSource.PIECE_ROWS, stop)
