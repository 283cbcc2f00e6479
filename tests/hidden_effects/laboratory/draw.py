"""Draws a log of a robot, its drive and its instruments, and what is hidden in it.

    log = draw("one", "air_drag", seed=3, split="tuning")
    log.write(folder)                          # log.path, log.sheet: what a diagnosis gets
    log.truth                                  # what is hidden, what the instruments do

Kinds: "none" hides nothing, "one" an effect of the catalogue, "several" two or three joined by "+",
"outside" one of MECHANISMS. The splits "tuning", "validation" and "final" never share a draw: the
number of every draw is its seed plus the first number of its split. What is tuned is tuned on the
first, what is calibrated on the second; the third is for the reported table alone.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.power.catalogue import find_effect
from planner.telemetry.virtual import Profile, VirtualRobot
from planner.telemetry.virtual.dynamics import MEANS, by_name
from planner.telemetry.virtual.hidden import EFFECTS, check_settings, largest_scale, scaled
from tests.hidden_effects.cases import number_of, settings_of
from tests.hidden_effects.laboratory.drives import Conditions, drawn_drive
from tests.hidden_effects.laboratory.instruments import Columns, Instruments
from tests.hidden_effects.laboratory.mechanisms import MECHANISMS, drawn_numbers
from tests.hidden_effects.laboratory.robots import data_sheet, drawn_robot, write_vehicle

KINDS = ("none", "one", "several", "outside")
SEEDS_IN_SPLIT = 1_000_000
SPLITS = {name: k * SEEDS_IN_SPLIT for k, name in enumerate(("tuning", "validation", "final"))}
SMALLEST, LARGEST = 0.02, 0.12
"""Size of an effect: rms of its watts over mean power, drawn evenly in its logarithm."""
NOTHING = 0.002
"""Size below which an effect is not there: the drive never calls it up."""
FEW_RUNS = 3
"""Runs on which sizes are found."""

# What an effect needs of a drive, and of the log's columns, to show at all.
NEEDS: dict[str, tuple[str, ...]] = {
    "motor_heating": ("temperature",),
    "cold_grease": ("temperature",),
    "load_dependent_rolling": ("payload",),
    "sinkage": ("payload",),
    "com_offset": ("payload", "slopes"),
    "wear": ("payload",),
    "surface_rolling": ("surface",),
    "sensor_rate": ("sensor_rate",),
    "slope_transition": ("slopes",),
    "regeneration_limit": ("slopes",),
    "battery_sag": ("slopes",),
    "wheel_slip": ("slopes",),
    "gear_asymmetry": ("slopes",),
    "air_drag": ("wind",),
}
COLUMNS: dict[str, tuple[str, ...]] = {
    "motor_heating": ("motor_temp", "ambient_temp"),
    "cold_grease": ("motor_temp", "ambient_temp"),
    "com_offset": ("com_x", "com_y"),
    "sensor_rate": ("sensor_rate",),
    "battery_sag": ("battery_voltage", "battery_current"),
}


@dataclass(frozen=True)
class Truth:
    """What a log was made of.

    Attributes:
        hidden: slug → strengths, with the catalogue's names.
        outside: mechanism, or "".
        sizes: slug or mechanism → rms of its watts over mean power, on the whole log.
        conditions, instruments: of the drive and the log.
        clean_power: (rows,) W that the meter would have shown without noise.
        outside_power: (rows,) W of it that the mechanism adds.
    """

    hidden: dict[str, dict[str, Any]]
    outside: str
    sizes: dict[str, float]
    conditions: Conditions
    instruments: Instruments
    clean_power: Array
    outside_power: Array

    @property
    def there(self) -> frozenset[str]:
        """Hidden effects of the catalogue that the drive calls up."""
        return frozenset(slug for slug in self.hidden if self.sizes[slug] >= NOTHING)

    def summary(self) -> dict[str, Any]:
        """Everything but the rows, for JSON."""
        told = {name: getattr(self, name) for name in ("hidden", "outside", "sizes")}
        conditions, instruments = asdict(self.conditions), asdict(self.instruments)
        conditions["lengths"] = [round(length, 1) for length in self.conditions.lengths]
        instruments["columns"] = sorted(self.instruments.columns)
        instruments["wrong_sensors"] = sorted(self.instruments.wrong_sensors)
        return {**told, "conditions": conditions, "instruments": instruments}


@dataclass(frozen=True)
class Log:
    """A drawn log.

    Attributes:
        kind, effect, seed, split: what was asked for.
        columns: of the log; ``second`` of another drive of the same robot.
        truth: of the log.
        folder: where its files are.
    """

    kind: str
    effect: str
    seed: int
    split: str
    folder: Path
    columns: Columns
    truth: Truth
    second: Columns = field(default_factory=dict)

    @property
    def name(self) -> str:
        """kind/effect/split/seed."""
        return f"{self.kind}/{self.effect or 'nothing'}/{self.split}/{self.seed}"

    @property
    def sheet(self) -> Path:
        """TOML of the vehicle as its data sheet has it, which a diagnosis gets."""
        return self.folder / "sheet.toml"

    @property
    def robot(self) -> Path:
        """TOML of the robot that drove; a diagnosis does not get it."""
        return self.folder / "robot.toml"

    @cached_property
    def path(self) -> Path:
        """The log as a file."""
        return _written(self.columns, self.folder / "log.parquet")

    @cached_property
    def second_path(self) -> Path:
        """The log of another drive as a file."""
        return _written(self.second, self.folder / "second.parquet")

    @property
    def mapping(self) -> Path | None:
        """Mapping file that says where power was measured; None for the terminals."""
        if "battery_sag" not in self.truth.hidden:
            return None
        path = self.folder / "mapping.toml"
        path.write_text('power_at = "source"\n', encoding="utf-8")
        return path


def draw(
    kind: str,
    effect: str,
    seed: int,
    split: str,
    folder: Path,
    *,
    second: bool = False,
    **given: Any,
) -> Log:
    """A log.

    Args:
        kind: of KINDS.
        effect: slugs joined by "+", or a mechanism; "" for none.
        seed: below SEEDS_IN_SPLIT.
        split: of SPLITS.
        folder: for the vehicles' files and the log's.
        second: another drive of the same robot, too.
        given: fields of Instruments, in the place of what is drawn: one thing changed.

    Raises:
        ValueError: a kind, effect, seed or split that there is not.
    """
    if kind not in KINDS or not 0 <= seed < SEEDS_IN_SPLIT or split not in SPLITS:
        raise ValueError(f"{kind} {seed} {split}: not of {KINDS}, {SEEDS_IN_SPLIT}, {[*SPLITS]}")
    slugs = [name for name in effect.split("+") if name]
    rng = np.random.default_rng([SPLITS[split] + seed, number_of(f"{kind}/{effect}")])
    own = folder / f"{split}-{kind}-{effect or 'nothing'}-{seed}"
    own.mkdir(parents=True, exist_ok=True)
    table = drawn_robot(rng)
    write_vehicle(own / "robot.toml", table)
    # Every other data sheet says how sure it is.
    write_vehicle(own / "sheet.toml", data_sheet(rng, table), uncertain=seed % 2 == 1)
    needs, wanted = _needs(slugs)
    conditions = Conditions.drawn(rng, needs)
    instruments = Instruments.drawn(rng, 1.0 / conditions.rate, _columns(rng, conditions, wanted))
    instruments = replace(instruments, **given)
    robot = VirtualRobot(str(own / "robot.toml"), seed=seed)
    drive = drawn_drive(rng, robot.vehicle, conditions)
    hidden = {}
    if kind != "outside":
        for slug in slugs:
            hidden[slug] = _settings(rng, slug, robot, drive)
    if hidden.get("com_offset", {}).get("gain") == 0.0:
        # An offset that nobody knows of cannot have been measured.
        known = instruments.columns - {"com_x", "com_y"}
        instruments = replace(instruments, columns=known)
    outside = slugs[0] if kind == "outside" else ""
    mechanism = _Outside(outside, rng)
    columns, truth = _driven(rng, robot, drive, hidden, mechanism, conditions, instruments)
    later: Columns = {}
    if second:
        again = drawn_drive(rng, robot.vehicle, conditions)
        later, _ = _driven(rng, robot, again, hidden, mechanism, conditions, instruments)
    return Log(kind, effect, seed, split, own, columns, truth, later)


def _needs(slugs: list[str]) -> tuple[frozenset[str], list[str]]:
    """What these effects need of the drive, and which columns of the log."""
    needs: set[str] = set()
    columns: list[str] = []
    for slug in slugs:
        mechanism = MECHANISMS.get(slug)
        needs |= set(mechanism.needs if mechanism else NEEDS.get(slug, ()))
        columns += mechanism.columns if mechanism else COLUMNS.get(slug, ())
    return frozenset(needs), columns


def _columns(rng: np.random.Generator, how: Conditions, wanted: list[str]) -> frozenset[str]:
    """Optional columns of the log; what varies and acts on any robot is never left out."""
    groups = {
        ("ax", "ay"): 0.5,
        ("roll", "pitch"): 1.0 if how.floor != "flat" else 0.4,
        ("payload",): 1.0 if len(how.payloads) > 1 else 0.3,
        ("com_x", "com_y"): 0.25,
        ("motor_temp",): 0.5,
        ("ambient_temp",): 0.5,
        ("battery_voltage", "battery_current"): 0.4,
        ("surface",): 1.0 if how.surfaces > 1 else 0.2,
        ("wind_x", "wind_y"): 1.0 if how.windy else 0.0,
        ("sensor_rate",): 1.0 if how.sampling else 0.0,
        tuple(f"wheel_current_{k}" for k in range(1, 5)): 0.15,
    }
    chosen: list[str] = []
    for names, usually in groups.items():
        needed = any(name in wanted for name in names) and not (
            "sensor_rate" in names and not how.sampling
        )
        if rng.random() < max(usually, 0.85 * needed):
            chosen += names
    return frozenset(chosen)


def _settings(
    rng: np.random.Generator, slug: str, robot: VirtualRobot, drive: Profile
) -> dict[str, Any]:
    """Strengths of an effect with a random size, as far as a robot can have it."""
    given = settings_of(slug, rng)
    given["size"] = math.exp(rng.uniform(math.log(SMALLEST), math.log(LARGEST)))
    if slug == "wheel_imbalance":
        excess = rng.uniform(-0.5, 0.5, robot.wheels)
        # About their mean, as the robot has it: no wheel may push.
        given["excess"] = [float(e) for e in excess - excess.mean()]
    settings = check_settings({slug: given}, robot.vehicle.parameters, robot.wheels)[slug]
    size = settings.pop("size")
    step = max(1, len(drive.labels) // FEW_RUNS)
    part = drive.runs(range(0, len(drive.labels), step)[:FEW_RUNS])
    power = MEANS.index("power")
    before = robot.simulate(part, {})[0][:, :, power]
    most = min(largest_scale(slug), _reach(slug, settings))
    scale = min(1.0, most)
    for _ in range(2):
        change = (
            robot.simulate(part, {slug: scaled(settings, slug, scale)})[0][:, :, power] - before
        )
        reached = float(np.sqrt(np.mean(change**2)) / abs(np.mean(before)))
        if reached < 1e-9:
            break
        scale = min(scale * size / reached, most)
    return scaled(settings, slug, scale)


def _reach(slug: str, settings: Mapping[str, Any]) -> float:
    """Multiple of these strengths at which the first leaves its physical range."""
    reach = np.inf
    known = find_effect(slug).parameters
    for name, strength in EFFECTS[slug].items():
        if not strength.scaled or name not in known or name == "efficiency":
            continue
        value = settings[name]
        values = value.values() if isinstance(value, Mapping) else np.atleast_1d(value)
        for one in values:
            away = float(one) - strength.null
            end = known[name].bounds[1 if away > 0.0 else 0]
            if away != 0.0:
                reach = min(reach, 0.95 * (end - strength.null) / away)
    return float(reach)


LEAST_WORK = 1e-6
"""Of a mechanism's own unit; less is rounding of a drive in which it does not work."""


