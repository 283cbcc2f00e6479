"""The whole search: the terms, held-out support, and a fit with everything free.

found = find_missing_effects(log, start, extra, watch)
found.selection, found.additions, found.fitted, found.searched
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial

from planner.power.model import PowerModel
from planner.progress import Progress
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import SENSORS
from planner.telemetry.selection.backward_elimination import without_unsupported
from planner.telemetry.selection.beside_steps import with_meter_beside_steps
from planner.telemetry.selection.found import Found
from planner.telemetry.selection.known_aliases import with_known_aliases
from planner.telemetry.selection.select_effects import with_robust_probabilities
from planner.telemetry.selection.selection_loop import Extra, investigate


def find_missing_effects(
    log: Telemetry,
    start: PowerModel,
    extra: Extra,
    watch: Progress,
    *,
    as_stated: bool = False,
    sensors: Collection[str] = frozenset(SENSORS),
) -> Found:
    """Search a log for what a model lacks.

    Args:
        log: the rows, at steady speeds.
        start: the model, not yet fitted.
        extra: custom effects that compete with the catalogue.
        watch: progress; raises when the caller cancelled.
        as_stated, sensors: as ``investigate``.
    """
    search = partial(investigate, log, start, extra, watch, as_stated=as_stated, sensors=sensors)
    found = with_meter_beside_steps(search(), search)
    watch(0.9, "weighing what was found")
    found = without_unsupported(found, watch)
    aliases = with_known_aliases(found.selection.aliases, found.fitted)
    selection = with_robust_probabilities(found.examination, found.selection)
    selection = replace(selection, aliases=aliases)
    return _with_everything_free(replace(found, selection=selection, searched=found.fitted))


def _with_everything_free(found: Found) -> Found:
    """The same names, fitted with all their parameters and shapes (Addition.completed)."""
    if not found.additions:
        return found
    library = found.examination.competitors.library
    additions = tuple(a.completed(library) for a in found.additions)
    fitted = found.refit(additions, tried=True)
    beside = found.left_beside_base(fitted)
    return replace(found, additions=additions, fitted=fitted, beside=beside)
