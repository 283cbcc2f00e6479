"""How visible an effect is on a drive, from the robot itself and not from any diagnosis.

    view = View(exact, measured, toml, folder, case)
    view.figures(changes, noise, hidden)      # {"rho", "beside", "apart", "rival"}

What an effect changes is the clean log with it minus the clean log without it. The scatter that it
has to stand out from is the noise of the power column together with what the errors of all other
columns and the changes within a row leave of the base model (``misfit``).

    rho     rms of what is left of the change after projecting out what refitting the base model
            absorbs, over the rms of the scatter; only as far as the catalogue's effect explains it,
            because the robot's ramps within a row belong to no effect
    beside  the same after projecting out the other hidden effects as well
    apart   how much better the truth explains the log than its nearest rival of the catalogue, in
            standard deviations of the scatter, from exact inputs and derivatives at the null values

Projections are on every few rows only, weighted with the scatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.catalogue import all_effects, find_effect
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.virtual import Noise, VirtualLog
from tests.hidden_effects.cases import Case, Settings

Array = NDArray[np.float64]

ROWS_SEEN = 1000  # rows of which projections are made


class View:
    """What can be seen on a drive.

    Args:
        exact: the log of the robot without its effects and without errors.
        measured: the same with the errors of all columns but power.
        toml: the robot.
        folder: where a file may be written in passing.
        case: gives the columns that the log lacks and where power was measured.

    Attributes:
        misfit: W rms that the base model misses ``measured`` by, refitted, with nothing hidden:
            errors of the inputs, and what changes within a row.
    """

    def __init__(
        self, exact: VirtualLog, measured: VirtualLog, toml: Path, folder: Path, case: Case
    ) -> None:
        log = _reading(exact, folder / f"{toml.stem}-quiet.parquet", case)
        self.power = log.power
        self.step = max(1, len(log) // ROWS_SEEN)
        effects = [slug for slug, effect in all_effects().items() if not effect.base]
        self.model = PowerModel.from_vehicle(
            load_vehicle(str(toml)), effects=effects, surfaces=log.surfaces
        ).without_candidates()
        self.rows = log.rows_for(self.model.surfaces)[:: self.step]
        self.tangent, self.columns = _derivatives(self.model, self.rows)
        if not case.power_at_source:
            for slug in [slug for slug in self.columns if find_effect(slug).before_meter]:
                del self.columns[slug]
        inputs = _reading(measured, folder / f"{toml.stem}-inputs.parquet", case)
        missed = (inputs.power - predict(self.model, inputs))[:: self.step]
        self.misfit = float(np.sqrt(np.mean(_left(missed, self.tangent) ** 2)))

    def noise_spread(self, noise: Noise) -> Array:
        """W, standard deviation of the noise in the power column, every few rows."""
        usual = float(np.mean(np.abs(self.power)))
        spread = max(noise.level, 1e-6) * np.maximum(np.abs(self.power), noise.floor * usual)
        return spread[:: self.step]

    def _scatter(self, noise: Noise) -> Array:
        """W, of all that is not the effect."""
        return np.sqrt(self.noise_spread(noise) ** 2 + self.misfit**2)

    def _own(self, slug: str, settings: Mapping[str, Any]) -> Array:
        """Columns that the catalogue's effect has, with its change at the true strength."""
        model = with_settings(self.model, slug, settings)
        secant = np.nan_to_num(
            model.watts_in_blocks(self.rows) - self.model.watts_in_blocks(self.rows)
        )
        return np.column_stack([secant, *self.columns[slug]])

    def rho(
        self,
        change: Array,
        noise: Noise,
        slug: str,
        settings: Mapping[str, Any],
        others: Sequence[Array] = (),
    ) -> float:
        """Rms of a change after projection over that of the scatter, as far as it has the shape
        that the catalogue gives the effect.
        """
        spread = self._scatter(noise)
        known = np.column_stack([self.tangent, *(o[:: self.step] for o in others)])
        target, known = change[:: self.step] / spread, known / spread[:, None]
        left = _left(target, known)
        if slug in self.columns:
            own = self._own(slug, settings) / spread[:, None]
            left = left - _left(target, np.column_stack([known, own]))
        left *= spread
        return float(np.sqrt(np.mean(left**2) / np.mean(spread**2)))

    def figures(
        self, changes: Mapping[str, Array], noise: Noise, hidden: Settings
    ) -> dict[str, Any]:
        """rho and beside of every hidden effect; apart and rival where one is hidden."""
        found: dict[str, Any] = {"rho": {}, "beside": {}}
        for slug, change in changes.items():
            others = [c for other, c in changes.items() if other != slug]
            found["rho"][slug] = self.rho(change, noise, slug, hidden[slug])
            found["beside"][slug] = self.rho(change, noise, slug, hidden[slug], others)
        if len(changes) == 1:
            slug, change = next(iter(changes.items()))
            if slug in self.columns:
                found["apart"], found["rival"] = self._apart(slug, change, noise, hidden[slug])
        return found

    def _apart(
        self, slug: str, change: Array, noise: Noise, settings: Mapping[str, Any]
    ) -> tuple[float, str]:
        spread = self._scatter(noise)
        target, tangent = change[:: self.step] / spread, self.tangent / spread[:, None]
        # Slow noise has this many times the variance of white noise of the same rms.
        slow = (1.0 + noise.correlation) / (1.0 - noise.correlation)
        times = self.step / (1.0 - noise.autocorrelated + noise.autocorrelated * slow)
        left = {}
        for name, shapes in self.columns.items():
            # The best of the declared shapes; a rival may take any sign.
            left[name] = min(
                float(np.sum(_left(target, np.column_stack([tangent, s / spread[:, None]])) ** 2))
                for s in shapes
            )
        del left[slug]
        own_columns = self._own(slug, settings) / spread[:, None]
        own = float(np.sum(_left(target, np.column_stack([tangent, own_columns])) ** 2))
        rival = min(left, key=lambda name: left[name])
        return math.sqrt(max(left[rival] - own, 0.0) * times), rival


