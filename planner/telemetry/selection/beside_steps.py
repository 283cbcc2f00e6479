"""The meter of a log in which something is switched.

    found = with_meter_beside_steps(found, search)

Where something is switched on during a run, a long filter takes the step for its own, and nothing
that the robot does fits any more. The meter was found without steps, since a filter that nobody
knows of looks like them. Held-out runs say which it is.
"""

from __future__ import annotations

from collections.abc import Callable

from planner.telemetry.holdout import LinearHeldout, meter_beside, rms
from planner.telemetry.logs import same_meter
from planner.telemetry.noise import strongest_columns
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.prediction import Readings
from planner.telemetry.selection.found import Found


def with_meter_beside_steps(found: Found, search: Callable[..., Found]) -> Found:
    """A search; the one with the meter that the log shows beside steps, where it predicts better.

    Args:
        found: the search with the meter as it was found; a shape stands out, or nothing is done.
        search: of the same log, which may be told the ``known`` meter.
    """
    shape, dictionary = found.selection.shape, found.examination.competitors.dictionary
    if shape is None or found.additions:
        return found
    axis = dictionary.shapes[shape.number].axis
    beside = dictionary.switched(axis)
    if not beside.shapes:
        return found
    # As stated: the fit has followed the meter as it was found.
    metered = meter_beside(found.log, found.base.begun, dictionary=beside)
    if same_meter(metered.meter, found.log.meter):
        return found
    other = search(known=(metered.meter,))
    return min((found, other), key=lambda each: _error(each, beside))


def _error(found: Found, beside: Dictionary) -> float:
    """W, held-out, of the model with the strongest of some shapes, to first order."""
    log, examination = found.log, found.examination
    rows = log.rows_for(examination.competitors.library.model.surfaces)
    columns = Readings.as_shown(log, beside.columns(rows))
    own = examination.raw[:, : examination.competitors.tangent]
    chosen = strongest_columns(examination.residual, own, columns)
    return rms(LinearHeldout(log, examination).residual_beside(columns[:, chosen]))
