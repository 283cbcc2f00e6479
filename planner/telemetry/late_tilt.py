"""Whether pitch and roll of a log are late against its power and its speeds.

    source = with_prompt_tilt(open_source("ramp.csv"), start)     # as it was where they are not

An inertial sensor's filter makes them late. Where the ground changes, the power then seems to lead
the slope. That looks like a shorter meter, and like effects of rollers and of changing slopes. With
earlier angles the power must be clearly likelier, and held-out runs be predicted better.
"""

from __future__ import annotations

from planner.power.model import PowerModel
from planner.telemetry.estimation import followed_motions
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.logs import Finding
from planner.telemetry.sampling import LogSource

CLEARLY_LESS = 0.98
"""Held-out error over that of the usual reading, or with its meter, below which another one is
believed; smaller differences are scatter between choices of the held-out runs."""


def with_prompt_tilt(source: LogSource, start: PowerModel, *, settled: bool = False) -> LogSource:
    """The log with pitch and roll of the moment that its power follows.

    Args:
        source: the log as read.
        start: the model as stated.
        settled: as for ``followed_motions``.
    """
    earlier = {each.tilt_lag: each for each in source.earlier_tilts()}
    motions = [each.steady() for each in earlier.values()]
    # One of them is enough to see whether any is followed.
    if not followed_motions(source, start, motions[1:2], settled=settled):
        return source
    followed = followed_motions(source, start, motions, settled=settled)
    usual, likeliest = (
        overall_error(*metered_base_fit(each.sample, start))
        for each in (source.steady(), followed[0])
    )
    if likeliest >= CLEARLY_LESS * usual:
        return source
    best = earlier[followed[0].tilt_lag]
    said = f"pitch and roll: they come about {best.tilt_lag:g} s after the power; this was undone"
    return best.with_findings([Finding("late tilt", "", 0, said)])
