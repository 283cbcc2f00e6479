"""Candidate terms: one column of watts for each parameter of every effect that a model lacks.

    library = candidate_library(model, log)
    watts, tangent, columns = library.columns(nodes)     # (n,), (n, p) and (n, m) W per unit

The columns are secants of one model that has the whole catalogue, each effect at its null values
but one: what the effect does at the size that it is thought to have (``amplitudes``), over that
size. A derivative at null would misjudge an effect whose power is not linear in its parameter.

A *term* is one form of an effect: one of its parameters, several together, or one value of a
scanned shape (stiction's speed). An effect whose columns vanish, because the log lacks a quantity
or never varies it, has no term, and ``absent`` says why.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Array
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.telemetry.logs import Telemetry
from planner.telemetry.parameters import free_places, reference_surface, usual_value
from planner.telemetry.prediction import Nodes, secants

NEGLIGIBLE_WATTS = 1e-7
"""A column below this everywhere does nothing in this log."""


@dataclass(frozen=True)
class Column:
    """One parameter of an effect, away from its null value.

    Attributes:
        effect: slug.
        parameter: name; with the element for wheels and surfaces ("excess 2").
        place: number in the library model's parameters.
        shape: place and value of a scanned shape parameter, or None.
        low, high: what the bounds leave for (value - null).
    """

    effect: str
    parameter: str
    place: int
    shape: tuple[int, float] | None
    low: float
    high: float


@dataclass(frozen=True)
class Term:
    """One form of an effect: some of its columns together."""

    effect: str
    columns: tuple[int, ...]
    scanned: bool = False


@dataclass(frozen=True)
class CandidateLibrary:
    """Columns of all candidates around one model.

    Attributes:
        model: the model with every candidate at its null values.
        places: (p,) free parameters of the model itself.
        candidates: the columns.
        amplitudes: (m,) sizes, in units of the parameters, that the secants are taken at.
        terms: forms of effects that this log can show.
        absent: slug → why the log cannot show the effect at all.
        own: slugs of the model's own effects.
        held: numbers of candidates that are in the power at their amplitude.
    """

    model: PowerModel
    own: frozenset[str]
    places: tuple[int, ...]
    candidates: tuple[Column, ...]
    amplitudes: Array
    terms: tuple[Term, ...]
    absent: Mapping[str, str]
    held: tuple[int, ...] = ()

    def columns(self, nodes: Nodes) -> tuple[Array, Array, Array]:
        """Power, tangent of the model, and columns of the candidates.

        Candidates that are ``held`` are at their size in the power; their columns say what they do
        there, all others what they would do beside them.

        Args:
            nodes: the rows.

        Returns:
            (n,) W, (n, p) W per unit, (n, m) W per unit.
        """
        model = self.held_model
        variants = np.tile(model.parameters, (len(self.candidates), 1))
        steps = np.empty(len(variants))
        holder = {self.candidates[number].place: number for number in self.held}
        for number, column in enumerate(self.candidates):
            amplitude = self.amplitudes[number]
            null = self.model.parameters[column.place]
            variants[number, column.place] = null if number in self.held else null + amplitude
            steps[number] = -amplitude if number in self.held else amplitude
            if column.shape is not None and number not in self.held:
                variants[number, column.shape[0]] = column.shape[1]
        watts, own, columns = secants(model, nodes, self.places, variants, steps)
        for number, column in enumerate(self.candidates):
            other = holder.get(column.place)
            if other is not None and other != number:
                # The same parameter with another shape: measured from where neither is.
                columns[:, number] += (
                    columns[:, other] * self.amplitudes[other] / self.amplitudes[number]
                )
        return watts, own, columns

    def forms_of(self, slug: str, log: Telemetry) -> list[Array]:
        """Columns of an effect that another log could show.

        Args:
            slug: of an effect that this library lacks.
            log: rows with the quantities that the effect reads.

        Returns:
            (n, k) W per usual size of its parameters, by value of a scanned shape.
        """
        columns, _ = _columns(self.model, {slug}, log)
        if not columns:
            return []
        sizes = np.array([_usual(self.model, column) for column in columns])
        own = replace(self, candidates=tuple(columns), amplitudes=sizes, held=())
        watts = own.columns(Nodes.of(log, self.model))[2] * sizes
        if columns[0].shape is None:
            return [watts]
        return [watts[:, [k]] for k in range(len(columns))]

    @cached_property
    def held_model(self) -> PowerModel:
        """The model with what is held at its size."""
        values = self.model.parameters.copy()
        for number in self.held:
            column = self.candidates[number]
            values[column.place] += self.amplitudes[number]
            if column.shape is not None:
                values[column.shape[0]] = column.shape[1]
        return replace(self.model, parameters=values)

    def around(self, model: PowerModel, amplitudes: Array, held: Sequence[int]) -> CandidateLibrary:
        """The same columns around other values of the model's own parameters.

        Args:
            model: has at least the effects of ``own``; what else it has does not count.
            amplitudes: (m,) sizes of the candidates, inside their bounds and not zero.
            held: numbers of the candidates that are in the power at their size.
        """
        values = self.model.parameters.copy()
        given = dict(zip(model.parameter_names, model.parameters, strict=True))
        for place, key in enumerate(self.model.parameter_names):
            if key[0] in self.own:
                values[place] = given[key]
        around = replace(self.model, parameters=values)
        return replace(self, model=around, amplitudes=amplitudes, held=tuple(held))


def candidate_library(
    model: PowerModel, log: Telemetry, *, extra: Sequence[type[Effect]] = ()
) -> CandidateLibrary:
    """The catalogue's columns for a log.

    Args:
        model: the model that may lack something.
        log: says which quantities are known and vary.
        extra: custom effects to count as candidates.
    """
    has = {effect.slug for effect in model.effects}
    catalogue = [effect for effect in all_effects().values() if not effect.base]
    wanted = [effect for effect in (*catalogue, *extra) if effect.slug not in has]
    full = with_effects(model, wanted, log)
    columns, absent = _columns(full, {e.slug for e in wanted}, log)
    places = _own_places(model, full, log)
    amplitudes = np.array([_usual(full, column) for column in columns])
    own = frozenset(has)
    library = CandidateLibrary(full, own, places, tuple(columns), amplitudes, (), absent)
    probe = log.take(np.linspace(0, len(log) - 1, min(len(log), 4000)).astype(int))
    nodes = Nodes.of(probe, full)
    acts = np.abs(library.columns(nodes)[2]) * np.abs(amplitudes) > NEGLIGIBLE_WATTS
    kept = np.flatnonzero(acts.any(axis=0))
    columns = [columns[k] for k in kept]
    shown = {column.effect for column in columns}
    for effect in wanted:
        if effect.slug not in shown and effect.slug not in absent:
            absent = {**absent, effect.slug: _why_absent(effect, log)}
    return CandidateLibrary(
        full, own, places, tuple(columns), amplitudes[kept], _terms(columns), dict(absent)
    )


def with_effects(model: PowerModel, wanted: Sequence[type[Effect]], log: Telemetry) -> PowerModel:
    """The model with effects beside it at their null values; its own parameters stay.

    Args:
        model: the model.
        wanted: effects that it does not have.
        log: names the kinds of ground that parameters may be given for.
    """
    full = PowerModel.from_vehicle(
        model.vehicle,
        effects=[*(e for e in model.effects if not e.base), *wanted],
        kind=model.kind,
        surfaces=[*model.surfaces, *log.surfaces],
    )
    # The surface list of the model comes first, so that its elements keep their numbers.
    full = replace(full, surfaces=tuple(dict.fromkeys([*model.surfaces, *full.surfaces])))
    full = PowerModel(
        full.vehicle, full.effects, np.zeros(0), full.kind, full.surfaces, name=model.name
    )
    values = dict(zip(model.parameter_names, model.parameters, strict=True))
    for effect, name, parameter, element in full.slots:
        null = usual_value(model, effect, name) if parameter.null is None else parameter.null
        values.setdefault((effect.slug, name, element), null)
    return replace(full, parameters=np.array([values[key] for key in full.parameter_names], float))


def _own_places(model: PowerModel, full: PowerModel, log: Telemetry) -> tuple[int, ...]:
    free = {model.parameter_names[place] for place in free_places(model, log)}
    return tuple(place for place, key in enumerate(full.parameter_names) if key in free)


def _columns(
    full: PowerModel, wanted: Collection[str], log: Telemetry
) -> tuple[list[Column], dict[str, str]]:
    columns: list[Column] = []
    absent: dict[str, str] = {}
    for effect in full.effects:
        if effect.slug in wanted and effect.before_meter and log.power_at != "source":
            absent[effect.slug] = (
                "power was measured at the terminals, behind the battery's own resistance; a "
                'mapping file with power_at = "source" would say otherwise'
            )
    reference = reference_surface(full, log)
    shapes = {
        effect.slug: [
            (place, value)
            for place, (owner, _, parameter, _) in enumerate(full.slots)
            if owner is effect
            for value in parameter.grid
        ]
        for effect in full.effects
    }
    for place, (effect, name, parameter, element) in enumerate(full.slots):
        slug = effect.slug
        if slug not in wanted or slug in absent or parameter.null is None or not parameter.fitted:
            continue
        if parameter.per == "surface" and (element == reference or not full.surfaces):
            continue
        if parameter.per == "wheel" and element == full.vehicle.layout.wheel_count - 1:
            continue  # the factors average to 1: the last one follows from the others
        label = name if parameter.per is None else f"{name} {element}"
        low, high = (bound - parameter.null for bound in parameter.bounds)
        if parameter.per == "wheel":
            low, high = low - high, high - low  # against the last wheel
        scanned: list[tuple[int, float] | None] = [*shapes[slug]]
        columns += [Column(slug, label, place, shape, low, high) for shape in scanned or [None]]
    return columns, absent


def _usual(full: PowerModel, column: Column) -> float:
    """Size of an effect before anything is known: the vehicle's value or the declared one."""
    effect, name, parameter, _ = full.slots[column.place]
    if parameter.tried_at is not None:
        return float(parameter.tried_at)
    value = usual_value(full, effect, name)
    null = parameter.null or 0.0
    size = value - null or parameter.default - null or 0.2
    if parameter.per is None and size == 0.2 and parameter.unit != "1":
        size = 0.01 * min(1.0, parameter.bounds[1])
    return float(np.clip(size, column.low, column.high)) or size


def _terms(columns: Sequence[Column]) -> tuple[Term, ...]:
    """Every effect by each of its parameters, and by all together; wheels and grounds only so."""
    terms: list[Term] = []
    by_effect: dict[str, list[int]] = {}
    for number, column in enumerate(columns):
        by_effect.setdefault(column.effect, []).append(number)
    for slug, numbers in by_effect.items():
        elements = all(" " in columns[n].parameter for n in numbers)
        scanned = any(columns[n].shape is not None for n in numbers)
        if scanned:
            terms += [Term(slug, (n,), True) for n in numbers]
        elif elements:
            terms.append(Term(slug, tuple(numbers)))
        else:
            for count in range(1, len(numbers) + 1):
                terms += [Term(slug, some) for some in itertools.combinations(numbers, count)]
    return tuple(terms)


def _why_absent(effect: type[Effect], log: Telemetry) -> str:
    missing = sorted(name for name in effect.reads if name not in log.present)
    if missing:
        return f"the log has no {' and no '.join(missing)}"
    if any(parameter.per == "surface" for parameter in effect.parameters.values()):
        return "the log knows only one kind of ground"
    return "what it acts on does not occur in this log"
