"""Name the physical effect that a model lacks, or say that it is not identifiable.

    diagnosis = diagnose("drive.csv", "minibalance")
    diagnosis.verdict, diagnosis.selected, diagnosis.sentence

In this order:

    fit        the model, robustly                                                   estimation
    lay out    a column for every effect, sensor fault and plain shape                 evidence
    choose     the best subset; test it; compare it with competing models             selection
    refit      model and chosen effects together, and lay out anew around them,
               until the choice stays; with a sensor fault, after correcting it
    outside    a residual that the catalogue does not explain gets a formula     unknown_effect
    decide     what held-out runs support, and what stays unexplained             decision

The search is planner.telemetry.selection.whole_search. Everything nonlinear happens on a sample of
at most 12,000 rows; memory does not grow with the log.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from planner.cache import CACHE
from planner.cancellation import CancellationToken
from planner.errors import ModelError
from planner.power.catalogue import all_effects, is_effect
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.progress import Progress
from planner.telemetry.as_measured import as_measured
from planner.telemetry.belonging import (
    TOO_STRONG,
    TOO_WEAK,
    apart,
    beyond_motors,
    impossible,
)
from planner.telemetry.diagnosis.advice import (
    UNKNOWN,
    WIDE,
    Advice,
    Aliases,
    Untestable,
    slope_to_log,
)
from planner.telemetry.diagnosis.along_the_log import all_rising_steadily
from planner.telemetry.diagnosis.answer import Decision
from planner.telemetry.diagnosis.best_reading import best_reading
from planner.telemetry.diagnosis.candidates import adoptable, candidates_of
from planner.telemetry.diagnosis.decision import decide
from planner.telemetry.diagnosis.reconcile import (
    beside_noise,
    confirmed,
    more_credible,
    outdone,
    undisputed,
)
from planner.telemetry.diagnosis.results import (
    Diagnosis,
    Errors,
    Experiment,
    FittedModels,
    SensorFault,
)
from planner.telemetry.diagnosis.supported_sensors import (
    as_measured_by,
    corrections_of,
    floor_behind,
    with_supported_sensors,
)
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR
from planner.telemetry.diagnosis.verdict import sentence_of, verdict_of
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import base_fit, heldout_residual, rms
from planner.telemetry.logs import LogLike, MappingLike, Telemetry
from planner.telemetry.misread import Misread, misread
from planner.telemetry.other_terms import SENSORS, measured_residual
from planner.telemetry.pictures import Pictures, pictures_of
from planner.telemetry.prediction import predict
from planner.telemetry.regimes import Regime, regimes_of
from planner.telemetry.sampling import LogSource, open_source
from planner.telemetry.selection import (
    Found,
    find_missing_effects,
)
from planner.telemetry.single_core import single_core
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import trimmed
from planner.telemetry.tilt_filter import with_true_tilt

MOST_EXPERIMENTS = 3
"""Recommendations of a diagnosis."""


@single_core()
def diagnose(
    log: LogLike,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: MappingLike | None = None,
    extra: Sequence[type[Effect]] = (),
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Find out which effect is missing.

    Args:
        log: what Telemetry.read gave, or what it takes, such as a path or a DataFrame.
        model: a model or its .json file; or a vehicle, by name or file, whose base model is then
            the start.
        mapping: a mapping file for other names, units and signs, or its content.
        extra: custom effects that compete with the catalogue.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked between the steps.

    Raises:
        LogError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` said so.
    """
    for effect in extra:
        if not is_effect(effect):
            accepted = "a list of custom effects; those of the catalogue compete anyway"
            raise ModelError("extra", "is no custom effect", value=effect, accepted=accepted)
    watch = CancellationToken(cancelled).watched(progress)
    watch(0.0, "reading the log")
    start = starting_model(model)
    source = open_source(log, mapping, watch)
    return diagnose_source(source, start, extra, watch)


@single_core()
def diagnose_source(
    source: LogSource, start: PowerModel, extra: Sequence[type[Effect]], watch: Progress
) -> Diagnosis:
    """As ``diagnose``, for a log that is open; adopting what was diagnosed finds it known."""
    own = json.dumps(start.document()), start.sliding_speed, start.effects
    key = "diagnosis", source.content, *own, tuple(all_effects().values()), tuple(extra)
    return CACHE.get(key, lambda: _diagnosed(source, start, extra, watch))


