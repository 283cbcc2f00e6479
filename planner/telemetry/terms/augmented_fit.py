"""Fit a model with effects added to it.

    fitted = fit_with(model, log, [Addition("air_drag", {"drag_area": 0.2})])

An addition names the parameters of the effect that are fitted, and where the fit starts. Its other
parameters keep their null value, scanned shapes the value that was found. That keeps a search
quick. The result needs more: an effect acts with all its parameters and with a shape between grid
values, and standard errors that leave those out are far too small. ``Addition.completed`` frees all
of them that the log can show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.arrays import Array
from planner.power.catalogue import find_effect
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit, fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise
from planner.telemetry.parameters import free_places, usual_value
from planner.telemetry.terms.candidate_terms import CandidateLibrary, Term, with_effects


@dataclass(frozen=True)
class Addition:
    """An effect to be added.

    Attributes:
        effect: slug of the catalogue, or a custom effect.
        start: (name, element) → value; these are fitted.
        shapes: name → value of a scanned parameter.
    """

    effect: str | type[Effect]
    start: dict[tuple[str, int], float]
    shapes: dict[str, float] = field(default_factory=dict)

    @property
    def declaration(self) -> type[Effect]:
        """The effect's class."""
        return find_effect(self.effect) if isinstance(self.effect, str) else self.effect

    @classmethod
    def of(cls, library: CandidateLibrary, term: Term, coefficients: Array) -> Addition:
        """A term of a library, with its coefficients (k,) for a start."""
        slots = library.model.slots
        start: dict[tuple[str, int], float] = {}
        shapes: dict[str, float] = {}
        columns = [library.candidates[n] for n in term.columns]
        for column, coefficient in zip(columns, coefficients, strict=True):
            effect, name, parameter, element = slots[column.place]
            possible = float(np.clip(coefficient, column.low, column.high))
            start[name, element] = possible + (parameter.null or 0.0)
            if column.shape is not None:
                shapes[slots[column.shape[0]][1]] = column.shape[1]
        return cls(effect, start, shapes)

    @classmethod
    def usual(cls, effect: type[Effect], model: PowerModel) -> Addition:
        """An effect at the values that the vehicle or the catalogue give, its parameters free."""
        counts = {"wheel": model.vehicle.layout.wheel_count, "surface": max(1, len(model.surfaces))}
        start = {
            (name, element): usual_value(model, effect, name)
            for name, parameter in effect.parameters.items()
            if parameter.fitted and parameter.null is not None
            for element in range(counts.get(parameter.per or "", 1))
        }
        return cls(effect, start)

    def completed(self, library: CandidateLibrary) -> Addition:
        """The same effect with everything free that acts in this log, shapes included.

        A parameter that the search left out starts at its usual value: physics knows it better
        than that it is null.
        """
        effect = self.declaration
        start = {(name, 0): value for name, value in self.shapes.items()}
        for column in library.candidates:
            if column.effect == effect.slug:
                _, name, _, element = library.model.slots[column.place]
                start[name, element] = usual_value(library.model, effect, name)
        return Addition(self.effect, {**start, **self.start})


def extended(
    model: PowerModel,
    log: Telemetry,
    additions: Sequence[Addition],
    within: PowerModel | None = None,
) -> tuple[PowerModel, tuple[int, ...]]:
    """The model with the additions at their start, and the numbers of its free parameters.

    Args:
        model: the model.
        log: names the kinds of ground.
        additions: what is added.
        within: a model that has all of them, others at their null values: no new kernel has then
            to be compiled for every choice of effects.
    """
    full = within or with_effects(model, [a.declaration for a in additions], log)
    own = dict(zip(model.parameter_names, model.parameters, strict=True))
    own_free = {model.parameter_names[place] for place in free_places(model, log)}
    values = full.parameters.copy()
    added = {a.declaration.slug: a for a in additions}
    free = []
    for place, (effect, name, parameter, element) in enumerate(full.slots):
        addition = added.get(effect.slug)
        key = effect.slug, name, element
        if key in own:
            values[place] = own[key]
            free += [place] if key in own_free else []
        elif addition is not None and parameter.per == "wheel" and (name, 0) in addition.start:
            values[place] = _against_mean(addition, name, full)[element]
            free.append(place)
        elif addition is not None and (name, element) in addition.start:
            values[place] = addition.start[name, element]
            free.append(place)
        elif addition is not None and name in addition.shapes:
            values[place] = addition.shapes[name]
    stderr = np.full(len(values), np.nan)
    full = replace(full, parameters=values, stderr=stderr, covariance=None, energy_error=None)
    return full, tuple(free)


def _against_mean(addition: Addition, name: str, model: PowerModel) -> Array:
    """Factors of all wheels about their mean; one that the addition does not name is at null."""
    parameter = addition.declaration.parameters[name]
    null = parameter.null or 0.0
    wheels = range(model.vehicle.layout.wheel_count)
    given = np.array([addition.start.get((name, wheel), null) for wheel in wheels])
    return np.asarray(np.clip(given - given.mean() + null, *parameter.bounds))


def fit_with(
    model: PowerModel,
    log: Telemetry,
    additions: Sequence[Addition],
    *,
    noise: Noise | None = None,
    within: PowerModel | None = None,
    unsure: Array | None = None,
) -> Fit:
    """Fit a model with effects added to it.

    ``within`` is as for ``extended``. With ``unsure`` (n, k) W, usual errors of data sheet and
    sensors, standard errors include what these do, and the intervals of what is added are tried out
    (planner.telemetry.estimation.parameter_errors), which takes as long as the fit again.
    """
    full, free = extended(model, log, additions, within)
    added = {a.declaration.slug for a in additions} if unsure is not None else set()
    mine = [place for place in free if full.slots[place][0].slug in added]
    return fit(log, full, free=free, noise=noise, tried=mine, unsure=unsure)


def trimmed(fitted: Fit, model: PowerModel, log: Telemetry, additions: Sequence[Addition]) -> Fit:
    """A fit made ``within`` a larger model, as one of the model with its additions alone."""
    reduced, _ = extended(model, log, additions)
    found = fitted.model
    place_of = {key: place for place, key in enumerate(found.parameter_names)}
    from_places = [place_of[key] for key in reduced.parameter_names]
    back = {place: k for k, place in enumerate(from_places)}
    assert found.stderr is not None  # every fit has standard errors
    values, stderr = found.parameters[from_places], found.stderr[from_places]
    places = tuple(back[place] for place in fitted.places)
    return replace(fitted, model=replace(reduced, parameters=values, stderr=stderr), places=places)
