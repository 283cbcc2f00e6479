"""Makes the log of a case, and says how visible its effects are, apart from any diagnosis.

    made = make(case, folder)     # made.log goes to the diagnosis, and nothing else does

The robot is not the vehicle of the diagnosis: its rolling, rollers, gear, motors, inertia and
electronics differ from the vehicle's file by 5 to 15 %, which the base model's fit has to find.
Names of the files say nothing about what is hidden.

How visible (watts of the clean log with the effect minus without it, on the training rows):
    rho     rms of what is left of it after projecting out what refitting the base model absorbs,
            over the rms of the noise in the power column; only as far as the catalogue's effect
            explains it, because the robot's ramps within a row belong to no effect
    beside  the same after projecting out the other hidden effects as well
    apart   how much better the truth explains the log than its nearest rival of the catalogue, in
            standard deviations of the noise, from exact inputs and derivatives at the null values

Projections are on every few rows only, weighted with the noise's spread.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.catalogue import all_effects
from planner.power.model import PowerModel
from planner.power.vehicle import VEHICLE_FOLDER, load_vehicle
from planner.telemetry import virtual
from planner.telemetry.log import Telemetry
from planner.telemetry.virtual.hidden import LARGEST_SCALE, scaled
from planner.telemetry.virtual_robot import QUIET, Noise, Profile, VirtualLog, VirtualRobot
from tests.hidden_effects.cases import SMALLEST_RHO, Case, Settings

Array = NDArray[np.float64]

VEHICLE = "minibalance"
EDITION = "1"  # to be raised where a change of this file changes logs
LARGEST_SIZE = 0.15
LOWEST_LEVEL = 0.01
# Beyond these strengths an effect is none that a robot of this kind has.
LARGEST_STRENGTH = {
    "creep": 0.3, "gain": 2.0, "offset_x": 0.06, "offset_y": 0.06, "excess": 1.0, "strength": 3.0,
    "transition_drag": 60.0, "ripple_squared": 1.0, "preload_squared": 100.0, "drag_torque": 0.15,
    "internal_resistance": 0.6, "diode_voltage": 1.5, "scrub_moment": 5.0, "exponent": 1.0,
    "shaking_force": 3.0, "copper_coefficient": 0.01,
}  # fmt: skip
ROWS_SEEN = 1000  # rows of which projections are made
# Standard deviations by which the robot differs from its file, relative.
SPREAD = {
    ("body", "yaw_inertia"): 0.10,
    ("wheels", "inertia"): 0.10,
    ("drive", "gear_efficiency"): 0.03,
    ("drive", "torque_constant"): 0.05,
    ("drive", "resistance"): 0.10,
    ("drive", "coulomb_torque"): 0.15,
    ("contact", "rolling"): 0.15,
    ("contact", "roller_drag"): 0.15,
    ("electronics", "power"): 0.15,
}


@dataclass(frozen=True)
class Made:
    """A log on disk and its truth.

    Attributes:
        log: training rows, what a diagnosis gets.
        held_out: rows of other runs of the same robot.
        mapping: mapping file that goes with both, or None.
        truth: strengths, sizes, rho, beside, apart, rival, noise_w, level, rows.
    """

    log: Path
    held_out: Path
    mapping: Path | None
    truth: dict[str, Any]

    @property
    def robot(self) -> Path:
        """TOML of the robot that drove; a diagnosis does not get it."""
        return self.log.with_suffix(".toml")


def make(case: Case, folder: Path) -> Made:
    """The log of a case; what has been made before is read again."""
    folder.mkdir(parents=True, exist_ok=True)
    key = hashlib.sha256((json.dumps(asdict(case), sort_keys=True) + _sources()).encode())
    stem = folder / key.hexdigest()[:16]
    made = Made(
        stem.with_suffix(".parquet"),
        folder / f"{stem.name}-later.parquet",
        folder / f"{stem.name}-mapping.toml" if case.power_at_source else None,
        {},
    )
    notes = stem.with_suffix(".json")
    if notes.exists():
        made.truth.update(json.loads(notes.read_text(encoding="utf-8")))
        return made
    write_robot(made.robot, np.random.default_rng(case.number))
    robot, noise, truth = _sized(case, made.robot, folder)
    made.truth.update(truth)
    drive = robot.profile(case.design)
    log = robot.drive(drive, noise=noise, sensors=case.sensors)
    training, later = log.split()
    training.write_parquet(made.log)
    later.write_parquet(made.held_out)
    if made.mapping is not None:
        made.mapping.write_text('power_at = "source"\n', encoding="utf-8")
    notes.write_text(json.dumps(made.truth), encoding="utf-8")
    return made


def write_robot(path: Path, rng: np.random.Generator) -> None:
    """Writes the vehicle's file with the values of a robot that is not quite like it."""
    section = ""
    lines = []
    for line in (VEHICLE_FOLDER / f"{VEHICLE}.toml").read_text(encoding="utf-8").splitlines():
        head = re.match(r"\[(\w+)\]", line)
        section = head[1] if head else section
        entry = re.match(r"(\w+) = \{ value = ([-0-9.e]+)(.*)", line)
        if entry and (section, entry[1]) in SPREAD:
            sigma = SPREAD[section, entry[1]]
            factor = 1.0 + sigma * float(np.clip(rng.standard_normal(), -2.0, 2.0))
            value = float(entry[2]) * factor
            if entry[1] == "gear_efficiency":
                value = min(value, 0.92)
            line = f"{entry[1]} = {{ value = {value!r}{entry[3]}"
        lines.append(line)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _sized(case: Case, toml: Path, folder: Path) -> tuple[VirtualRobot, Noise, dict[str, Any]]:
    """A robot whose hidden effects can be seen where the case asks for it, its noise and truth."""
    noise = Noise(**case.noise)
    plain = VirtualRobot(str(toml), seed=case.number)
    drive = plain.profile(case.design)
    without = plain.drive(drive, noise=QUIET).select(_training(drive))
    clean = without.truth["clean_power"]
    if not case.hidden:
        noisy = plain.drive(drive, noise=noise).select(_training(drive))
        return plain, noise, {"strengths": {}, **_noise_figures(noisy, noise)}
    view = View(without.columns, toml, folder, case)
    hidden: Settings = {}
    changes: dict[str, Array] = {}
    rho = {}
    for slug in case.hidden:
        hidden[slug], changes[slug] = _strength(case, slug, toml, drive, clean, view)
        rho[slug] = view.rho(changes[slug], noise, slug, hidden[slug])
    weakest = min(rho.values())
    if case.seek_rho and weakest < SMALLEST_RHO:
        lower = noise.level * weakest / (1.1 * SMALLEST_RHO)
        noise = replace(noise, level=min(noise.level, max(LOWEST_LEVEL, lower)))
    robot = VirtualRobot(str(toml), hidden=hidden, seed=case.number)
    log = robot.drive(drive, noise=noise).select(_training(drive))
    truth = {"strengths": hidden, **_noise_figures(log, noise)}
    truth |= view.figures(changes, noise, hidden)
    return robot, noise, truth


