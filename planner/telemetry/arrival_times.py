"""Whether a log's times are those of arrival: its rows stand at even moments then.

    source = on_even_clock(open_source("recorded.csv"), start)     # at its own times if not

Rows that arrive in bunches have neither accelerations nor neighbours, and a meter beside them seems
to average over seconds. On an even clock held-out runs are predicted better. Rows that were
measured at uneven moments are predicted worse by one.
"""

from __future__ import annotations

from planner.power.model import PowerModel
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Finding
from planner.telemetry.sampling import LogSource, findings_of_accelerations, has_uneven_clock
from planner.telemetry.tilt_filter import CLEARLY_LESS


def on_even_clock(source: LogSource, start: PowerModel) -> LogSource:
    """The log on an even clock, where that predicts held-out runs clearly better.

    Args:
        source: the log as read.
        start: the model as stated.
    """
    if not has_uneven_clock(source.sample):
        return source
    # The checks that pass by once leave this to who knows which clock is the right one.
    usual = source.with_findings(findings_of_accelerations(source.sample))
    even = source.evenly_timed()
    if even is None:
        return usual
    # A meter beside uneven rows takes long, and would make good what the times are wrong by.
    error, other = (
        overall_error(*metered_base_fit(one.steady().sample, start, (None,)))
        for one in (usual, even)
    )
    if other >= CLEARLY_LESS * error:
        return usual
    said = "time: rows arrive in bunches; taken at the even moments at which they were measured"
    found = [Finding("arrival times", "time", 0, said), *findings_of_accelerations(even.sample)]
    # A gap between arrivals is none where the rows after it were late.
    gaps = len(even.sample.segments()) - len(even.sample.run_pieces())
    if gaps:
        text = f"time: {gaps} gaps between these moments in {len(even.sample)} rows; no derivative "
        found.append(Finding("gap", "time", gaps, f"{text}is taken across a gap"))
    return even.without_findings("gap").with_findings(found)
