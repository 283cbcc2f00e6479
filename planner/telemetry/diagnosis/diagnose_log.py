"""Name the physical effect that a model lacks, or say that it is not identifiable.

    diagnosis = diagnose("drive.csv", "minibalance")
    diagnosis.verdict, diagnosis.selected, diagnosis.sentence

In this order:

    fit        the model, robustly                                                   estimation
    lay out    a column for every effect, sensor fault and plain shape                 evidence
    choose     the best subset; test it; compare it with competing models             selection
    refit      model and chosen effects together, and lay out anew around them,
               until the choice stays; with a sensor fault, after correcting it
    all rows   of a long log are summed up once around the result of the sample
    outside    a residual that the catalogue does not explain gets a formula     unknown_effect

The search is planner.telemetry.selection.whole_search. Everything nonlinear happens on a sample of
at most 12,000 rows; memory does not grow with the log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.cancellation import CancellationToken
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.progress import Progress
from planner.telemetry.diagnosis.experiments import Advice
from planner.telemetry.diagnosis.reconcile import more_credible
from planner.telemetry.diagnosis.results import (
    Candidate,
    Diagnosis,
    Errors,
    Estimate,
    FittedModels,
    SensorFault,
)
from planner.telemetry.diagnosis.unknown_effect import Proposal, propose
from planner.telemetry.diagnosis.verdict import (
    never_complete_with_structure,
    sentence_of,
    verdict_of,
)
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import LinearHeldout, falls, heldout_residual, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import SENSORS
from planner.telemetry.regimes import regimes_of
from planner.telemetry.sampling import LogSource, open_source
from planner.telemetry.selection import Found, Member, RankedTerm, find_missing_effects
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import Addition, trimmed


def diagnose(
    log: Telemetry | str | Path,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: str | Path | None = None,
    extra: Sequence[type[Effect]] = (),
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Find out which effect is missing.

    Args:
        log: what Telemetry.read gave, or a path as it takes.
        model: a model; or a vehicle, by name or file, whose base model is then the start.
        mapping: a mapping file for other names, units and signs.
        extra: custom effects that compete with the catalogue.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked between the steps.

    Raises:
        LogError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` said so.
    """
    watch = CancellationToken(cancelled).watched(progress)
    watch(0.0, "reading the log")
    start = starting_model(model)
    source = open_source(log, mapping, watch)
    return diagnose_source(source, start, extra, watch)


def diagnose_source(
    source: LogSource, start: PowerModel, extra: Sequence[type[Effect]], watch: Progress
) -> Diagnosis:
    """As ``diagnose``, for a log that is open."""
    source = source.steady()
    watch(0.1, "fitting the model")
    found = find_missing_effects(source, start, extra, watch)
    diagnosis = _report(source, found)
    if found.at_bounds(start):
        diagnosis = more_credible(
            diagnosis,
            _report(source, find_missing_effects(source, start, extra, watch, as_stated=True)),
        )
    return never_complete_with_structure(diagnosis)


# What is said about it.


def _report(source: LogSource, found: Found) -> Diagnosis:
    examination, selection = found.examination, found.selection
    members = [m for m in selection.members if not m.sensor]
    sensors = _sensor_faults(found)
    shape = selection.shape
    lost = shape is not None and not sensors and bool(shape.near) and (shape.alone or not members)
    proposal: Proposal | None = None
    if shape is not None and not lost:
        kept = () if shape.alone else found.additions
        if shape.alone:
            members = []
        axis = examination.competitors.dictionary.shapes[shape.number].axis
        given = _columns_in(found.local, examination, members)
        proposal = propose(found.local, axis, shape, found.log, found.origin, kept, given)
    if lost:
        members = []
    before = heldout_residual(found.log, found.base)
    fitted = proposal.fit if proposal else (found.fitted if members else found.base)
    left = heldout_residual(found.log, fitted)
    # What does not lower the error on runs that it was not fitted to is not named.
    if proposal is not None:
        without = heldout_residual(found.log, found.fitted) if members else before
        if not falls(before, left, found.base.spread, beside=without):
            proposal, lost = None, not members
            fitted, left = (found.fitted if members else found.base), without
    lower = falls(before, left, found.base.spread)
    if members and not proposal and not lower:
        # Whether an effect is there is asked of the fewest parameters that show it.
        searched = heldout_residual(found.log, found.searched or found.fitted)
        lower = falls(before, searched, found.base.spread)
    if (proposal or members) and not sensors and not lower:
        proposal, members, lost = None, [], True
        fitted, left = found.base, before
    selected = tuple(m.name for m in members)
    verdict = verdict_of(
        faulty=bool(sensors), formula=proposal is not None, named=bool(members), lost=lost
    )
    if proposal is None and members:
        fitted = trimmed(fitted, found.origin, found.log, found.additions)
    advice = Advice(examination, selection, found.log)
    models = FittedModels(
        base=found.base.model,
        fitted=fitted,
        additions=_additions(found, members, proposal),
        corrected=found.log,
        refused=found.base.refused,
    )
    diagnosis = Diagnosis(
        **vars(models),
        verdict=verdict,
        selected=selected,
        baseline=Errors(found.base.rmse_w, rms(before), examination.noise.floor_w),
        after=Errors(models.fitted.rmse_w, rms(left)),
        candidates=_candidates(found, selected, fitted, members),
        not_testable=advice.not_testable(selected),
        regimes=tuple(regimes_of(found.log, found.base.residual, found.base.spread)),
        outside=proposal.outside if proposal else None,
        sensors=sensors,
        experiments=advice.experiments(),
        log=source.describe(),
    )
    return replace(diagnosis, sentence=sentence_of(diagnosis, shape.near if shape and lost else ()))


