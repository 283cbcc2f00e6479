"""The search for what is missing: fit, lay out, choose, fit rivals, lay out anew, until it stays.

    found = investigate(log, model, extra, watch)         # on rows in memory
    found = with_all_rows(source, found, watch)           # a long log, once around that

Round by round the chosen effects are fitted with all other parameters, and everything is laid out
around them, because sums are linear and effects are not. A faulty sensor is corrected in the log,
and the search starts again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.telemetry.candidates import Atom, CandidateLibrary, candidate_library
from planner.telemetry.contest import addition_for, coefficients_of, confirmed, contest
from planner.telemetry.examine import Competitors, Examination, examine
from planner.telemetry.extend import Addition, completed, fit_with
from planner.telemetry.fit import Fit
from planner.telemetry.heldout import base_fit, heldout_rmse
from planner.telemetry.log import Telemetry
from planner.telemetry.sample import LogSource
from planner.telemetry.select_effects import Selection, Standing, select
from planner.telemetry.sensors import SENSORS, Sensor
from planner.telemetry.shapes import shapes_of
from planner.telemetry.stream import examine_all
from planner.telemetry.subsets import Member, Rival, members_of

Floats = NDArray[np.float64]
Watch = Callable[[float, str], None]

ROUNDS = 3
SENSOR_ROUNDS = 8
STEADY = 0.35
"""Share of a correction by which the same sensor may be off again."""


@dataclass(frozen=True)
class Found:
    """State of the search around the last linearisation.

    ``examination`` is of all rows, ``local`` of those in ``log``; the same for a short log.
    ``refuted`` are effects that these had refuted already, their members counted in ``local``.
    ``origin`` is where every fit with something added starts.
    """

    log: Telemetry
    base: Fit
    examination: Examination
    selection: Selection
    fitted: Fit
    additions: tuple[Addition, ...]
    corrections: dict[str, tuple[float, float]]
    local: Examination
    origin: PowerModel
    refuted: tuple[Standing, ...] = ()


def investigate(
    sample: Telemetry,
    start: PowerModel,
    extra: Sequence[type[Effect]],
    watch: Watch,
    *,
    as_stated: bool = False,
) -> Found:
    """Search rows in memory.

    Args:
        sample: the rows.
        start: the model, not yet fitted.
        extra: custom effects that compete with the catalogue.
        watch: progress; raises when the caller cancelled.
        as_stated: lay out around the model as it is given, not around its fit: where a strong
            effect has bent the fit out of shape, columns around it point nowhere (strained).
    """
    corrections: dict[str, tuple[float, float]] = {}
    believed = {s.kind for s in SENSORS}
    log = sample
    for number in range(SENSOR_ROUNDS):
        watch(0.15 + 0.05 * number, "laying out what every effect would add")
        base = base_fit(log, start)
        origin = replace(base, model=start) if as_stated else base
        library = candidate_library(origin.model, log, extra=extra)
        # A sensor that was corrected once may be corrected further by however little.
        sensors = tuple(
            replace(s, least=0.0) if s.kind in corrections else s
            for s in SENSORS
            if s.kind in believed
        )
        share = 0.2 + 0.05 * number
        found = _settled(log, origin, library, sensors, watch, share, exact=as_stated)
        found = replace(found, base=base, corrections=dict(corrections))
        if not found.additions:
            found = replace(found, fitted=base)
        faults = [m.name for m in found.selection.members if m.sensor]
        if not faults:
            break
        sizes = {kind: _size(found, kind) for kind in faults}
        # A true error is gone once it was corrected. One that asks for more, or for its opposite,
        # stands for something else that the model lacks.
        wandering = {
            kind
            for kind, (value, _) in sizes.items()
            if kind in corrections and abs(value) > STEADY * abs(corrections[kind][0])
        }
        # Around another linearisation an error may look plain that corrects next to nothing.
        wandering |= {kind for kind in faults if not _confirmed(found, kind, watch)}
        if wandering:
            believed -= wandering
            corrections = {k: v for k, v in corrections.items() if k in believed}
        else:
            for kind, (value, stderr) in sizes.items():
                before = corrections.get(kind, (0.0, 0.0))[0]
                corrections[kind] = (before + value, stderr)
        log = _corrected(sample, corrections)
    return found


def with_everything_free(found: Found) -> Found:
    """The same names, fitted with all their parameters and shapes (extend.completed)."""
    if not found.additions:
        return found
    library = found.local.competitors.library
    additions = completed(found.additions, library)
    fitted = fit_with(
        found.origin,
        found.log,
        additions,
        noise=found.local.noise,
        within=library.model,
        tried=True,
    )
    return replace(found, additions=additions, fitted=fitted)


def strained(base: Fit, start: PowerModel) -> bool:
    """Whether a fit ran into the bounds of what is physical: something strong is missing."""
    for place in base.places:
        low, high = start.slots[place][2].bounds
        before, value = start.parameters[place], base.model.parameters[place]
        near = 1e-6 * (high - low)
        if before != value and (value - low <= near or high - value <= near):
            return True
    return False


def _confirmed(found: Found, kind: str, watch: Watch) -> bool:
    def check() -> None:
        watch(0.45, "fitting without the error of a sensor")

    return confirmed(found.log, found.base, found.examination, found.selection, kind, check)


def _size(found: Found, kind: str) -> tuple[float, float]:
    """Size of a sensor's error and its standard error."""
    standing = next(s for s in found.selection.standings if s.name == kind)
    value = float(standing.coefficients[0])
    return value, abs(value) / max(standing.z, 1e-9)