class _Outside:
    """A mechanism with its numbers, and the factor that gives it its size."""

    def __init__(self, name: str, rng: np.random.Generator) -> None:
        self.name = name
        self.mechanism = MECHANISMS[name] if name else None
        self.numbers = drawn_numbers(rng)
        self.size = math.exp(rng.uniform(math.log(SMALLEST), math.log(LARGEST)))
        self.factor = 0.0

    def watts(self, robot: VirtualRobot, drive: Profile, means: Array, driven: Array) -> Array:
        """(runs, bins) W; the first drive in which it works decides the factor."""
        power = means[:, :, MEANS.index("power")]
        if self.mechanism is None:
            return np.zeros_like(power)
        states = states_of(robot, drive, means, driven)
        raw = np.stack([self.mechanism.watts(self.numbers, state) for state in states])
        if self.factor == 0.0:
            rms = float(np.sqrt(np.mean(raw[driven] ** 2)))
            if rms > LEAST_WORK:
                self.factor = self.size * abs(float(np.mean(power[driven]))) / rms
        return self.factor * raw


def states_of(
    robot: VirtualRobot, drive: Profile, means: Array, driven: NDArray[np.bool_]
) -> list[dict[str, Array]]:
    """What mechanisms depend on, one dictionary a run."""
    table = by_name(means, drive.conditions, drive.starts)
    states = []
    limits = robot.vehicle.limits
    for k in range(len(drive.labels)):
        state = {name: values[k] for name, values in table.items()}
        speed = np.hypot(state["vx"], state["vy"])
        x, y = state["vx"] / np.maximum(speed, 0.02), state["vy"] / np.maximum(speed, 0.02)
        # Heights gained per metre forward and to the left.
        ahead, left = -np.sin(state["pitch"]), np.cos(state["pitch"]) * np.sin(state["roll"])
        state |= {
            "speed": speed,
            "heading": np.arctan2(state["vy"], state["vx"]),
            "slope_along": np.arcsin(ahead * x + left * y),
            "slope_across": np.arcsin(left * x - ahead * y),
            "acceleration": state["ax"] * x + state["ay"] * y,
            "time": (np.arange(len(speed)) + 0.5) * drive.bin_length,
            "top": np.float64(0.7 * limits.speed),
            "turning": np.float64(limits.yaw_rate),
            "heaviest": np.float64(drive.starts[:, 0].max()),
            "longest": np.float64(driven.sum(axis=1).max() * drive.bin_length),
            "temperature range": np.percentile(table["motor_temp"][driven], [5, 95]),
            "ambient range": np.percentile(table["ambient"][driven], [5, 95]),
        }
        states.append(state)
    return states


