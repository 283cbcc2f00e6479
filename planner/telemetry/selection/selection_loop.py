"""The selection loop: fit, lay out, choose, compare refits, lay out anew, until the choice stays.

    found = investigate(log, model, extra, watch)         # on rows in memory

Round by round the chosen effects are fitted with all other parameters, and the design matrix is
computed anew around them, because it is linear and effects are not. A sensor fault is corrected in
the log, and the search starts again.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.progress import Progress
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import DesignColumns, Examination, examine
from planner.telemetry.holdout import (
    heldout_residual,
    meter_beside,
    metered_base_fit,
    rms,
)
from planner.telemetry.logs import Meter, Telemetry, same_meter
from planner.telemetry.other_terms import SENSORS, Dictionary, Sensor
from planner.telemetry.prediction import meter_columns
from planner.telemetry.selection.found import Found
from planner.telemetry.selection.full_refit_comparison import FullFits
from planner.telemetry.selection.predicting_fit import predicting_fit
from planner.telemetry.selection.select_effects import Selection, select
from planner.telemetry.selection.subset_search import CompetingModel, Member, members_of
from planner.telemetry.terms import Addition, CandidateLibrary, candidate_library

MOST_REFITS = 3
"""Rounds of refitting and laying out anew."""
MOST_METERS = 5
"""Meters that are estimated in turn around the same effects."""
MOST_SENSOR_ROUNDS = 8
"""Searches of one log, each with other corrections of sensors."""
Extra = Sequence[type[Effect]]
"""Custom effects that compete with the catalogue."""
REPEATED_FAULT_SHARE = 0.35
"""Share of a correction by which the same sensor may be off again; more is another effect."""


def investigate(
    sample: Telemetry,
    start: PowerModel,
    extra: Extra,
    watch: Progress,
    *,
    as_stated: bool = False,
    sensors: Collection[str] = frozenset(SENSORS),
    known: tuple[Meter | None] | None = None,
) -> Found:
    """Search rows in memory.

    Args:
        sample: the rows; their meter is estimated where they have none.
        start: the model, not yet fitted.
        extra: custom effects that compete with the catalogue.
        watch: progress; raises when the caller cancelled.
        as_stated: lay out around the model as it is given, not around its fit: where a strong
            effect has bent the fit out of shape, columns around it point nowhere (at_bounds).
        sensors: kinds whose errors compete.
        known: the meter where it is known; None takes that of the rows.
    """
    search = partial(
        _without_faults, sample, start, extra, watch, as_stated=as_stated, sensors=sensors
    )
    if known is None and sample.meter is not None:
        known = (sample.meter,)
    found = search(known=known)
    if not found.additions:
        return found
    # Around the effects that were found the meter may be another, or none. One that was estimated
    # beside a large misfit is far off, and leaves a misfit for the next one.
    log, fitted = found.log, found.fitted
    error = rms(heldout_residual(log, fitted))
    for _ in range(MOST_METERS):
        metered = meter_beside(log, fitted.model, fitted.places)
        if same_meter(metered.meter, log.meter):
            break
        # A likelier meter must predict held-out runs as well, or it follows errors of the inputs.
        anew = replace(found, log=metered).refit(found.additions)
        if (better := rms(heldout_residual(metered, anew))) >= error:
            break
        log, fitted, error = metered, anew, better
    return found if log is found.log else search(known=(log.meter,))


def _without_faults(
    sample: Telemetry,
    start: PowerModel,
    extra: Extra,
    watch: Progress,
    *,
    as_stated: bool,
    sensors: Collection[str],
    known: tuple[Meter | None] | None,
) -> Found:
    """Search rows for effects and faults of sensors; ``known`` is the meter where it is."""
    corrections: dict[str, tuple[float, float]] = {}
    believed = set(sensors)
    log = sample
    for number in range(MOST_SENSOR_ROUNDS):
        watch(0.15 + 0.05 * number, "laying out what every effect would add")
        log, base = metered_base_fit(log, start, known)
        origin = replace(base, model=base.begun) if as_stated else base
        library = candidate_library(origin.model, log, extra=extra)
        # A sensor that was corrected once may be corrected further by however little.
        competing = tuple(
            replace(s, least=0.0) if s.kind in corrections else s
            for s in SENSORS.values()
            if s.kind in believed and s.is_read_in(log.present)
        )
        share = 0.2 + 0.05 * number
        found = _settled(log, origin, library, competing, watch, share, exact=as_stated)
        found = replace(found, base=base, corrections=dict(corrections))
        if not found.additions:
            found = replace(found, fitted=base)
        faults = [m.name for m in found.selection.members if m.sensor]
        if not faults:
            break
        ranking = {kind: found.selection.ranked(kind) for kind in faults}
        sizes = {kind: float(ranked.coefficients[0]) for kind, ranked in ranking.items()}
        # A true error is gone once it was corrected. One that asks for more, or for its opposite,
        # stands for something else that the model lacks.
        wandering = {
            kind
            for kind, value in sizes.items()
            if kind in corrections and abs(value) > REPEATED_FAULT_SHARE * abs(corrections[kind][0])
        }
        # Around another linearisation an error may look plain that corrects next to nothing.
        check = partial(watch, 0.45, "fitting without the error of a sensor")
        fits = FullFits(log, base, found.examination, check)
        wandering |= {
            kind
            for kind in faults
            if not fits.confirmed(found.selection, kind, again=kind in corrections)
        }
        if wandering:
            believed -= wandering
            corrections = {k: v for k, v in corrections.items() if k in believed}
        else:
            for kind, value in sizes.items():
                before = corrections.get(kind, (0.0, 0.0))[0]
                corrections[kind] = (before + value, ranking[kind].stderr)
        log = corrected(sample, corrections)
    return found


def corrected(log: Telemetry, corrections: dict[str, tuple[float, float]]) -> Telemetry:
    """The log without errors of sensors, kind → size and its standard error."""
    for kind, (value, _) in corrections.items():
        log = SENSORS[kind].correct(log, value)
    return log


def _settled(
    log: Telemetry,
    base: Fit,
    library: CandidateLibrary,
    sensors: tuple[Sensor, ...],
    watch: Progress,
    share: float,
    *,
    exact: bool,
) -> Found:
    """Choose, refit, lay out anew, until the choice stays; ``exact`` as in DesignColumns."""
    numbers = meter_columns(log.take(slice(0, 2)), log.power[:2]).shape[1]
    dictionary = Dictionary.of(log)
    competitors = DesignColumns(
        library,
        dictionary,
        sensors,
        exact=exact,
        meter_numbers=numbers,
        even_w=base.noise.even_w,
    )
    examination = examine(log, competitors)
    known: list[CompetingModel] = []
    reached = share

    def check() -> None:
        watch(reached, "fitting competing models in full")

    def state() -> Found:
        settled = examination, selection, fitted, additions
        return Found(log, base, *settled, {}, base.model)

    def refit() -> tuple[tuple[Addition, ...], Fit]:
        wanted = additions_of(examination, selection)
        noise = examination.noise
        return wanted, predicting_fit(base.model, log, wanted, noise=noise, within=library.model)

    selection = _chosen(FullFits(log, base, examination, check), known)
    fitted = base
    additions: tuple[Addition, ...] = ()
    chosen: tuple[tuple[str, tuple[int, ...]], ...] = ()
    best: tuple[float, Found] | None = None
    for number in range(MOST_REFITS):
        members = [m for m in selection.members if not m.sensor]
        names = tuple((m.name, m.columns) for m in members)
        if names == chosen:
            break
        chosen = names
        reached = share + 0.04 * number
        watch(reached, "refitting with " + ", ".join(m.name for m in members))
        additions, fitted = refit()
        if exact and members:
            error = rms(heldout_residual(log, fitted))
            if best is None or error < best[0]:
                best = error, state()
        aliased = {name for aliases in selection.aliases.values() for name in aliases}
        competitors = replace(
            competitors,
            library=_relinearised(competitors, selection, members, fitted),
            testable_before=competitors.testable_before | aliased | {m.name for m in members},
        )
        explained = [c for m in selection.members for c in m.columns]
        if selection.shape is not None:
            explained.append(selection.shape.column)
        examination = examine(log, competitors, tuple(explained) or None)
        selection = _chosen(FullFits(log, base, examination, check), known)
    # Around stated values that are far off, later rounds may wander; the best one counts.
    settled = tuple((m.name, m.columns) for m in selection.members if not m.sensor) == chosen
    if best is not None and not (settled and rms(heldout_residual(log, fitted)) <= best[0]):
        return best[1]
    if not settled:
        # The last choice has not been fitted yet; names and parameters belong together.
        additions, fitted = refit()
    return state()


def additions_of(examination: Examination, selection: Selection) -> tuple[Addition, ...]:
    """The selected effects of the catalogue, as additions to a model."""
    library = examination.competitors.library
    return tuple(
        Addition.of(library, m.term, selection.ranked(m.name).coefficients)
        for m in selection.members
        if not m.sensor
    )


def _chosen(fits: FullFits, known: list[CompetingModel]) -> Selection:
    """The best subset, after a comparison with competing models fitted in full.

    ``known`` are alternatives of earlier rounds; those of this round replace them.
    """
    selection = select(fits.examination)
    found = _compared(fits, selection, known)
    if selection.exact and not any(m.sensor for m in found.members):
        # No sensor is to blame after all, so their usual errors stand beside every effect.
        found = _compared(fits, select(fits.examination, exact=False), known)
    return found


def _compared(fits: FullFits, selection: Selection, known: list[CompetingModel]) -> Selection:
    examination = fits.examination
    if not selection.members:
        return selection
    # An effect that was identifiable around other parameters need not be so here.
    there = members_of(examination, exact=selection.exact)
    able = [alternative for alternative in known if all(m in there for m in alternative.members)]
    ranked = fits.compare(selection, able)
    known[:] = [outcome.alternative for outcome in ranked]
    names = {m.name for m in selection.members}
    first: Selection | None = None
    for outcome in ranked:
        wanted = outcome.names
        stands = selection
        if wanted != names:
            members = outcome.alternative.members
            stands = select(
                examination, members, outcome.sizes, exact=selection.exact, shown=outcome.shown
            )
        aliases = {m.name: outcome.aliases.get(m.name, ()) for m in stands.members}
        stands = replace(stands, aliases=aliases)
        if stands.shape is not None or {m.name for m in stands.members} == wanted:
            return stands
        first = first or stands
    # Of no explanation do all members pass the tests: what is left of the best one.
    return first or selection


def _relinearised(
    competitors: DesignColumns, selection: Selection, members: Sequence[Member], fitted: Fit
) -> CandidateLibrary:
    """The library around the refitted parameters, each effect at the size that it seems to have."""
    library = competitors.library
    amplitudes = library.amplitudes.copy()
    for ranked in selection.ranking:
        if ranked.member.sensor or ranked.z < 3.0:
            continue
        for number, value in zip(ranked.member.term.columns, ranked.coefficients, strict=True):
            column = library.candidates[number]
            possible = float(np.clip(value, column.low, column.high))
            if abs(possible) > 0.05 * abs(amplitudes[number]):
                amplitudes[number] = possible
    values = dict(zip(fitted.model.parameter_names, fitted.model.parameters, strict=True))
    last_wheel = library.model.vehicle.layout.wheel_count - 1
    held = []
    for member in members:
        for number in member.term.columns:
            place = library.candidates[number].place
            _, name, parameter, element = library.model.slots[place]
            value = values[member.name, name, element]
            if parameter.per == "wheel":
                # Columns count from the last wheel, a fit from the mean.
                value -= values[member.name, name, last_wheel]
            null = library.model.parameters[place]
            if abs(value - null) > 1e-3 * abs(amplitudes[number]):
                amplitudes[number] = value - null
                held.append(number)
    return library.around(fitted.model, amplitudes, held)
