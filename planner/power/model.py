"""The power model of one vehicle: which effects act, with which parameters.

    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    rows = rows_from(vx=[0.5], gravity_x=[-1.7], gravity_normal=[9.66])
    model.watts(rows)                 # (n,) W at the supply terminals
    model.watts_by_effect(rows)       # {slug: (n,) W}, adds up to the same

How watts are shared out: the eight effects of the base model by their physical balance, with all
other effects switched off; every other effect by the change that it makes when it is switched on,
in the order of the catalogue. The sum is the model's power, whatever the effects do to each other.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np

from planner.arrays import Array
from planner.errors import ModelError, VehicleError
from planner.power.account import ACCOUNT, ACCOUNT_LENGTH, BASE_EFFECTS, LIMITS, PER_WHEEL, Output
from planner.power.catalogue import all_effects
from planner.power.effect import Effect, parameter_slots
from planner.power.formulas import effect_from_definition
from planner.power.kernel_math import SLIDING_SPEED
from planner.power.kernels import Kernel, KernelSpec, compile_kernel
from planner.power.saved import EnergyError, ParameterCovariance, SavedModel
from planner.power.vehicles import Vehicle, defaults_in_words
from planner.shown import Shown

FORMAT = "joulepath-model/1"
_SAVED = "a file that `joulepath adopt` or PowerModel.save wrote"


@dataclass(frozen=True)
class PowerModel(Shown):
    """Effects, their parameters and the vehicle that they describe; never changed in place.

    Attributes:
        vehicle: geometry and limits.
        effects: active effects in the order of the catalogue.
        parameters: (P,) values, in the order of ``slots``.
        kind: "sound", or "printed/A" and "printed/B" for the source paper's equations.
        surfaces: labels that parameters given for each surface refer to.
        stderr: (P,) standard errors from a fit; NaN where the value was never calibrated.
        covariance: of the fitted parameters; None where the model was never adopted.
        energy_error: noise of a drive's energy and what held-out runs said; None likewise.
        name, version, parent: which model this is and which one it was made from.
        history: what was adopted, from which data, with which error before and after.
        sliding_speed: m/s within which the friction of rims and rollers changes sign.
        time_weight: W, that is J for every second, on top of the power. The least of
            ∫ (P + λ) dt = E + λ·T is a motion that is cheap and quick. Steady costs, yaw and speed
            profiles, ramps and stops all include it. Accounts by effect do not.
    """

    vehicle: Vehicle
    effects: tuple[type[Effect], ...]
    parameters: Array
    kind: str = "sound"
    surfaces: tuple[str, ...] = ()
    stderr: Array | None = None
    name: str = ""
    version: int = 1
    parent: str | None = None
    history: tuple[Mapping[str, Any], ...] = field(default=())
    covariance: ParameterCovariance | None = None
    energy_error: EnergyError | None = None
    sliding_speed: float = SLIDING_SPEED
    time_weight: float = 0.0

    @classmethod
    def from_vehicle(
        cls,
        vehicle: Vehicle,
        *,
        effects: Sequence[str | type[Effect]] | None = None,
        kind: str = "sound",
        surfaces: Sequence[str] = (),
    ) -> PowerModel:
        """The model that a vehicle's file describes.

        Args:
            vehicle: from load_vehicle.
            effects: slugs beside the base model, or effects (custom ones);
                None takes the vehicle's active ones.
            kind: "sound", "printed/A" or "printed/B".
            surfaces: labels beside those that the vehicle's file names.

        Raises:
            ModelError: no such kind or effect.
            VehicleError: it is no vehicle, such as a name.
        """
        if kind not in ("sound", "printed/A", "printed/B"):
            raise ModelError(
                "kind", "no such model", value=kind, accepted="sound, printed/A, printed/B"
            )
        if not isinstance(cast(object, vehicle), Vehicle):
            accepted = "what load_vehicle gives for a name or a file"
            raise VehicleError("vehicle", "is no vehicle", value=vehicle, accepted=accepted)
        chosen = vehicle.active if effects is None else effects
        custom = [e for e in chosen if not isinstance(e, str) and e.definition is not None]
        wanted = {e if isinstance(e, str) else e.slug for e in chosen if e not in custom}
        catalogue = all_effects()
        for slug in wanted - set(catalogue):
            raise ModelError("effects", "no such effect", value=slug, accepted=", ".join(catalogue))
        active = tuple(e for s, e in catalogue.items() if e.base or s in wanted)
        active += tuple(dict.fromkeys(custom))
        named = _surface_labels(vehicle, active)
        labels = tuple(dict.fromkeys([*named, *surfaces]))
        model = cls(vehicle, active, np.zeros(0), kind, labels, name=vehicle.name)
        values = [
            _given(vehicle, effect.slug, name, parameter.default, element, labels)
            for effect, name, parameter, element in model.slots
        ]
        return replace(model, parameters=np.array(values, float))

    @cached_property
    def slots(self) -> list[tuple[type[Effect], str, Any, int]]:
        """Effect, parameter name, declaration and element of every number in ``parameters``."""
        return parameter_slots(
            self.effects,
            wheel_count=self.vehicle.layout.wheel_count,
            surface_count=max(1, len(self.surfaces)),
        )

    def defaults_in_words(self) -> list[str]:
        """Key, value and unit of every vehicle default that the model uses."""
        values: dict[tuple[str, str], set[float]] = {}
        for (effect, name, _, _), value in zip(self.slots, self.parameters, strict=True):
            values.setdefault((effect.slug, name), set()).add(float(value))
        return defaults_in_words(self.vehicle, values)

    @property
    def parameter_names(self) -> list[tuple[str, str, int]]:
        """Effect's slug, name and element of every number in ``parameters``."""
        return [(effect.slug, name, element) for effect, name, _, element in self.slots]

    @cached_property
    def body(self) -> Array:
        """(len(Body),) mass, geometry and the like as the kernel reads them."""
        v = self.vehicle
        geometry = v.mass, v.com_height, v.layout.radius, v.gear_ratio, v.traction
        return np.array([*geometry, self.sliding_speed, self.time_weight])

    @property
    def wheels(self) -> Array:
        """(n, COLUMNS) wheel table as the kernel reads it."""
        return self.vehicle.layout.table

    @cached_property
    def kernel(self) -> Kernel:
        """Compiled model for real parameters, see planner.power.kernels.pipeline."""
        return self._compile("float64")

    @cached_property
    def power_kernel(self) -> Kernel:
        """The same power of blocks of rows, without account and limits, for loops over logs."""
        return self._compile("float64", output="power")

    @cached_property
    def limits_kernel(self) -> Kernel:
        """The same power of blocks of rows and what limits are set for, for loops over motions."""
        return self._compile("float64", output="limits")

    def _compile(self, number: str, *, output: Output = "account") -> Kernel:
        printed = self.kind.partition("/")[2] or None
        # Numbers of what no parameter is given for do not count: such models share their code.
        per = {parameter.per for _, _, parameter, _ in self.slots}
        wheels = self.vehicle.layout.wheel_count if "wheel" in per else 0
        surfaces = max(1, len(self.surfaces)) if "surface" in per else 0
        return compile_kernel(KernelSpec(self.effects, wheels, surfaces, number, printed, output))

    def evaluate(self, rows: Array) -> tuple[Array, Array]:
        """Accounts (n, ACCOUNT_LENGTH) of all rows, and per-wheel values of the last row."""
        return self.kernel.accounts(rows, self.parameters, self.body, self.wheels)

    def account(self, rows: Array) -> dict[str, Array]:
        """Balance and limits by the names of planner.power.account.ACCOUNT, each (n,)."""
        accounts, _ = self.evaluate(rows)
        return {name: accounts[:, column] for column, name in enumerate(ACCOUNT)}

    def watts(self, rows: Array) -> Array:
        """Power at the supply terminals, W, shape (n,)."""
        accounts, _ = self.evaluate(rows)
        return accounts[:, 0].copy()

    def watts_in_blocks(self, rows: Array) -> Array:
        """As ``watts``, bit by bit, by the kernel for logs, which compiles in half the time."""
        own = self.parameters, self.body, self.wheels
        return self.power_kernel.results(rows, *own, count=1)[:, 0]

    def power_and_limits(self, rows: Array) -> Array:
        """The power in W and behind it the LIMITS of planner.power.account, (n, 1 + limits).

        Faster than ``evaluate`` for many rows; a kernel of its own is compiled for it.
        """
        return self.limits_kernel.results(
            rows, self.parameters, self.body, self.wheels, count=1 + len(LIMITS)
        )

    def watts_by_effect(
        self, rows: Array, *, watts: Callable[[PowerModel, Array], Array] | None = None
    ) -> dict[str, Array]:
        """Share of every active effect, W, each (n,); adds up to ``watts``.

        Args:
            rows: (n, ROW_LENGTH).
            watts: how the power of a model is worked out for rows, instead of by ``evaluate``.
        """
        current = self.without_candidates()
        accounts, _ = current.evaluate(rows)
        shares = {
            slug: accounts[:, len(ACCOUNT) + column].copy()
            for column, slug in enumerate(BASE_EFFECTS)
        }
        before = accounts[:, 0]
        for effect in self.effects:
            if effect.base:
                continue
            # The same kernel with one more effect away from its null values.
            parameters = self._switch_on(current.parameters, effect)
            if np.array_equal(parameters, current.parameters):
                shares[effect.slug] = np.zeros(len(rows))
                continue
            current = replace(current, parameters=parameters)
            after = (watts or PowerModel.watts)(current, rows)
            shares[effect.slug] = after - before
            before = after
        return shares

    def without(self, slug: str) -> PowerModel:
        """The same model with an effect at its null values."""
        values = self.parameters.copy()
        for place, (effect, _, parameter, _) in enumerate(self.slots):
            if effect.slug == slug and parameter.null is not None:
                values[place] = parameter.null
        return replace(self, parameters=values)

    def share_of(self, slug: str, rows: Array) -> Array:
        """(n,) W that an effect adds to all others, in rows (n, ROW_LENGTH)."""
        return self.watts_in_blocks(rows) - self.without(slug).watts_in_blocks(rows)

    def without_candidates(self) -> PowerModel:
        """The same model with every effect beside the base at its null values."""
        values = self.parameters.copy()
        for place, (effect, _, parameter, _) in enumerate(self.slots):
            if not effect.base and parameter.null is not None:
                values[place] = parameter.null
        return replace(self, parameters=values)

    def _switch_on(self, values: Array, effect: type[Effect]) -> Array:
        mine = np.array([slot[0] is effect for slot in self.slots])
        return np.where(mine, self.parameters, values)

    def with_parameter(self, place: int, value: float) -> PowerModel:
        """The same model with one number of ``parameters`` replaced."""
        values = self.parameters.copy()
        values[place] = value
        return replace(self, parameters=values)

    def jacobian(self, rows: Array, step: float = 1e-20) -> Array:
        """Derivative of the power by every parameter, by complex step, shape (n, P)."""
        rows = np.ascontiguousarray(rows, dtype=float)
        kernel = self._compile("complex128")
        account = np.empty(ACCOUNT_LENGTH, complex)
        per_wheel = np.empty((len(self.wheels), len(PER_WHEEL)), complex)
        result = np.empty((len(rows), len(self.parameters)))
        for column in range(len(self.parameters)):
            values = self.parameters.astype(complex)
            values[column] += 1j * step
            for k, row in enumerate(rows):
                watts = kernel(row, values, self.body, self.wheels, account, per_wheel)
                result[k, column] = watts.imag / step
        return result

    @cached_property
    def uncertainty(self) -> Array:
        """(P,) standard deviation of every parameter: fitted, stated, or its prior spread."""
        shares = []
        for effect, name, parameter, _ in self.slots:
            stated = self.vehicle.uncertainty_of(effect.slug, name)
            shares.append(parameter.spread if stated is None else stated)
        prior: Array = np.abs(self.parameters) * np.array(shares)
        if self.stderr is None:
            return prior
        return np.where(np.isnan(self.stderr), prior, self.stderr)

    def describe(self) -> dict[str, Any]:
        """Name, version, effects and parameters, ready for JSON."""
        effects: dict[str, dict[str, Any]] = {effect.slug: {} for effect in self.effects}
        for (effect, name, parameter, element), value in zip(
            self.slots, self.parameters, strict=True
        ):
            if parameter.per is None:
                effects[effect.slug][name] = float(value)
            elif parameter.per == "wheel":
                effects[effect.slug].setdefault(name, []).append(float(value))
            elif self.surfaces:
                effects[effect.slug].setdefault(name, {})[self.surfaces[element]] = float(value)
        return {
            "name": self.name,
            "version": self.version,
            "kind": self.kind,
            "vehicle": self.vehicle.name,
            "parent": self.parent,
            "effects": effects,
        }

    def document(self) -> dict[str, Any]:
        """The model with its vehicle, ready for strict JSON; ``from_document`` reads it back."""
        return {
            "format": FORMAT,
            **self.describe(),
            "vehicle": self.vehicle.document(),
            "custom": [e.definition for e in self.effects if e.definition is not None],
            "surfaces": list(self.surfaces),
            "stderr": None
            if self.stderr is None
            else [None if np.isnan(v) else float(v) for v in self.stderr],
            "covariance": self.covariance and self.covariance.document(),
            "energy_error": self.energy_error and self.energy_error.document(),
            "history": list(self.history),
        }

    def save(self, path: str | Path) -> None:
        """Write the model as strict JSON; ``load`` reads it back bit by bit."""
        text = json.dumps(self.document(), indent=2, ensure_ascii=False, allow_nan=False)
        Path(path).write_text(text + "\n", "utf-8")

    @classmethod
    def load(cls, path: str | Path) -> PowerModel:
        """Read a saved model; its vehicle comes from the same file, not from those installed.

        Raises:
            ModelError: not a model's file, or it names effects or parameters that do not exist.
        """
        if not isinstance(path, str | PathLike):
            raise ModelError("model", "is no path", value=path, accepted=_SAVED)
        try:
            document = json.loads(Path(path).read_text("utf-8"))
        except OSError as error:
            raise ModelError(str(path), f"cannot be read: {error}", accepted=_SAVED) from error
        except (ValueError, RecursionError) as error:
            raise ModelError(str(path), f"not JSON: {error}", accepted=_SAVED) from error
        return cls.from_document(document, str(path))

    @classmethod
    def from_document(cls, document: Any, where: str = "model") -> PowerModel:
        """The model that ``document`` describes.

        Args:
            document: what ``document()`` gave.
            where: what to call it in an error.

        Raises:
            ModelError: as ``load``.
        """
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            raise ModelError(where, "not a joulepath model", accepted=_SAVED)
        SavedModel.check(document, where)
        try:
            effects = document["effects"]
            made = [effect_from_definition(entry) for entry in document.get("custom", [])]
            custom = {effect.slug: effect for effect in made}
            model = cls.from_vehicle(
                Vehicle.from_document(document["vehicle"]),
                effects=[custom.get(slug, slug) for slug in effects],
                kind=document["kind"],
                surfaces=document["surfaces"],
            )
            model = replace(model, surfaces=tuple(document["surfaces"]))
            values = [
                _element(effects[effect.slug][name], parameter.per, element, model.surfaces)
                for effect, name, parameter, element in model.slots
            ]
            if not np.isfinite(values).all():
                raise ValueError("a parameter that is not a finite number")
            stderr = document["stderr"]
            covariance, error = document.get("covariance"), document.get("energy_error")
            return replace(
                model,
                parameters=np.array(values, float),
                stderr=None
                if stderr is None
                else np.array([np.nan if v is None else v for v in stderr], float),
                name=document["name"],
                version=document["version"],
                parent=document["parent"],
                history=tuple(document["history"]),
                covariance=covariance and ParameterCovariance.from_document(covariance),
                energy_error=error and EnergyError.from_document(error),
            )
        except (AttributeError, LookupError, TypeError, ValueError, OverflowError) as error:
            raise ModelError(where, f"incomplete: {error!r}", accepted=_SAVED) from error


def _surface_labels(vehicle: Vehicle, effects: Sequence[type[Effect]]) -> list[str]:
    labels: list[str] = []
    for effect in effects:
        for value in vehicle.parameters.get(effect.slug, {}).values():
            if isinstance(value, dict):
                labels += list(value)
    return labels


def _given(
    vehicle: Vehicle, slug: str, name: str, default: float, element: int, labels: Sequence[str]
) -> float:
    value = vehicle.parameters.get(slug, {}).get(name, default)
    if isinstance(value, dict):
        return float(value.get(labels[element], default))
    if isinstance(value, list):
        return float(value[element])
    return float(value)


def _element(value: Any, per: str | None, element: int, surfaces: Sequence[str]) -> float:
    if per is None:
        return float(value)
    if per == "wheel":
        return float(value[element])
    return float(value[surfaces[element]]) if surfaces else 0.0