def _driven(
    rng: np.random.Generator,
    robot: VirtualRobot,
    drive: Profile,
    hidden: dict[str, dict[str, Any]],
    outside: _Outside,
    conditions: Conditions,
    instruments: Instruments,
) -> tuple[Columns, Truth]:
    lengths = conditions.lengths
    bins = drive.motion.shape[1] - 1
    ends = np.array([int(length / drive.bin_length) for length in lengths])
    driven = np.arange(bins)[None, :] < ends[:, None]
    means, _ = robot.simulate(drive, hidden)
    watts = outside.watts(robot, drive, means, driven)
    added = means.copy()
    added[:, :, MEANS.index("power")] = watts
    _, added_power = instruments.measure(copy.deepcopy(rng), drive, added, lengths)
    power, sizes = means[:, :, MEANS.index("power")], {}
    usual = abs(float(np.mean(power[driven])))
    if outside.mechanism is not None:
        power += watts
        sizes[outside.name] = float(np.sqrt(np.mean(watts[driven] ** 2))) / usual
    for slug in hidden:
        others = {other: hidden[other] for other in hidden if other != slug}
        without = robot.simulate(drive, others)[0][:, :, MEANS.index("power")]
        sizes[slug] = float(np.sqrt(np.mean((power - without)[driven] ** 2))) / usual
    columns, clean = instruments.measure(rng, drive, means, lengths)
    truth = Truth(hidden, outside.name, sizes, conditions, instruments, clean, added_power)
    return columns, truth


def _written(columns: Columns, path: Path) -> Path:
    import pyarrow
    import pyarrow.parquet

    arrays = {name: pyarrow.array(values.tolist()) for name, values in columns.items()}
    pyarrow.parquet.write_table(pyarrow.table(arrays), str(path))
    return path
