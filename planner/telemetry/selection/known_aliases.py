"""Known pairs of aliased effects: no log can distinguish them by its likelihood alone.

    ties = with_known_aliases(ties, fitted, log)

Uneven wheels, and a mass off the centre.
A centre of mass at (x_c, y_c) loads the wheels in proportion to 1 + a·x_i·x_c + b·y_i·y_c, and each
wheel's drag follows its load. That is what wheel_imbalance calls excess, if the excess is a linear
function of the wheels' places; three wheels have no other. Where com_x and com_y were not logged,
com_offset stands for an offset to either side, which has no such pattern, so the fitted excess is
asked instead. The other way round, wheels that are uneven in an offset's pattern look like it: an
offset that nobody measured is named with them.

Sinkage, and load-dependent rolling.
Sinkage adds a drag that grows faster than the load. Where it leaves nothing of the rolling
resistance, it has taken its place, and says no more than that this grows faster than the load.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from planner.telemetry.estimation import Fit
from planner.telemetry.logs import Telemetry

Aliases = Mapping[str, tuple[str, ...]]

UNEVEN, OFFSET = "wheel_imbalance", "com_offset"
SINKAGE, BY_LOAD = "sinkage", "load_dependent_rolling"
ROLLING = ("wheel_rolling", "rolling", 0)
REAL_PATTERN_P = 0.01
"""p-value below which a pattern that no offset has counts as real."""


def with_known_aliases(aliases: Aliases, fitted: Fit, log: Telemetry) -> dict[str, tuple[str, ...]]:
    """The aliases of a selection, with those known from physics where a log leaves them open.

    Args:
        aliases: slug of a selected effect → those that explain the log as well.
        fitted: the model with the selected effects.
        log: says whether the centre of mass was measured.
    """
    known = dict(aliases)
    measured = {"com_x", "com_y"} <= log.present
    if UNEVEN in known and OFFSET not in known and not measured and _fits_an_offset(fitted):
        known[UNEVEN] = tuple(dict.fromkeys((*known[UNEVEN], OFFSET)))
    if OFFSET in known and UNEVEN not in known and not measured:
        known[OFFSET] = tuple(dict.fromkeys((*known[OFFSET], UNEVEN)))
    if SINKAGE in known and BY_LOAD not in known and _nothing_left_of_rolling(fitted):
        known[SINKAGE] = tuple(dict.fromkeys((*known[SINKAGE], BY_LOAD)))
    return known


def _nothing_left_of_rolling(fitted: Fit) -> bool:
    place = fitted.model.parameter_names.index(ROLLING)
    lowest = fitted.model.slots[place][2].bounds[0]
    return place in fitted.places and bool(fitted.model.parameters[place] <= lowest)


def _fits_an_offset(fitted: Fit) -> bool:
    model = fitted.model
    wheels = len(model.wheels)
    excess, spread = np.zeros(wheels), np.zeros((wheels, wheels))
    at = {
        model.slots[place][3]: number
        for number, place in enumerate(fitted.places)
        if model.slots[place][0].slug == UNEVEN
    }
    for wheel, number in at.items():
        excess[wheel] = model.parameters[fitted.places[number]]
        for other, second in at.items():
            spread[wheel, other] = fitted.covariance[number, second]
    places = np.column_stack([np.ones(wheels), model.wheels[:, :2]])
    # Patterns over the wheels that are neither their mean nor linear in their places.
    left, sizes, _ = np.linalg.svd(places)
    rest = left[:, int((sizes > 1e-9 * sizes[0]).sum()) :]
    if rest.shape[1] == 0:
        return True
    found, variance = rest.T @ excess, rest.T @ spread @ rest
    z = found @ np.linalg.pinv(variance, hermitian=True) @ found
    return bool(chi2.sf(z, rest.shape[1]) > REAL_PATTERN_P)
