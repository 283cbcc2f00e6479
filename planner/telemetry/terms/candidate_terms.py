"""What every effect that a model does not have would add: one column of watts for each parameter.

    library = candidate_library(model, log)
    watts, tangent, columns = library.columns(nodes)     # (n,), (n, p) and (n, m) W per unit

The columns are secants of one model that has the whole catalogue, each effect at its null values
but one: what the effect does at the size that it is thought to have (``amplitudes``), over that
size. A derivative at null would misjudge an effect whose power is not linear in its parameter.

An *atom* is one way for an effect to act: one of its parameters, or several together, or one value
of a shape that is scanned (stiction's speed). An effect whose columns vanish, because the log lacks
a quantity or never varies it, has no atom, and ``absent`` says why.
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
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.parameters import free_places
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
        shape: place and value of a scanned shape parameter, or None; shape_name is its name.
        low, high: what the bounds leave for (value - null).
    """

    effect: str
    parameter: str
    place: int
    shape: tuple[int, float] | None
    low: float
    high: float
    shape_name: str = ""


@dataclass(frozen=True)
class Atom:
    """One way for an effect to act: some of its columns together."""

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
        atoms: ways for effects to act that this log can show.
        absent: slug → why the log cannot show the effect at all.
        own: slugs of the model's own effects.
        held: numbers of candidates that are in the power at their amplitude.
    """

    model: PowerModel
    own: frozenset[str]
    places: tuple[int, ...]
    candidates: tuple[Column, ...]
    amplitudes: Array
    atoms: tuple[Atom, ...]
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
        given = {
            (effect.slug, name, element): value
            for (effect, name, _, element), value in zip(model.slots, model.parameters, strict=True)
        }
        for place, (effect, name, _, element) in enumerate(self.model.slots):
            if effect.slug in self.own:
                values[place] = given[effect.slug, name, element]
        return replace(
            self,
            model=replace(self.model, parameters=values),
            amplitudes=amplitudes,
            held=tuple(held),
        )


def candidate_library(
    model: PowerModel,
    log: Telemetry,
    *,
    extra: Sequence[type[Effect]] = (),
    only: Collection[str] | None = None,
) -> CandidateLibrary:
    """The catalogue's columns for a log.

    Args:
        model: the model that may lack something.
        log: says which quantities are known and vary.
        extra: custom effects to count as candidates.
        only: slugs to take; None takes all that the model does not have.
    """
    has = {effect.slug for effect in model.effects}
    wanted: list[type[Effect]] = [
        effect
        for slug, effect in all_effects().items()
        if not effect.base and slug not in has and (only is None or slug in only)
    ]
    wanted += [effect for effect in extra if effect.slug not in has]
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
        full, own, places, tuple(columns), amplitudes[kept], _atoms(columns), dict(absent)
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
    own = {
        (slot[0].slug, slot[1], slot[3]): value
        for slot, value in zip(model.slots, model.parameters, strict=True)
    }
    vehicle = model.vehicle.parameters
    values = []
    for effect, name, parameter, element in full.slots:
        key = (effect.slug, name, element)
        if key in own:
            values.append(float(own[key]))
        elif parameter.null is not None:
            values.append(parameter.null)
        else:
            given = vehicle.get(effect.slug, {}).get(name, parameter.default)
            values.append(float(given) if isinstance(given, int | float) else parameter.default)
    return replace(full, parameters=np.array(values, float))


def _own_places(model: PowerModel, full: PowerModel, log: Telemetry) -> tuple[int, ...]:
    free = {
        (slot[0].slug, slot[1], slot[3])
        for place, slot in enumerate(model.slots)
        if place in free_places(model, log)
    }
    return tuple(
        place
        for place, (effect, name, _, element) in enumerate(full.slots)
        if (effect.slug, name, element) in free
    )


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
    commonest = _commonest_surface(full, log)
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
        if parameter.per == "surface" and element == commonest:
            continue
        if parameter.per == "wheel" and element == full.vehicle.layout.wheel_count - 1:
            continue  # the factors average to 1: the last one follows from the others
        label = name if parameter.per is None else f"{name} {element}"
        low, high = (bound - parameter.null for bound in parameter.bounds)
        if parameter.per == "wheel":
            low, high = low - high, high - low  # against the last wheel
        scanned: list[tuple[int, float] | None] = [*shapes[slug]]
        for shape in scanned or [None]:
            called = full.slots[shape[0]][1] if shape is not None else ""
            columns.append(Column(slug, label, place, shape, low, high, called))
    return columns, absent


def _commonest_surface(full: PowerModel, log: Telemetry) -> int:
    """The label that is the reference; -1 when rows without a label are."""
    if not full.surfaces:
        return 0
    numbers = log.rows_for(full.surfaces)[:, INDEX["surface"]]
    if np.any(numbers < 0):
        return -1
    return int(np.argmax(np.bincount(numbers.astype(int))))


def _usual(full: PowerModel, column: Column) -> float:
    """Size of an effect before anything is known: the vehicle's value or the declared one."""
    effect, name, parameter, _ = full.slots[column.place]
    given = full.vehicle.parameters.get(effect.slug, {}).get(name, parameter.default)
    value = float(given) if isinstance(given, int | float) else parameter.default
    null = parameter.null or 0.0
    size = value - null or parameter.default - null or 0.2
    if parameter.per is None and size == 0.2 and parameter.unit != "1":
        size = 0.01 * min(1.0, parameter.bounds[1])
    return float(np.clip(size, column.low, column.high)) or size


def _atoms(columns: Sequence[Column]) -> tuple[Atom, ...]:
    """Every effect by each of its parameters, and by all together; wheels and grounds only so."""
    atoms: list[Atom] = []
    by_effect: dict[str, list[int]] = {}
    for number, column in enumerate(columns):
        by_effect.setdefault(column.effect, []).append(number)
    for slug, numbers in by_effect.items():
        elements = all(" " in columns[n].parameter for n in numbers)
        scanned = any(columns[n].shape is not None for n in numbers)
        if scanned:
            atoms += [Atom(slug, (n,), True) for n in numbers]
        elif elements:
            atoms.append(Atom(slug, tuple(numbers)))
        else:
            for count in range(1, len(numbers) + 1):
                atoms += [Atom(slug, some) for some in itertools.combinations(numbers, count)]
    return tuple(atoms)


def _why_absent(effect: type[Effect], log: Telemetry) -> str:
    missing = sorted(name for name in effect.reads if name not in log.present)
    if missing:
        return f"the log has no {' and no '.join(missing)}"
    if any(parameter.per == "surface" for parameter in effect.parameters.values()):
        return "the log knows only one kind of ground"
    return "what it acts on does not occur in this log"
