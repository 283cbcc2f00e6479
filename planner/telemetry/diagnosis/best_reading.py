"""Which reading of a log's motion predicts its power best: odometry and controller decide.

    source = best_reading(open_source("drive.csv"), start)

Where rows are short, changes of speed within some tenths of a second are noise of the odometry or
the robot's motion, and accelerations follow them. Held-out runs say which (LogSource.readings).
The power may also follow a motion of another moment (LogSource.motions).
"""

from __future__ import annotations

from planner.power.model import PowerModel
from planner.telemetry.estimation import followed_motions
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Finding, Meter, same_meter
from planner.telemetry.sampling import LogSource
from planner.telemetry.tilt_filter import CLEARLY_LESS


def best_reading(source: LogSource, start: PowerModel) -> LogSource:
    """The log in the reading whose held-out error is least, with the meter that it shows.

    Rows that leave no choice keep their meter for the search to find.

    Args:
        source: the log as read.
        start: the model as stated.
    """
    usual, *others = source.readings()
    followed = followed_motions(source, start)
    if not others and not followed:
        return usual
    log, base = metered_base_fit(usual.sample, start)
    best, least, meter = usual, CLEARLY_LESS * overall_error(log, base), log.meter
    trials: list[tuple[LogSource, list[tuple[Meter | None] | None]]] = []
    if others:
        # A smooth motion shows a meter best, of ramps or of parabolas, whatever the reading.
        smooth = [one for one in others if one.reading.half_width][:2] or others[:1]
        shown = [metered_base_fit(one.sample, start) for one in smooth]
        metered, _ = min(shown, key=lambda fitted: overall_error(*fitted))
        same = same_meter(meter, metered.meter)
        meters = [(meter,)] if same else [(meter,), (metered.meter,)]
        trials += [(reading, [*meters]) for reading in others]
    # Beside a motion of another moment it is another one.
    trials += [(reading, [None]) for reading in followed]
    for reading, knowns in trials:
        found = [metered_base_fit(reading.sample, start, known) for known in knowns]
        errors = [overall_error(*each) for each in found]
        at = -1 if errors[-1] < CLEARLY_LESS * errors[0] else 0
        if errors[at] < least:
            best, least, meter = reading, errors[at], found[at][0].meter
    if best.reading.lag:
        best = best.with_findings([_late(best.reading.lag)])
    return best.with_meter(meter)


def _late(lag: float) -> Finding:
    return Finding(
        "late motion",
        "",
        0,
        f"motion: the power leads it, as if a filter of about {lag:g} s had made the speeds late, "
        "such as that of fused odometry; this filter was undone",
    )
