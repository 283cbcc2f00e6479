"""Sufficient statistics of a long log, in one pass over all rows.

    examination = examine_all(source, examination_of_the_sample, chosen, correct, progress)

Noise, sizes and the parameters around which the model is taken come from the sample. What the
sample found untestable is left out, so are effects and errors of sensors that it has refuted, and
of the shapes only the strongest stay. Chunks are summed up one after the other, so that memory does
not grow with the log.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Array, Integers
from planner.progress import Progress
from planner.telemetry.evidence.design_matrix import DesignColumns, Examination
from planner.telemetry.evidence.evidence import Evidence
from planner.telemetry.evidence.gram_matrices import GramClusters
from planner.telemetry.logs import Telemetry, pieces_of
from planner.telemetry.noise import clipped
from planner.telemetry.prediction import input_uncertainty
from planner.telemetry.sampling import ClusterCounter, LogSource
from planner.telemetry.terms import Term

MOST_SHAPES = 30
"""Strongest shapes that are summed up over a long log; Gram matrices grow with their square."""
LEAST_STREAMED_Z = 1.5
"""z in the sample, beside the chosen effects, below which an effect is not summed up again. Any one
large enough to be named (selection.subset_search) has at least 4 in SAMPLE_ROWS rows."""
CHUNKS_AT_ONCE = 2
"""Chunks in work at a time; each takes some 100 MB."""


def examine_all(
    source: LogSource,
    sample: Examination,
    chosen: Sequence[int],
    alternatives: Collection[str],
    correct: Callable[[Telemetry], Telemetry],
    watch: Progress,
) -> Examination:
    """Sufficient statistics of the whole log.

    Args:
        source: the log.
        sample: the examination of its sample.
        chosen: columns of the sample's examination that were selected.
        alternatives: effects that stay in the race whatever the sample says of them.
        correct: takes the errors of sensors out of a chunk.
        watch: progress; raises when the caller cancelled.
    """
    reduced, kept, terms = _reduced(sample, chosen, alternatives)
    # Columns and coefficients that the residual is clipped around.
    explained = [*sample.evidence.tangent.tolist(), *chosen]
    coefficients = sample.evidence.fitted(explained)
    columns = [kept.index(column) for column in explained]
    clusters = ClusterCounter(source.rows)

    def summed(part: Telemetry, numbers: Integers) -> _Sums:
        part = correct(part)
        watts, raw = reduced.raw(part)
        model = reduced.library.held_model
        spread = sample.noise.spread(watts, input_uncertainty(model, part.rows_for(model.surfaces)))
        expected = raw[:, columns] @ coefficients
        raw[:, -1] = expected + clipped(raw[:, -1] - expected, spread)
        white = sample.noise.whiten(part, watts, spread, raw)
        raw /= spread[:, None]
        pieces = pieces_of(numbers)
        grams = [white[start:stop].T @ white[start:stop] for start, stop in pieces]
        runs = [int(part.run[start]) for start, _ in pieces]
        return _Sums(grams, runs, raw.T @ raw, len(raw))

    everything = _Sums([], [], np.zeros((len(kept), len(kept))), 0)
    with ThreadPoolExecutor(max_workers=CHUNKS_AT_ONCE) as workers:
        waiting: deque[Future[_Sums]] = deque()
        for chunk in source.chunks():
            waiting.append(workers.submit(summed, chunk, clusters.of(chunk)))
            if len(waiting) > CHUNKS_AT_ONCE:  # the next one is read while these are in work
                everything = everything.and_then(waiting.popleft().result())
                done = everything.rows
                watch(0.5 + 0.4 * done / source.rows, f"{done:,} of {source.rows:,} rows")
        while waiting:
            everything = everything.and_then(waiting.popleft().result())
    grams, runs, plain, rows = everything
    slow = sample.evidence.slow[kept]
    # What is known before the log is the sample's last cluster.
    grams.append(np.diag(reduced.known))
    runs.append(runs[-1])
    plain += np.diag(reduced.known)
    evidence = Evidence(reduced.tangent, GramClusters(grams, runs), plain, rows, slow)
    shapes = tuple(range(len(reduced.dictionary.shapes)))
    return replace(
        sample,
        competitors=reduced,
        evidence=evidence,
        terms=terms,
        shapes=shapes,
        raw=sample.raw[:, kept],
    )


def _reduced(
    sample: Examination, chosen: Sequence[int], alternatives: Collection[str]
) -> tuple[DesignColumns, list[int], tuple[Term, ...]]:
    """The columns that matter, their old numbers in the new order, and the terms renumbered."""
    old = sample.competitors
    wanted_terms = _worth_summing(sample, chosen, alternatives)
    # What the model holds is in what it leaves, wanted or not.
    used = sorted({*old.library.held, *(n for term in wanted_terms for n in term.columns)})
    number = {n: k for k, n in enumerate(used)}
    terms = tuple(
        replace(term, columns=tuple(number[n] for n in term.columns)) for term in wanted_terms
    )
    sensors = _open(sample, chosen, [old.sensor(k) for k in range(len(old.sensors))])
    shapes = list(sample.shapes)
    if len(shapes) > MOST_SHAPES:
        columns = [old.first_shape + k for k in shapes]
        z, _, _ = sample.evidence.test_each(columns, given=chosen)
        alone, _, _ = sample.evidence.test_each(columns)
        order = np.argsort(-np.maximum(z, alone))[:MOST_SHAPES]
        wanted = {shapes[k] for k in order}
        # A cosine keeps its sine: formulas over the heading need both.
        for k in list(wanted):
            if old.dictionary.shapes[k].kind in ("cos", "sin"):
                wanted.add(old.dictionary.quadrature(k))
        shapes = sorted(wanted)
    library = replace(
        old.library,
        candidates=tuple(old.library.candidates[n] for n in used),
        amplitudes=old.library.amplitudes[used],
        terms=terms,
        held=tuple(number[n] for n in old.library.held),
    )
    dictionary = old.dictionary.only(old.dictionary.shapes[k] for k in shapes)
    kept = [
        *range(old.tangent),
        *(old.candidate(n) for n in used),
        *sensors,
        *(old.first_shape + k for k in shapes),
        old.residual,
    ]
    faults = tuple(old.sensors[column - old.sensor(0)] for column in sensors)
    reduced = DesignColumns(library, dictionary, faults, meter_numbers=old.meter_numbers)
    return reduced, kept, terms


def _worth_summing(
    sample: Examination, chosen: Sequence[int], alternatives: Collection[str]
) -> list[Term]:
    """Effects that the sample has not refuted; where a shape is scanned, its best value only."""
    best: dict[str, tuple[float, Term]] = {}
    kept = []
    all_columns = sorted({sample.competitors.candidate(n) for a in sample.terms for n in a.columns})
    in_race = set(_open(sample, chosen, all_columns))
    held = set(sample.competitors.library.held)
    # What resembles them may be there in their place.
    alike = [sample.competitors.candidate(n) for n in held]
    in_race |= {
        column
        for column, other in itertools.product(all_columns, alike)
        if sample.evidence.aliased(column, other)
    }
    for term in sample.terms:
        columns = [sample.competitors.candidate(n) for n in term.columns]
        # What the model holds was chosen around it.
        picked = columns[0] in chosen or not held.isdisjoint(term.columns)
        if not picked and term.effect not in alternatives and in_race.isdisjoint(columns):
            continue
        if not term.scanned:
            kept.append(term)
            continue
        gain = np.inf if picked else sample.evidence.gain(columns)[0]
        if term.effect not in best or gain > best[term.effect][0]:
            best[term.effect] = (gain, term)
    return kept + [term for _, term in best.values()]


def _open(sample: Examination, chosen: Sequence[int], columns: list[int]) -> list[int]:
    """Columns that were chosen, or that the sample has not refuted beside those."""
    if not columns:
        return []
    z, _, _ = sample.evidence.test_each(columns, given=chosen)
    return [
        c
        for c, strength in zip(columns, z, strict=True)
        if strength >= LEAST_STREAMED_Z or c in chosen
    ]


class _Sums(NamedTuple):
    """Gram matrices of some rows: of each cluster whitened, of all rows scaled only."""

    grams: list[Array]
    runs: list[int]
    plain: Array
    rows: int

    def and_then(self, more: _Sums) -> _Sums:
        """These rows, and those that follow them."""
        grams, runs = self.grams + more.grams, self.runs + more.runs
        return _Sums(grams, runs, self.plain + more.plain, self.rows + more.rows)