def _diagnosed(
    source: LogSource, start: PowerModel, extra: Sequence[type[Effect]], watch: Progress
) -> Diagnosis:
    watch(0.05, "reading the motion")
    source = source.with_findings(beyond_motors(source.sample, start))
    source = with_true_tilt(as_measured(source, start), start)
    raw, usual, source = source, source.steady(), best_reading(source, start)
    decided = _decided(source, start, extra, watch)
    decided = all_rising_steadily(decided)
    if any(one.answer.claims for _, one in decided):
        watch(0.9, "adding noise to the motion")
        noisier = raw.noisier_as(source)
        decided = [(found, beside_noise(found, one, noisier)) for found, one in decided]
    # Of two moments of one motion the power follows one; the usual reading tells nothing then.
    otherwise = source.reading.is_unusual and not source.reading.lag
    if otherwise and any(one.answer.claims for _, one in decided):

        def again(share: float, said: str) -> None:
            watch(0.9 + 0.1 * share, f"{said}, in the usual reading")

        usual = usual.with_meter(source.sample.meter)
        others = all_rising_steadily(_decided(usual, start, extra, again))
        decided = [(found, confirmed(found, decision, others)) for found, decision in decided]
    reports = [_report(source, start, found, decision) for found, decision in decided]
    return reports[0] if len(reports) == 1 else more_credible(*reports)


def _decided(
    source: LogSource, start: PowerModel, extra: Sequence[type[Effect]], watch: Progress
) -> list[tuple[Found, Decision]]:
    """Searches of a log, with what is decided about each of them."""
    watch(0.1, "fitting the model")
    search = partial(find_missing_effects, source.sample, start, extra, watch)
    found = with_supported_sensors(source, start, search)
    searches = [found]
    # Something strong may have bent the fit; then columns around it point nowhere.
    if found.at_bounds(start) or _lost(decide(found, floor_behind(found))):
        searches.append(with_supported_sensors(source, start, partial(search, as_stated=True)))
    # A floor that was estimated beside a misfit can only be too high.
    floor = min((floor_behind(each) for each in searches), key=rms)
    decisions = [decide(each, floor) for each in searches]
    if len(searches) > 1:
        pairs = zip(searches, decisions, reversed(decisions), strict=True)
        same_log = not any(corrections_of(each) for each in searches)
        for one, other in ((0, 1), (1, 0)):
            if same_log and outdone(source.sample, decisions[one], decisions[other]):
                return [(searches[other], decisions[other])]
        decisions = [
            undisputed(each, mine, theirs, same_log=same_log) for each, mine, theirs in pairs
        ]
    return list(zip(searches, decisions, strict=True))


def _lost(decision: Decision) -> bool:
    """Whether a search names nothing, and leaves much more than the noise."""
    much = decision.unexplained.heldout_over_floor > MOST_OVER_FLOOR
    return much and not decision.answer.claims


# What is said about it.


def _report(source: LogSource, start: PowerModel, found: Found, decision: Decision) -> Diagnosis:
    other_power = any(finding.kind in (TOO_STRONG, TOO_WEAK) for finding in source.sample.report)
    wrongly = None if other_power else _misread(source, start, found, decision)
    if wrongly is not None:
        decision = decision.without_claims(found, wrongly.error_w)
    elif other_power:
        # A power that is none of these motors' says nothing of the motion, nor of an effect.
        decision = decision.without_claims(found, rms(decision.before))
    answer, log = decision.answer, found.log
    sensors = () if wrongly is not None or other_power else _sensor_faults(found)
    selected = tuple(m.name for m in answer.members)
    odd = apart(log, answer.left, answer.fit.model)
    verdict = verdict_of(
        faulty=bool(sensors),
        formula=answer.proposal is not None,
        named=bool(selected),
        lost=not decision.complete or bool(odd) or wrongly is not None or other_power,
    )
    fitted = answer.fit
    if answer.proposal is None and answer.members:
        fitted = trimmed(fitted, found.origin, log, answer.additions)
    selection = replace(found.selection, aliases=dict(answer.aliases))
    advice = Advice(found.examination, selection, log)
    # What is reported is the error of the model that can be adopted: as data sheet and sensors are.
    sizes = {kind: value for kind, (value, _) in found.corrections.items()}
    after = rms(measured_residual(heldout_residual(log, answer.fit), sizes))
    before = after if answer.fit is found.base else rms(heldout_residual(log, found.base))
    errors: dict[str, Any] = {"after": Errors(fitted.rmse_w, after)}
    exact = rms(measured_residual(answer.left, sizes))
    floor = decision.floor * (after / exact)
    # Rows far out are in the errors beside it, so they are in the floor as well.
    baseline = Errors(found.base.rmse_w, before, after / decision.unexplained.heldout_over_floor)
    as_measured, stated = log, found.base
    if sensors:
        # What is claimed is an error of the log as it was measured.
        as_measured = as_measured_by(source, found)
        stated = base_fit(as_measured, start)
        baseline = replace(
            baseline,
            rmse_w=stated.rmse_w,
            heldout_rmse_w=rms(heldout_residual(as_measured, stated)),
        )
    models = FittedModels(
        base=found.base.model,
        fitted=fitted,
        additions=adoptable(found, answer),
        corrected=log,
        refused=found.base.refused,
    )
    errors["baseline"] = baseline
    regimes = tuple(regimes_of(log, found.base.residual, floor, found.base.watts))
    shown = regimes
    if sensors:
        shown = tuple(regimes_of(as_measured, stated.residual, floor, stated.watts))
    pictures = _pictures(as_measured, stated, models, sensors, shown)
    seen: dict[str, Any] = {"regimes": regimes, "pictures": pictures}
    diagnosis = Diagnosis(
        **vars(models),
        **errors,
        **seen,
        verdict=verdict,
        selected=selected,
        candidates=candidates_of(found, decision, fitted, after),
        not_testable=Untestable(advice).listed(selected),
        unexplained=decision.unexplained,
        outside=answer.proposal.outside if answer.proposal else None,
        sensors=sensors,
        experiments=() if wrongly is not None else _experiments(advice, found, decision, fitted),
        log=source.describe(),
    )
    instead = wrongly.sentence if wrongly is not None else ""
    said = sentence_of(
        diagnosis, decision.alike, decision.near, odd, exact, impossible(log), instead
    )
    return replace(diagnosis, sentence=said)


