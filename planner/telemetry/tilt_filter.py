"""Whether a filter bent pitch and roll of a log: its power and its speeds show it.

    source = with_true_tilt(open_source("ramp.csv"), start)     # as it was where none did

An inertial sensor's filter makes angles late. Where the ground changes, the power then seems to
lead the slope. That looks like a shorter meter, and like effects of rollers and of changing slopes.
A filter that trusts an accelerometer takes speeding up for a slope. Gravity along a slope that is
not there then pays for the acceleration. That looks like a lighter robot, and like effects of
changing speeds. With other angles the power must be clearly likelier, or held-out runs support them
as much as an error of a sensor; in the end they must predict held-out runs better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.power.model import PowerModel
from planner.telemetry.estimation import followed_motions
from planner.telemetry.holdout import (
    base_fit,
    heldout_residual,
    meter_beside,
    metered_base_fit,
    overall_error,
    rms,
    supports,
)
from planner.telemetry.logs import Finding
from planner.telemetry.other_terms import given_columns
from planner.telemetry.sampling import LogSource

CLEARLY_LESS = 0.98
"""Held-out error over that of the usual reading, or with its meter, below which another one is
believed; smaller differences are scatter between choices of the held-out runs."""


def with_true_tilt(source: LogSource, start: PowerModel, *, settled: bool = False) -> LogSource:
    """The log with pitch and roll of the ground, at the moment that its power follows.

    Args:
        source: the log as read.
        start: the model as stated.
        settled: as for ``followed_motions``.
    """
    kinds = [kind for kind in (source.earlier_tilts(), source.freed_tilts()) if kind]
    # A short and a long one of each are enough to see whether any is followed.
    ends = [[kind[len(kind) // 4], kind[3 * len(kind) // 4]] for kind in kinds]
    first = [one.steady() for pair in ends for one in pair]
    likeliest: list[LogSource] = []
    if followed_motions(source, start, first, settled=settled):
        for kind in kinds:
            motions = [one.steady() for one in kind]
            likeliest += followed_motions(source, start, motions, settled=settled)[:1]
    kept = {bool(one.tilt_lag) for one in likeliest}
    others = [one for one in first if bool(one.tilt_lag) not in kept]
    if others and not settled:
        likeliest += _predicting(source, start, others)
    if not likeliest:
        return source
    usual = overall_error(*metered_base_fit(source.steady().sample, start))
    near = (_nearby(source, one, kinds, start) for one in likeliest)
    best, least = min(near, key=lambda found: found[1])
    if least >= CLEARLY_LESS * usual:
        return source
    if best.tilt_filter:
        name, said = "bent tilt", "their filter takes accelerations for slopes, over about {:g} s"
    else:
        name, said = "late tilt", "they come about {:g} s after the power"
    said = said.format(best.tilt_filter or best.tilt_lag)
    return best.with_findings([Finding(name, "", 0, f"pitch and roll: {said}; this was undone")])


def _predicting(
    source: LogSource, start: PowerModel, others: Sequence[LogSource]
) -> list[LogSource]:
    """Of logs with other tilts, the one that held-out runs support, if any.

    A model that is fitted to tilts with accelerations, or to late ones, is bent, and beside it the
    power need not seem likelier by others. Fits to both show it, alone or beside usual errors of
    what was given: those may hide it, or hide behind it.
    """
    usual = source.steady().sample
    log = meter_beside(usual, base_fit(usual, start).model)
    logs = [log, *(replace(one.sample, meter=log.meter) for one in others)]
    fits = [base_fit(each, start) for each in logs]
    given = [
        given_columns(each, fit.model, fit.watts) for each, fit in zip(logs, fits, strict=True)
    ]
    for beside in ([None] * len(logs), given):
        before, *after = map(heldout_residual, logs, fits, beside)
        left, best = min(zip(after, others, strict=True), key=lambda each: rms(each[0]))
        if supports(log, before, left, fits[0].spread):
            return [best]
    return []


def _nearby(
    source: LogSource, likeliest: LogSource, kinds: Sequence[Sequence[LogSource]], start: PowerModel
) -> tuple[LogSource, float]:
    """The log with the tilts nearest the likeliest ones that predict held-out runs best.

    The likelihood is that of a model whose inertia may have any sign: with less of it, a filter
    seems slower than it is. What was felt before a run is not known.
    """
    size = likeliest.tilt_lag, likeliest.tilt_filter
    kind = next(k for k in kinds if size in [(one.tilt_lag, one.tilt_filter) for one in k])
    at = [(one.tilt_lag, one.tilt_filter) for one in kind].index(size)
    log, base = metered_base_fit(likeliest.sample, start)
    least, meter = overall_error(log, base), log.meter

    def error_of(near: LogSource) -> float:
        return overall_error(*metered_base_fit(near.steady().sample, start, (meter,)))

    for step in (-1, 1):
        while 0 <= at + step < len(kind):
            error = error_of(kind[at + step])
            if error >= least:
                break
            at, least = at + step, error
    best = kind[at]
    if best.tilt_filter:
        rested = source.freed_tilt(best.tilt_filter, rested=True)
        best, least = min((best, least), (rested, error_of(rested)), key=lambda found: found[1])
    return best, least
