"""Drives what a diagnosis recommends to tell effects apart, with the same robot, and asks again.

    recommended_drive(settings) -> Profile
    drive_again(case, made, experiment) -> Path of the first log and the second drive together
    tie_broken(case, made, found, diagnose) -> what was recommended and whether it parted the tie

``settings`` is what an experiment says in numbers (planner.telemetry.diagnosis.advice.drives). The
robot drives the same commands that `joulepath experiment` writes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.telemetry.diagnosis.advice.drives import poses_of, sampled, tilt_of
from planner.telemetry.virtual import Noise, Profile, VirtualLog, VirtualRobot
from tests.hidden_effects.cases import Case
from tests.hidden_effects.logs import VEHICLE, Made
from tests.hidden_effects.scoring import aliases_of

Array = NDArray[np.float64]

SAMPLING = 20.0  # Hz of the robot's sensors
AIR = 22.0  # °C


def recommended_drive(settings: Mapping[str, Any], odometer: float = 0.0) -> Profile:
    """The profile of an experiment's settings."""
    runs = settings["runs"]
    driven = sampled(settings, Profile.BIN)
    yaw = poses_of(driven)[:, 2]
    row = round(Profile.ROW / Profile.BIN)
    bins = math.ceil(len(driven) / row) * row
    motion = np.zeros((len(runs), bins + 1, len(Profile.MOTION)))
    # The robot stands at its end until a row is full.
    motion[:, : len(driven), :3] = driven[:, 1:]
    roll, pitch = tilt_of(settings, np.append(yaw, np.full(bins + 1 - len(yaw), yaw[-1])))
    motion[:, :, 3], motion[:, :, 4] = roll, pitch
    labels = [f"again{k}" for k in range(len(runs))]
    drive = Profile.plain("recommended", motion, labels)
    conditions, starts = drive.conditions, drive.starts
    conditions[:, :, 3] = SAMPLING
    starts[:, 3], starts[:, 7] = AIR, odometer
    for k, run in enumerate(runs):
        starts[k, 0] = run.get("payload") or 0.0
        if run.get("motor_temp") is not None:
            conditions[k, :, 5] = run["motor_temp"]
    return drive


def drive_again(case: Case, made: Made, experiment: Mapping[str, Any]) -> Path:
    """Writes the case's log together with the recommended drive, under names of their own."""
    import pyarrow
    import pyarrow.parquet

    robot = VirtualRobot(str(made.robot), hidden=made.truth["strengths"], seed=case.number)
    first = pyarrow.parquet.read_table(made.log)
    far = float(robot.profile(case.design).starts[:, 7].max())
    drive = recommended_drive(experiment["settings"], far)
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