def _misread(
    source: LogSource, start: PowerModel, found: Found, decision: Decision
) -> Misread | None:
    """Another reading of a log that the model as it is does not explain."""
    least = rms(decision.before)
    # A floor estimated beside a wrong reading is too high; what is left in regimes shows it.
    ratio = max(least / rms(decision.floor), decision.unexplained.heldout_over_floor)
    if ratio <= MOST_OVER_FLOOR:
        return None
    # A formula can follow what a wrong reading does, too.
    if decision.answer.proposal is None:
        least = min(least, rms(decision.answer.left))
    return misread(source.sample, start, least)


def _pictures(
    as_measured: Telemetry,
    stated: Fit,
    models: FittedModels,
    sensors: Sequence[SensorFault],
    regimes: Sequence[Regime],
) -> Pictures:
    """What to look at: errors of sensors change the whole prediction, effects add to it."""
    before, fitted = stated.watts, models.fitted
    known = {effect.slug for effect in models.base.effects}
    parts = {
        effect.slug: fitted.watts - predict(fitted.model.without(effect.slug), models.corrected)
        for effect in fitted.model.effects
        if effect.slug not in known
    }
    if not parts and not sensors:
        return pictures_of(as_measured, before, None, {}, regimes)
    scale = {fault.kind: fault.value for fault in sensors}
    after = measured_residual(fitted.watts, scale)
    if sensors:
        parts = {sensors[0].kind: after - before, **parts}
    return pictures_of(as_measured, before, after, parts, regimes)


def _experiments(
    advice: Advice, found: Found, decision: Decision, fitted: Fit
) -> tuple[Experiment, ...]:
    """What to measure next: quantities to log first, then drives."""
    answer = decision.answer
    names = [member.name for member in answer.members]
    slope = slope_to_log(found.examination, found.log, answer.left)
    aliased = Aliases(advice)
    columns = [one for one in (slope, *map(aliased.parted, names)) if one is not None]
    undecided = not answer.claims and not decision.complete
    drives = [
        drive
        for drive in advice.experiments(_wide(fitted, names), undecided)
        # A column that parts the same effects comes first, and is enough.
        if not any(set(drive.separates) <= set(column.separates) for column in columns)
    ]
    return (*columns, *drives)[:MOST_EXPERIMENTS]


def _wide(fitted: Fit, names: Sequence[str]) -> list[str]:
    """Named effects of one parameter, or one of every wheel, whose intervals are wide.

    Of size and shape together the log knows what they do jointly; how far each is known alone, a
    linear simulation does not say.
    """
    nulls = {(e.slug, name): parameter.null for e, name, parameter, _ in fitted.model.slots}
    wide = []
    for slug in names:
        own = [p for p in fitted.parameters if p.effect == slug and p.identifiable]
        widths = [p.stderr / max(abs(p.value - (nulls[slug, p.name] or 0.0)), 1e-300) for p in own]
        if len({p.name for p in own}) == 1 and WIDE < max(widths) < UNKNOWN:
            wide.append(slug)
    return wide


def _sensor_faults(found: Found) -> tuple[SensorFault, ...]:
    faults = []
    for kind, (value, stderr) in corrections_of(found).items():
        sensor = SENSORS[kind]
        said = sensor.said(value, stderr, found.log.present)
        faults.append(SensorFault(kind, value, stderr, sensor.unit, said))
    return tuple(faults)