def _reading(log: VirtualLog, passing: Path, case: Case) -> Telemetry:
    """The log as it is read, without the columns that the case's log lacks."""
    absent = case.sensors.get("absent", ())
    VirtualLog({k: v for k, v in log.columns.items() if k not in absent}, {}).write_parquet(passing)
    read = Telemetry.read(passing)
    passing.unlink()
    return read


def with_settings(model: PowerModel, slug: str, settings: Mapping[str, Any]) -> PowerModel:
    """The model with an effect at the strength that the robot was given."""
    for place, (effect, name, parameter, element) in enumerate(model.slots):
        if effect.slug != slug:
            continue
        if name.endswith("_squared") and name not in settings:  # of an offset to an unknown side
            value: Any = settings[name.removesuffix("_squared")] ** 2
        else:
            value = settings.get(name, parameter.default)
        if isinstance(value, Mapping):
            value = value.get(model.surfaces[element], 0.0)
        elif isinstance(value, list):
            value = value[element] - float(np.mean(value))
        model = model.with_parameter(place, float(value))
    return model


def _left(target: Array, columns: Array) -> Array:
    """What is left of a vector after projecting out columns, some of which may be dependent."""
    scale = np.linalg.norm(columns, axis=0)
    columns = columns[:, scale > 0.0] / scale[scale > 0.0]
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > 1e-9 * s[0]]
    left: Array = target - u @ (u.T @ target)
    return left


def _derivatives(model: PowerModel, rows: Array) -> tuple[Array, dict[str, list[Array]]]:
    """Tangent of the base model, and columns of every candidate, one table for each shape."""
    places: dict[str, list[int]] = {}
    base, grids = [], []
    for place, (effect, _, parameter, _) in enumerate(model.slots):
        if effect.base and parameter.fitted:
            base.append(place)
        elif parameter.grid:
            grids.append((place, effect.slug, parameter.grid))
        elif not effect.base and parameter.null is not None and parameter.fitted:
            places.setdefault(effect.slug, []).append(place)
    wanted = [*base, *(place for mine in places.values() for place in mine)]
    table = np.zeros((len(rows), len(model.parameters)))
    table[:, wanted] = np.nan_to_num(_columns(model, rows, wanted))
    columns = {slug: [table[:, mine]] for slug, mine in places.items()}
    for place, slug, grid in grids:
        columns[slug] = []
        for value in grid:
            shaped = model.with_parameter(place, value)
            columns[slug].append(np.nan_to_num(_columns(shaped, rows, places[slug])))
    return table[:, base], columns


def _columns(model: PowerModel, rows: Array, places: list[int]) -> Array:
    """Differences by some parameters, (n, len(places)); at an upper bound the step goes inwards."""
    before = model.watts_in_blocks(rows)
    made = []
    for place in places:
        parameter, value = model.slots[place][2], float(model.parameters[place])
        step = 1e-3 * max(abs(parameter.default), 1e-3)
        if value + step > parameter.bounds[1]:
            step = -step
        made.append(
            (model.with_parameter(place, value + step).watts_in_blocks(rows) - before) / step
        )
    return np.column_stack(made)