def _corrected(log: Telemetry, corrections: dict[str, tuple[float, float]]) -> Telemetry:
    for kind, (value, _) in corrections.items():
        log = sensor_of(kind).correct(log, value)
    return log


def _settled(
    log: Telemetry,
    base: Fit,
    library: CandidateLibrary,
    sensors: tuple[Sensor, ...],
    watch: Watch,
    share: float,
    *,
    exact: bool,
) -> Found:
    """Choose, refit, lay out anew, until the choice stays.

    ``exact`` as in Competitors.
    """
    competitors = Competitors(library, shapes_of(log), sensors, exact=exact)
    examination = examine(log, competitors)
    known: list[Rival] = []

    reached = share

    def check() -> None:
        watch(reached, "fitting what comes near in full")

    selection = _chosen(log, base, examination, known, check)
    fitted = base
    additions: tuple[Addition, ...] = ()
    chosen: tuple[tuple[str, tuple[int, ...]], ...] = ()
    best: tuple[float, Found] | None = None
    for number in range(ROUNDS):
        members = [m for m in selection.members if not m.sensor]
        names = tuple((m.name, m.columns) for m in members)
        if names == chosen:
            break
        chosen = names
        reached = share + 0.04 * number
        watch(reached, "refitting with " + ", ".join(m.name for m in members))
        additions = tuple(
            addition_for(examination, m, coefficients_of(selection, m.name)) for m in members
        )
        fitted = fit_with(base.model, log, additions, noise=examination.noise, within=library.model)
        if exact and members:
            error = heldout_rmse(log, fitted)
            if best is None or error < best[0]:
                best = error, _found(log, base, examination, selection, fitted, additions)
        tied = {name for ties in selection.ties.values() for name in ties}
        competitors = replace(
            competitors,
            library=_relinearised(competitors, selection, members, fitted),
            told=competitors.told | tied | {m.name for m in members},
        )
        explained = [c for m in selection.members for c in m.columns]
        if selection.shape is not None:
            explained.append(selection.shape.column)
        examination = examine(log, competitors, tuple(explained) or None)
        selection = _chosen(log, base, examination, known, check)
    # Around stated values that are far off, later rounds may wander; the best one counts.
    settled = tuple((m.name, m.columns) for m in selection.members if not m.sensor) == chosen
    if best is not None and not (settled and heldout_rmse(log, fitted) <= best[0]):
        return best[1]
    if not settled:
        # The last choice has not been fitted yet; names and parameters belong together.
        members = [m for m in selection.members if not m.sensor]
        additions = tuple(
            addition_for(examination, m, coefficients_of(selection, m.name)) for m in members
        )
        fitted = fit_with(base.model, log, additions, noise=examination.noise, within=library.model)
    return _found(log, base, examination, selection, fitted, additions)


def _found(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    selection: Selection,
    fitted: Fit,
    additions: tuple[Addition, ...],
) -> Found:
    return Found(log, base, examination, selection, fitted, additions, {}, examination, base.model)