def _columns_in(
    local: Examination, examination: Examination, members: Sequence[Member]
) -> list[int]:
    """Columns of members in another examination, which numbers its candidates otherwise."""
    known = local.competitors.library.candidates
    theirs = examination.competitors.library.candidates
    return [
        local.competitors.candidate(known.index(theirs[n]))
        for member in members
        for n in member.term.columns
    ]


def _additions(
    found: Found, members: Sequence[Member], proposal: Proposal | None
) -> dict[str, Addition]:
    """How to add everything that could be adopted, supported by the log or not."""
    examination = found.examination
    library = examination.competitors.library
    additions: dict[str, Addition] = {}
    for slug, effect in all_effects().items():
        if not effect.base and slug not in library.own:
            additions[slug] = Addition.usual(effect, library.model)
    for ranked, where in _ranking(found):
        known = where.competitors.library
        addition = Addition.of(known, ranked.member.term, ranked.coefficients)
        additions[ranked.name] = addition.completed(known)
    for member, addition in zip(members, found.additions, strict=False):
        additions[member.name] = addition
    if proposal is not None:
        additions[proposal.outside.name] = proposal.addition
    return additions


def _ranking(found: Found) -> list[tuple[RankedTerm, Examination]]:
    """Competing effects, and the examination that their members are counted in."""
    all_rows = [(ranked, found.examination) for ranked in found.selection.ranking]
    refuted = [(ranked, found.local) for ranked in found.refuted]
    return [entry for entry in [*all_rows, *refuted] if not entry[0].member.sensor]


def _sensor_faults(found: Found) -> tuple[SensorFault, ...]:
    values = dict(found.corrections)
    for member in found.selection.members:
        if member.sensor:
            ranked = found.selection.ranked(member.name)
            before = values.get(member.name, (0.0, 0.0))[0]
            values[member.name] = (before + float(ranked.coefficients[0]), ranked.stderr)
    faults = []
    for kind, (value, stderr) in values.items():
        sensor = SENSORS[kind]
        sentence = sensor.sentence.format(value=f"{value:.3g} ± {stderr:.1g}")
        faults.append(SensorFault(kind, value, stderr, sensor.unit, sentence))
    return tuple(faults)


def _candidates(
    found: Found, selected: tuple[str, ...], fitted: Fit, members: Sequence[Member]
) -> tuple[Candidate, ...]:
    entries = []
    examination = found.examination
    # The statistics of a long log do not keep its rows: the sample's errors stand for it.
    linear = LinearHeldout(found.log, found.local)
    own = _columns_in(found.local, examination, members)
    for ranked, where in _ranking(found):
        chosen = ranked.name in selected
        if chosen:
            parameters = _fitted_estimates(fitted, ranked.name)
        else:
            parameters = _linear_estimates(where, ranked)
        # An effect alone; a selected one with all that were selected.
        columns = _columns_in(found.local, where, [ranked.member])
        heldout = linear.rmse(own if chosen else columns)
        known = ranked.name, ranked.probability, heldout, parameters
        test = ranked.z, ranked.p_value, ranked.size, ranked.gain
        aliases = found.selection.aliases.get(ranked.name, ()) if chosen else ()
        entries.append(Candidate(*known, *test, len(ranked.member.columns), aliases))
    listed = {entry.effect for entry in entries}
    rest = sorted(examination.testable.items(), key=lambda item: (item[1] is not None, item[0]))
    for slug, why in rest:
        if slug not in listed:
            # Testable and not ranked: the log asks for a sign or size that the effect cannot have.
            entries.append(Candidate(slug, 0.0, None, {}, 0.0, 1.0, 0.0, 0.0, 0, (), why))
    return tuple(entries)


def _fitted_estimates(fitted: Fit, slug: str) -> dict[str, Estimate]:
    estimates = {}
    keys = [key[:2] for key in fitted.model.parameter_names]
    for parameter in fitted.parameters:
        if parameter.effect == slug:
            several = keys.count((slug, parameter.name)) > 1
            name = f"{parameter.name} {parameter.element}" if several else parameter.name
            estimates[name] = Estimate(parameter.value, parameter.stderr, parameter.unit)
    return estimates


def _linear_estimates(examination: Examination, ranked: RankedTerm) -> dict[str, Estimate]:
    library = examination.competitors.library
    estimates = {}
    clear = examination.evidence.partial
    member = ranked.member
    each = zip(member.term.columns, member.columns, ranked.coefficients, strict=True)
    for number, column, value in each:
        candidate = library.candidates[number]
        _, _, parameter, _ = library.model.slots[candidate.place]
        null = parameter.null or 0.0
        stderr = float(1.0 / np.sqrt(max(clear[column, column], 1e-300)))
        bounded = float(np.clip(null + value, *parameter.bounds))
        estimates[candidate.parameter] = Estimate(bounded, stderr, parameter.unit)
    return estimates
