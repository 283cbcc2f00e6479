"""Known pairs of aliased effects: no log can distinguish them by its likelihood alone.

    aliases = with_known_aliases(aliases, fitted)

Sinkage, and load-dependent rolling.
Sinkage adds a drag that grows faster than the load. Where it leaves nothing of the rolling
resistance, it has taken its place, and says no more than that this grows faster than the load.
"""

from __future__ import annotations

from collections.abc import Mapping

from planner.telemetry.estimation import Fit

Aliases = Mapping[str, tuple[str, ...]]

SINKAGE, BY_LOAD = "sinkage", "load_dependent_rolling"
ROLLING = ("wheel_rolling", "rolling", 0)


def with_known_aliases(aliases: Aliases, fitted: Fit) -> dict[str, tuple[str, ...]]:
    """The aliases of a selection, with those known from physics where a log leaves them open.

    Args:
        aliases: slug of a selected effect → those that explain the log as well.
        fitted: the model with the selected effects.
    """
    known = dict(aliases)
    if SINKAGE in known and BY_LOAD not in known and _nothing_left_of_rolling(fitted):
        known[SINKAGE] = tuple(dict.fromkeys((*known[SINKAGE], BY_LOAD)))
    return known


def _nothing_left_of_rolling(fitted: Fit) -> bool:
    place = fitted.model.parameter_names.index(ROLLING)
    lowest = fitted.model.slots[place][2].bounds[0]
    return place in fitted.places and bool(fitted.model.parameters[place] <= lowest)
