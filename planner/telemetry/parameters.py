"""Parameters of a model before any log: which are free, their usual size, their prior.

places = free_places(model, log)          # numbers of those that a fit may change
prior = Prior.of(model, places)
prior.precision, prior.low, prior.high    # (p, p), (p,) and (p,)
sizes(model)                              # (P,) what a step is taken relative to
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Array, Integers
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry

PRIOR_SPREADS = 10.0
"""Standard deviation of the prior, in multiples of the declared spread of a parameter."""
WHEEL_SUM_WEIGHT = 1e3
"""One over the standard deviation of the sum of the wheels' factors, which the power ignores."""


@dataclass(frozen=True)
class Prior:
    """Prior of some parameters, without any log.

    Attributes:
        weights: (p,) one over the standard deviation of each: ten times its declared spread.
        gauge: (p, p) weights that hold the sum of the wheels' own factors.
        low, high: (p,) lowest and highest possible values.
    """

    weights: Array
    gauge: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, model: PowerModel, places: Sequence[int]) -> Prior:
        """The prior around a model's values.

        Args:
            model: the middle of the prior.
            places: numbers of its parameters.
        """
        index = np.array(places, int)
        return cls(_weights(model, index), _gauge(model, index), *_bounds(model, index))

    @property
    def precision(self) -> Array:
        """(p, p) inverse covariance."""
        return np.diag(self.weights**2) + self.gauge

    @property
    def declared(self) -> Array:
        """(p,) weights as the declarations state them, ten times wider than they are taken."""
        return self.weights / PRIOR_SPREADS


def free_places(model: PowerModel, log: Telemetry) -> tuple[int, ...]:
    """Numbers of the parameters that a fit to this log may change.

    Where every row has a label of the ground, the commonest one keeps its factor: the drag
    coefficients are those of that ground, otherwise both could change against each other. The
    scanned shape of an effect is free where the effect acts.
    """
    reference = reference_surface(model, log)
    acting = {
        effect.slug
        for (effect, _, parameter, _), value in zip(model.slots, model.parameters, strict=True)
        if parameter.null is not None and value != parameter.null
    }
    places = []
    for place, (effect, _, parameter, element) in enumerate(model.slots):
        shaping = bool(parameter.grid) and effect.slug in acting
        reference_ground = parameter.per == "surface" and element == reference
        if (parameter.fitted or shaping) and not reference_ground:
            places.append(place)
    return tuple(places)


def reference_surface(model: PowerModel, log: Telemetry) -> int:
    """Number of the commonest ground; -1 where the model knows none or a row has no label."""
    numbers = log.rows_for(model.surfaces)[:, INDEX["surface"]]
    if not model.surfaces or np.any(numbers < 0):
        return -1
    return int(np.argmax(np.bincount(numbers.astype(int))))


def usual_value(model: PowerModel, effect: type[Effect], name: str) -> float:
    """Value of an effect's parameter that the vehicle gives, else the declared default."""
    value = model.vehicle.parameters.get(effect.slug, {}).get(name)
    return float(value) if isinstance(value, int | float) else effect.parameters[name].default


def sizes(model: PowerModel) -> Array:
    """(P,) size of every parameter that a step is taken relative to.

    Factors of single wheels and grounds are relative changes: their size is one.
    """
    result = np.empty(len(model.parameters))
    for place, (_, _, parameter, _) in enumerate(model.slots):
        value = abs(float(model.parameters[place]))
        usual = abs(parameter.default - (parameter.null or 0.0))
        # A value that a fit left near zero must not become its own measure.
        size = max(value, usual or min(1e-2, parameter.bounds[1]))
        result[place] = size if parameter.per is None else 1.0
    return result


def _bounds(model: PowerModel, index: Integers) -> tuple[Array, Array]:
    bounds = np.array([model.slots[place][2].bounds for place in index], float).reshape(-1, 2)
    for k, place in enumerate(index):
        if grid := model.slots[place][2].grid:
            # A shape stays within its grid, which covers what physics has.
            given = model.parameters[place]
            bounds[k] = min(grid[0], given), max(grid[-1], given)
    return bounds[:, 0], bounds[:, 1]


def _weights(model: PowerModel, index: Integers) -> Array:
    """One over the prior's standard deviation of every free parameter."""
    size = sizes(model)[index]
    spread = np.array([model.slots[place][2].spread for place in index])
    return 1.0 / np.maximum(PRIOR_SPREADS * spread * size, 1e-300)


def _gauge(model: PowerModel, index: Integers) -> Array:
    """(p, p) weights that hold the sum of the wheels' own factors at zero: it changes nothing."""
    groups: dict[tuple[str, str], list[int]] = {}
    for k, place in enumerate(index):
        effect, name, parameter, _ = model.slots[place]
        if parameter.per == "wheel":
            groups.setdefault((effect.slug, name), []).append(k)
    gauge = np.zeros((len(index), len(index)))
    for group in groups.values():
        if len(group) == model.vehicle.layout.wheel_count:
            gauge[np.ix_(group, group)] = WHEEL_SUM_WEIGHT**2
    return gauge