def _chosen(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    known: list[Rival],
    check: Callable[[], None],
) -> Selection:
    """The best subset of the sums, once it has stood against its rivals fitted in full.

    ``known`` are rivals of earlier rounds; those of this one join them. ``check`` is called before
    every fit; it raises when the caller cancelled.
    """
    selection = select(examination)
    if not selection.members:
        return selection
    # What could be told in an earlier round may drown in this one, around other parameters.
    there = members_of(examination)
    able = [rival for rival in known if all(m in there for m in rival.members)]
    ranked, near = contest(log, base, examination, selection, able, check)
    known[:] = near
    names = {m.name for m in selection.members}
    first: Selection | None = None
    for outcome in ranked:
        wanted = {m.name for m in outcome.members}
        stands = selection
        if wanted != names:
            stands = select(examination, outcome.members, outcome.sizes)
        ties = {m.name: outcome.ties.get(m.name, ()) for m in stands.members}
        stands = replace(stands, ties=ties)
        if stands.shape is not None or {m.name for m in stands.members} == wanted:
            return stands
        first = first or stands
    # Of no explanation do all members pass the tests: what is left of the best one.
    return first or selection


def atom_of(member: Member) -> Atom:
    """What a member that is no sensor does."""
    assert member.atom is not None  # sensors have none; callers leave them out
    return member.atom


def _relinearised(
    competitors: Competitors, selection: Selection, members: Sequence[Member], fitted: Fit
) -> CandidateLibrary:
    """The library around the refitted parameters, each effect at the size that it seems to have."""
    library = competitors.library
    amplitudes = library.amplitudes.copy()
    for standing in selection.standings:
        if standing.member.sensor or standing.z < 3.0:
            continue
        for number, value in zip(
            atom_of(standing.member).columns, standing.coefficients, strict=True
        ):
            column = library.candidates[number]
            possible = float(np.clip(value, column.low, column.high))
            if abs(possible) > 0.05 * abs(amplitudes[number]):
                amplitudes[number] = possible
    places = {
        (effect.slug, name, element): place
        for place, (effect, name, _, element) in enumerate(fitted.model.slots)
    }
    last_wheel = library.model.vehicle.layout.wheel_count - 1
    held = []
    for member in members:
        for number in atom_of(member).columns:
            column = library.candidates[number]
            name, _, element = column.parameter.partition(" ")
            value = fitted.model.parameters[places[member.name, name, int(element or 0)]]
            if library.model.slots[column.place][2].per == "wheel":
                # Columns count from the last wheel, a fit from the mean.
                value -= fitted.model.parameters[places[member.name, name, last_wheel]]
            null = library.model.parameters[column.place]
            if abs(value - null) > 1e-3 * abs(amplitudes[number]):
                amplitudes[number] = value - null
                held.append(number)
    return library.around(fitted.model, amplitudes, held)


def sensor_of(kind: str) -> Sensor:
    """The sensor's error of this kind."""
    return next(s for s in SENSORS if s.kind == kind)


def with_all_rows(source: LogSource, found: Found, watch: Watch) -> Found:
    """Sum up the whole log around what the sample said, and choose again."""
    corrections = found.corrections

    def correct(chunk: Telemetry) -> Telemetry:
        return _corrected(chunk, corrections)

    members = [c for m in found.selection.members for c in m.columns]
    rivals = {name for tied in found.selection.ties.values() for name in tied}
    examination = examine_all(source, found.examination, members, rivals, correct, watch)
    selection = select(examination)
    told = {standing.name for standing in selection.standings}
    refuted = tuple(s for s in found.selection.standings if s.name not in told)
    # Ties of the sample stay: rivals were fitted there in full.
    ties = {m.name: found.selection.ties.get(m.name, ()) for m in selection.members}
    selection = replace(selection, ties=ties)
    chosen = [m for m in selection.members if not m.sensor]
    additions = tuple(
        addition_for(examination, m, coefficients_of(selection, m.name)) for m in chosen
    )
    fitted = fit_with(
        found.origin,
        found.log,
        additions,
        noise=found.examination.noise,
        within=examination.competitors.library.model,
    )
    return replace(
        found,
        examination=examination,
        selection=selection,
        fitted=fitted,
        additions=additions,
        refuted=refuted,
    )
