"""Makes the log of a case, and says how visible its effects are, apart from any diagnosis.

    made = make(case, folder)     # made.log goes to the diagnosis, and nothing else does

The robot is not the vehicle of the diagnosis: its rolling, rollers, gear, motors, inertia and
electronics differ from the vehicle's file by 5 to 15 %, which the base model's fit has to find.
Names of the files say nothing about what is hidden.

How visible each effect is says tests.hidden_effects.visibility; sizes are raised and noise lowered
until the effects of a case can be seen, as far as they can.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.vehicles.vehicle_file import VEHICLE_FOLDER
from planner.telemetry import virtual
from planner.telemetry.virtual import QUIET, Noise, Profile, VirtualLog, VirtualRobot
from planner.telemetry.virtual.hidden import largest_scale, scaled
from tests.hidden_effects.cases import SMALLEST_RHO, Case, Settings
from tests.hidden_effects.visibility import View

Array = NDArray[np.float64]

VEHICLE = "minibalance"
EDITION = "2"  # to be raised where a change of this file changes logs
LARGEST_SIZE = 0.15
LOWEST_LEVEL = 0.01
# Beyond these strengths an effect is none that a robot of this kind has.
LARGEST_STRENGTH = {
    "creep": 0.3, "gain": 2.0, "offset_x": 0.06, "offset_y": 0.06, "excess": 1.0, "strength": 3.0,
    "transition_drag": 60.0, "ripple_squared": 1.0, "preload_squared": 100.0, "drag_torque": 0.15,
    "internal_resistance": 0.6, "diode_voltage": 1.5, "scrub_moment": 5.0, "exponent": 1.0,
    "shaking_force": 3.0, "copper_coefficient": 0.01,
}  # fmt: skip
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
        truth: strengths, noise and the figures of visibility.
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
    training = _training(drive)
    without = plain.drive(drive, noise=QUIET).select(training)
    clean = without.truth["clean_power"]
    if not case.hidden:
        noisy = plain.drive(drive, noise=noise).select(training)
        return plain, noise, {"strengths": {}, **_noise_figures(noisy, noise)}
    inputs = Noise(level=0.0, channels=noise.channels)
    view = View(without, plain.drive(drive, noise=inputs).select(training), toml, folder, case)
    hidden: Settings = {}
    changes: dict[str, Array] = {}
    rho = {}
    for slug in case.hidden:
        hidden[slug], changes[slug] = _strength(case, slug, toml, drive, clean, view)
        rho[slug] = view.rho(changes[slug], noise, slug, hidden[slug])
    weakest = min(rho.values())
    if case.seek_rho and weakest < SMALLEST_RHO:
        # Scatter that would do; what is not noise stays.
        spread = float(np.sqrt(np.mean(view.noise_spread(noise) ** 2)))
        enough = math.hypot(spread, view.misfit) * weakest / (1.1 * SMALLEST_RHO)
        lower = noise.level * math.sqrt(max(enough**2 - view.misfit**2, 0.0)) / spread
        noise = replace(noise, level=min(noise.level, max(LOWEST_LEVEL, lower)))
    robot = VirtualRobot(str(toml), hidden=hidden, seed=case.number)
    log = robot.drive(drive, noise=noise).select(training)
    truth = {"strengths": hidden, **_noise_figures(log, noise), "misfit_w": view.misfit}
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
    largest = largest_scale(slug)
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


@cache
def _sources() -> str:
    """Changes whenever the virtual robot does, so that logs are then made anew."""
    folder = Path(str(virtual.__file__)).parent
    digest = hashlib.sha256(EDITION.encode())
    for path in [*sorted(folder.glob("*.py")), *folder.parent.glob("virtual_robot.py")]:
        digest.update(path.read_bytes())
    return digest.hexdigest()
