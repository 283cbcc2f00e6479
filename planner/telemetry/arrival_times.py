"""Whether a log's times are those of arrival: its rows stand at even moments then.

    source = on_even_clock(open_source("recorded.csv"), start)     # as it was where they are not

Rows that arrive in bunches have neither accelerations nor neighbours, and a meter beside them seems
to average over seconds. On an even clock held-out runs are predicted better. Rows that were
measured at uneven moments are predicted worse by one.
"""

from __future__ import annotations

from planner.power.model import PowerModel
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Finding
from planner.telemetry.sampling import LogSource
from planner.telemetry.tilt_filter import CLEARLY_LESS


def on_even_clock(source: LogSource, start: PowerModel) -> LogSource:
    """The log on an even clock, where that predicts held-out runs clearly better.

    Args:
        source: the log as read.
        start: the model as stated.
    """
    even = source.evenly_timed()
    if even is None:
        return source
    # A meter beside uneven rows takes long, and would make good what the times are wrong by.
    usual, other = (
        overall_error(*metered_base_fit(one.steady().sample, start, (None,)))
        for one in (source, even)
    )
    if other >= CLEARLY_LESS * usual:
        return source
    said = "time: rows arrive in bunches; taken at the even moments at which they were measured"
    return even.with_findings([Finding("arrival times", "time", 0, said)])