def _strength(
    case: Case, slug: str, toml: Path, drive: Profile, clean: Array, view: View
) -> tuple[dict[str, Any], Array]:
    """Settings of one effect, of the size asked for or larger, and the watts that it adds."""
    usual = VirtualRobot(str(toml), hidden={slug: case.hidden[slug]}).hidden[slug]
    size = usual.pop("size")
    noise = Noise(**case.noise)
    largest = _largest_scale(slug, usual)
    scale = min(1.0, largest)
    for _ in range(6):
        settings = scaled(usual, slug, scale)
        robot = VirtualRobot(str(toml), hidden={slug: settings}, seed=case.number)
        with_it = robot.drive(drive, noise=QUIET).select(_training(drive))
        change = with_it.truth["clean_power"] - clean
        reached = float(np.sqrt(np.mean(change**2)) / np.mean(clean))
        if reached == 0.0:  # the effect does nothing on this drive
            break
        factor = size / reached
        if case.seek_rho:
            needed = 1.15 * SMALLEST_RHO / max(view.rho(change, noise, slug, settings), 1e-6)
            factor = max(factor, min(needed, LARGEST_SIZE / reached))
        new = min(scale * factor, largest)
        if abs(new / scale - 1.0) < 0.08:
            break
        scale = new
    return settings, change


