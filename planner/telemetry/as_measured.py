"""A log's rows as they were measured, where a recorder or an accelerometer says otherwise.

    source = as_measured(open_source("recorded.csv"), start)     # as it was if it wrote what is

Rows that arrive in bunches have neither accelerations nor neighbours, and a meter beside them seems
to average over seconds. Speeds that are held over several rows jump. Rows on an even clock, and a
motion between the updates, predict held-out runs better then. Rows that were measured at uneven
moments, and set-points, are predicted worse by them.

An accelerometer has a bias, and feels every bump. Where changes of the speeds say better how fast
the robot gains speed, they take the place of what it measured.
"""

from __future__ import annotations

import numpy as np

from planner.power.model import PowerModel
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Finding, Meter
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import LogSource, findings_of_accelerations
from planner.telemetry.tilt_filter import CLEARLY_LESS


def as_measured(source: LogSource, start: PowerModel) -> LogSource:
    """The log on an even clock, between updates, without accelerometer; each if clearly better.

    One follows the other, so that two which are only better together are not found.

    Args:
        source: the log as read.
        start: the model as stated.
    """
    return _by_speeds(_between_updates(_on_even_clock(source, start), start), start)


def _on_even_clock(source: LogSource, start: PowerModel) -> LogSource:
    uneven = source.sample.has_uneven_clock()
    even = source.evenly_timed() if uneven else None
    # A meter beside uneven rows takes long, and would make good what the times are wrong by.
    if even is None or not _predicts_better(even, source, start, (None,)):
        return _with_odd_accelerations(source)
    said = "time: rows arrive in bunches; taken at the even moments at which they were measured"
    # A gap between arrivals is none where the rows after it were late.
    even = even.without_findings("gap").with_findings([Finding("arrival times", "time", 0, said)])
    gaps = len(even.sample.segments()) - len(even.sample.run_pieces())
    if gaps and even.complete:
        text = f"time: {gaps} gaps between these moments; no derivative is taken across a gap"
        even = even.with_findings([Finding("gap", "time", gaps, text)])
    return _with_odd_accelerations(even)


def _with_odd_accelerations(source: LogSource) -> LogSource:
    """With what the checks that pass by once leave to who knows which clock is the right one."""
    known = {(finding.kind, finding.column) for finding in source.sample.report}
    found = findings_of_accelerations(source.sample)
    found = [one for one in found if (one.kind, one.column) not in known]
    return source.with_findings(found) if found else source


def _between_updates(source: LogSource, start: PowerModel) -> LogSource:
    between = source.between_updates()
    if between is None or not _predicts_better(between, source, start):
        return source
    said = "speeds or angles are held over several rows; taken between their updates"
    return between.with_findings([Finding("held", "", 0, said)])


def _by_speeds(source: LogSource, start: PowerModel) -> LogSource:
    derived = source.by_changes_of_speed()
    if derived is None or not _predicts_better(derived, source, start):
        return source
    dropped = sorted(source.sample.present - derived.sample.present)
    said = f"{', '.join(dropped)}: changes of the speeds predict the power better; these are taken"
    return derived.with_findings([Finding("derived", dropped[0], 0, said)])


def _predicts_better(
    other: LogSource,
    source: LogSource,
    start: PowerModel,
    known: tuple[Meter | None] | None = None,
) -> bool:
    """Whether held-out runs are predicted clearly better; ``known`` is as for the fit."""
    if not np.isfinite(predict(start, source.sample)).all():
        return False  # its caller says so
    usual, changed = (
        overall_error(*metered_base_fit(one.steady().sample, start, known))
        for one in (source, other)
    )
    return changed < CLEARLY_LESS * usual
