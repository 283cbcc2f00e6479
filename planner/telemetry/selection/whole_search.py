"""The whole search: the sample, all rows, held-out support, and a fit with everything free.

found = find_missing_effects(source, start, extra, watch)
found.selection, found.additions, found.fitted, found.searched
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial

from planner.power.model import PowerModel
from planner.progress import Progress
from planner.telemetry.evidence import examine_all
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import SENSORS
from planner.telemetry.sampling import LogSource
from planner.telemetry.selection.backward_elimination import without_unsupported
from planner.telemetry.selection.beside_steps import with_meter_beside_steps
from planner.telemetry.selection.known_aliases import with_known_aliases
from planner.telemetry.selection.select_effects import select, with_robust_probabilities
from planner.telemetry.selection.selection_loop import (
    Extra,
    Found,
    additions_of,
    corrected,
    investigate,
)


def find_missing_effects(
    source: LogSource,
    start: PowerModel,
    extra: Extra,
    watch: Progress,
    *,
    as_stated: bool = False,
    sensors: Collection[str] = frozenset(SENSORS),
) -> Found:
    """Search a log for what a model lacks.

    Args:
        source: the log, at steady speeds.
        start: the model, not yet fitted.
        extra: custom effects that compete with the catalogue.
        watch: progress; raises when the caller cancelled.
        as_stated, sensors: as ``investigate``.
    """
    search = partial(
        investigate, source.sample, start, extra, watch, as_stated=as_stated, sensors=sensors
    )
    found = with_meter_beside_steps(search(), search)
    if not source.complete:
        found = _with_all_rows(source, found, watch)
    watch(0.9, "weighing what was found")
    found = without_unsupported(found, watch)
    aliases = with_known_aliases(found.selection.aliases, found.fitted)
    selection = with_robust_probabilities(found.examination, found.selection)
    selection = replace(selection, aliases=aliases)
    return _with_everything_free(replace(found, selection=selection, searched=found.fitted))


def _with_all_rows(source: LogSource, found: Found, watch: Progress) -> Found:
    """Choose again with the statistics of the whole log, around the result of the sample."""

    def correct(chunk: Telemetry) -> Telemetry:
        return replace(corrected(chunk, found.corrections), meter=found.log.meter)

    members = [c for m in found.selection.members for c in m.columns]
    alternatives = {name for aliased in found.selection.aliases.values() for name in aliased}
    examination = examine_all(source, found.examination, members, alternatives, correct, watch)
    selection = select(examination)
    ranked = {ranked.name for ranked in selection.ranking}
    refuted = tuple(s for s in found.selection.ranking if s.name not in ranked)
    # Ties of the sample stay: alternatives were fitted there in full.
    aliases = {m.name: found.selection.aliases.get(m.name, ()) for m in selection.members}
    selection = replace(selection, aliases=aliases)
    additions = additions_of(examination, selection)
    found = replace(found, examination=examination, selection=selection, refuted=refuted)
    return replace(found, additions=additions, fitted=found.refit(additions))


def _with_everything_free(found: Found) -> Found:
    """The same names, fitted with all their parameters and shapes (Addition.completed)."""
    if not found.additions:
        return found
    library = found.local.competitors.library
    additions = tuple(a.completed(library) for a in found.additions)
    fitted = found.refit(additions, tried=True)
    beside = found.left_beside_base(fitted)
    return replace(found, additions=additions, fitted=fitted, beside=beside)