def _largest_scale(slug: str, settings: Mapping[str, Any]) -> float:
    """Factor on the settings at which the first of them is beyond what a robot has."""
    largest = LARGEST_SCALE.get(slug, math.inf)
    for name, value in settings.items():
        values = value.values() if isinstance(value, Mapping) else np.atleast_1d(value)
        reach = max((abs(float(v)) for v in values), default=0.0)
        if name in LARGEST_STRENGTH and reach > 0.0:
            largest = min(largest, LARGEST_STRENGTH[name] / reach)
    return largest


def _training(drive: Profile) -> list[str]:
    return [label for label in drive.labels if label not in drive.held_out]


def _noise_figures(log: VirtualLog, noise: Noise) -> dict[str, Any]:
    scatter = np.asarray(log.columns["power"]) - log.truth["clean_power"]
    return {
        "level": noise.level,
        "noise_w": float(np.sqrt(np.mean(scatter**2))),
        "mean_power_w": float(np.mean(log.truth["clean_power"])),
        "rows": len(scatter),
    }


class View:
    """What can be seen on a drive, from exact inputs.

    Args:
        columns: the quiet log of the robot without its effects.
        toml: the robot.
        folder: where a file may be written in passing.
        case: gives the columns that the log lacks and where power was measured.
    """

    def __init__(self, columns: Mapping[str, Any], toml: Path, folder: Path, case: Case) -> None:
        passing = folder / f"{toml.stem}-quiet.parquet"
        kept = {k: v for k, v in columns.items() if k not in case.sensors.get("absent", ())}
        VirtualLog(kept, {}).write_parquet(passing)
        log = Telemetry.read(passing)
        passing.unlink()
        self.power = log.power
        self.step = max(1, len(log) // ROWS_SEEN)
        effects = [slug for slug, effect in all_effects().items() if not effect.base]
        self.model = PowerModel.from_vehicle(
            load_vehicle(str(toml)), effects=effects, surfaces=log.surfaces
        ).without_candidates()
        self.rows = log.rows_for(self.model.surfaces)[:: self.step]
        self.tangent, self.columns = _derivatives(self.model, self.rows)
        if not case.power_at_source:
            self.columns.pop("battery_sag", None)

    def _white(self, noise: Noise) -> Array:
        usual = float(np.mean(np.abs(self.power)))
        spread = max(noise.level, 1e-6) * np.maximum(np.abs(self.power), noise.floor * usual)
        return spread[:: self.step]

    def _own(self, slug: str, settings: Mapping[str, Any]) -> Array:
        """Columns that the catalogue's effect has, with its change at the true strength."""
        model = _with_settings(self.model, slug, settings)
        secant = np.nan_to_num(model.watts(self.rows) - self.model.watts(self.rows))
        return np.column_stack([secant, *self.columns[slug]])

    def rho(
        self,
        change: Array,
        noise: Noise,
        slug: str,
        settings: Mapping[str, Any],
        others: Sequence[Array] = (),
    ) -> float:
        """Rms of a change after projection over the rms of the noise, as far as it has the shape
        that the catalogue gives the effect.
        """
        spread = self._white(noise)
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
        spread = self._white(noise)
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


def _with_settings(model: PowerModel, slug: str, settings: Mapping[str, Any]) -> PowerModel:
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
    before = model.watts(rows)
    made = []
    for place in places:
        parameter, value = model.slots[place][2], float(model.parameters[place])
        step = 1e-3 * max(abs(parameter.default), 1e-3)
        if value + step > parameter.bounds[1]:
            step = -step
        made.append((model.with_parameter(place, value + step).watts(rows) - before) / step)
    return np.column_stack(made)


@cache
def _sources() -> str:
    """Changes whenever the virtual robot does, so that logs are then made anew."""
    folder = Path(str(virtual.__file__)).parent
    digest = hashlib.sha256(EDITION.encode())
    for path in [*sorted(folder.glob("*.py")), folder.parent / "virtual_robot.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()
