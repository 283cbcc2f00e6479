"""A search whose sensors' errors held-out runs support; else one without sensors.

    found = with_supported_sensors(source, start, search)
    corrections_of(found)         # kind of a sensor's error → its size and standard error

A sensor takes the blame for whatever it resembles. So it must explain what usual errors of
everything else cannot, most of the excess over the floor, and leave little more than the floor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.diagnosis.decision import stands
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR, floor_of
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import base_fit, heldout_residual, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted
from planner.telemetry.other_terms import GIVEN, given_columns, measured_residual
from planner.telemetry.sampling import LogSource
from planner.telemetry.selection import Found


def with_supported_sensors(
    source: LogSource, start: PowerModel, search: Callable[..., Found]
) -> Found:
    """A search; without errors of sensors, where correcting them does not explain the log.

    Args:
        source: the log as it was measured, at steady speeds.
        start: the model, not yet fitted.
        search: of that log, find_missing_effects, which may be told the ``sensors`` to consider.
    """
    found = search()
    if not corrections_of(found):
        return found
    before, after = without_and_with_sensors(source, start, found)
    floor = floor_behind(found)
    near = rms(counted(after, floor)) <= MOST_OVER_FLOOR * rms(floor)
    if near and supports(found.log, before, after, floor) and stands(before, after, floor):
        return found
    return search(sensors=frozenset())


def without_and_with_sensors(
    source: LogSource, start: PowerModel, found: Found
) -> tuple[Array, Array]:
    """Held-out residuals (n,) W as measured: of the model as it is, and once sensors are right.

    Usual errors of data sheet and other sensors explain what they can, before and after.
    """
    sizes = {kind: value for kind, (value, _) in found.corrections.items()}
    faulty = corrections_of(found)
    log = as_measured_by(source, found)
    base = base_fit(log, start)
    before = _least(log, base, GIVEN.beside(given_columns(log, base.model, base.watts), faulty))
    fitted = found.fitted if found.additions else found.base
    after = _least(found.log, fitted, GIVEN.beside(found.examination.given, faulty))
    return before, measured_residual(after, sizes)


def _least(log: Telemetry, fitted: Fit, given: Array) -> Array:
    """(n,) W, held-out residual of a fit, with usual errors (n, k) W where these predict better."""
    each = heldout_residual(log, fitted), heldout_residual(log, fitted, given)
    return min(each, key=rms)


def as_measured_by(source: LogSource, found: Found) -> Telemetry:
    """The rows with the errors of their sensors, read from the meter that was found."""
    return replace(source.sample, meter=found.log.meter)


def floor_behind(found: Found) -> Array:
    """(n,) W, standard deviation of every row of a search that no model can undercut."""
    members = [m for m in found.selection.members if not m.sensor]
    explained = [c for m in members for c in m.columns]
    return floor_of(found.log, found.examination, explained, exact=found.given is None)


def corrections_of(found: Found) -> dict[str, tuple[float, float]]:
    """Kind of every sensor's error → its size and standard error."""
    values = dict(found.corrections)
    for member in found.selection.members:
        if member.sensor:
            ranked = found.selection.ranked(member.name)
            before = values.get(member.name, (0.0, 0.0))[0]
            values[member.name] = (before + float(ranked.coefficients[0]), ranked.stderr)
    return values
