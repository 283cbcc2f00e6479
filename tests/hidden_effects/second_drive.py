"""Drives what a diagnosis recommends to tell effects apart, with the same robot, and asks again.

    recommended_drive(settings, vehicle) -> Profile
    drive_again(case, made, experiment) -> Path of the first log and the second drive together
    tie_broken(case, made, found, diagnose) -> what was recommended and whether it parted the tie

``settings`` is what an experiment says in numbers: runs with payload and motor temperature, each of
segments with velocity, slope as roll and pitch, acceleration along the motion, and seconds. Between
segments the robot changes its motion along smooth ramps of 1.5 s. A segment with an acceleration
goes up and down between rest and twice its speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.vehicles import Vehicle
from planner.telemetry.virtual import Noise, Profile, VirtualLog, VirtualRobot
from tests.hidden_effects.cases import Case
from tests.hidden_effects.logs import VEHICLE, Made
from tests.hidden_effects.scoring import aliases_of

Array = NDArray[np.float64]

RAMP = 1.5  # s
SAMPLING = 20.0  # Hz of the robot's sensors
AIR = 22.0  # °C


def recommended_drive(
    settings: Mapping[str, Any], vehicle: Vehicle, odometer: float = 0.0
) -> Profile:
    """The profile of an experiment's settings; shorter runs stand still at their end."""
    runs = settings["runs"]
    rows = [
        math.ceil(sum(s["seconds"] + RAMP for s in run["segments"]) / Profile.ROW) for run in runs
    ]
    bins = (max(rows) + 2) * round(Profile.ROW / Profile.BIN)
    motion = np.zeros((len(runs), bins + 1, len(Profile.MOTION)))
    labels = [f"again{k}" for k in range(len(runs))]
    drive = Profile.plain("recommended", motion, labels)
    conditions, starts = drive.conditions, drive.starts
    conditions[:, :, 3] = SAMPLING
    starts[:, 3], starts[:, 7] = AIR, odometer
    for k, run in enumerate(runs):
        motion[k] = _motion(run["segments"], bins, vehicle)
        tilt = np.arccos(np.cos(motion[k, :, 3]) * np.cos(motion[k, :, 4]))
        conditions[k, :, 0] = np.abs(np.diff(tilt)) / Profile.BIN
        starts[k, 0] = run.get("payload") or 0.0
        if run.get("motor_temp") is not None:
            conditions[k, :, 5] = run["motor_temp"]
    return drive


def _motion(segments: list[dict[str, float]], bins: int, vehicle: Vehicle) -> Array:
    edges = np.arange(bins + 1) * Profile.BIN
    curve = np.zeros((bins + 1, len(Profile.MOTION)))
    before = np.zeros(len(Profile.MOTION))
    clock = 0.0
    for segment in [*segments, {"seconds": math.inf}]:
        target = np.array([segment.get(name, 0.0) for name in Profile.MOTION])
        here = edges >= clock
        ways = np.clip((edges[here] - clock) / RAMP, 0.0, 1.0)
        share = 0.5 * (1.0 - np.cos(math.pi * ways))[:, None]
        curve[here] = before + (target - before) * share
        change = abs(segment.get("acceleration", 0.0))
        speed = math.hypot(target[0], target[1])
        if change > 0.0 and speed > 0.0:
            # A triangle of this slope between rest and twice the speed, in phase with the ramp.
            top = min(2.0 * speed, vehicle.limits.speed)
            since = np.maximum(edges[here] - clock - RAMP, 0.0) * change / top
            wave = np.abs((since + 0.5) % 2.0 - 1.0) * 2.0  # 1 at first, then 0 … 2
            curve[here, :2] *= np.where(ways < 1.0, 1.0, wave * top / (2.0 * speed))[:, None]
        before = target
        clock += segment["seconds"] + RAMP
    return curve


def drive_again(case: Case, made: Made, experiment: Mapping[str, Any]) -> Path:
    """Writes the case's log together with the recommended drive, under names of their own."""
    import pyarrow
    import pyarrow.parquet

    robot = VirtualRobot(str(made.robot), hidden=made.truth["strengths"], seed=case.number)
    first = pyarrow.parquet.read_table(made.log)
    far = float(robot.profile(case.design).starts[:, 7].max())
    drive = recommended_drive(experiment["settings"], robot.vehicle, far)
    noise = Noise(**{**case.noise, "level": made.truth["level"]})
    second = robot.drive(drive, noise=noise, sensors=case.sensors, seed=case.number + 1)
    path = made.log.with_name(f"{made.log.stem}-again.parquet")
    columns = {name: second.columns[name] for name in first.column_names}
    VirtualLog(columns, {}).write_parquet(path)
    table = pyarrow.parquet.read_table(path)
    pyarrow.parquet.write_table(pyarrow.concat_tables([first, table.cast(first.schema)]), path)
    return path


def tie_broken(
    case: Case, made: Made, found: Mapping[str, Any], diagnose: Callable[..., Any]
) -> dict[str, Any] | None:
    """Follow the recommendation that concerns the truth; None where there is none to drive.

    Where no motion would part two effects the advice is to log or to measure something, without
    settings of a run.

    The tie is broken when the second diagnosis selects every hidden effect, nothing else, and no
    longer counts one of the rivals among what it cannot be told from.
    """
    truth = set(case.truth)
    for experiment in found.get("experiments") or ():
        separates = set(experiment["separates"])
        if not truth & separates or not separates - truth or not experiment["settings"]:
            continue
        path = drive_again(case, made, experiment)
        answer = diagnose(path, VEHICLE, mapping=made.mapping)
        path.unlink()
        again = answer if isinstance(answer, dict) else answer.to_json()
        aliases = aliases_of(again)
        left = {rival for member in again["selected"] for rival in aliases.get(member, ())}
        return {
            "separates": sorted(separates),
            "run": experiment["run"],
            "broken": set(again["selected"]) == truth and not left & separates,
            "verdict": again["verdict"],
            "selected": again["selected"],
            "ties": {member: sorted(aliases.get(member, ())) for member in again["selected"]},
        }
    return None
