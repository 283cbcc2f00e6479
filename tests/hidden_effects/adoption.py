"""What adopting a diagnosis is worth: error on runs that nobody fitted, and honest intervals.

    figures = after_adopting(case, made, diagnosis)
    figures["heldout"]     {"before_w", "after_w", "oracle_w", "noise_w"}, on the held-out runs
    figures["intervals"]   one entry for each parameter of the hidden effect

The oracle is the same fit, told which effect is missing. For an effect outside the catalogue it is
the base model, fitted and tested on logs from which the effect's true watts were taken away.

A parameter's interval is compared with the strength that the robot was given, and with what the
same fit finds on the same drive without noise: the robot differs from the power model on purpose
(docs/virtual-robot.md), so that for some effects the two are not the same number.

One number is converted. No log of the benchmark has a column of slope_rate: it is taken from the
slopes of neighbouring rows, which blunts whatever changes within half a second. The strength that
belongs to this blunted rate is the robot's times the regression of the one rate on the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.adoption import adopt
from planner.telemetry.diagnosis import Diagnosis
from planner.telemetry.estimation import fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.starting_model import starting_model
from planner.telemetry.virtual import QUIET, VirtualLog, VirtualRobot
from tests.hidden_effects.cases import Case
from tests.hidden_effects.logs import VEHICLE, Made

Array = NDArray[np.float64]

COVERED = 1.96  # standard errors


def after_adopting(case: Case, made: Made, diagnosis: Diagnosis) -> dict[str, Any]:
    """Held-out errors and intervals of one case with something hidden."""
    later = Telemetry.read(made.held_out, made.mapping)
    clean = _drives(case, made, made.truth["strengths"])
    heldout = {
        "before_w": rmse(diagnosis.base, later),
        "after_w": rmse(diagnosis.model, later),
        "noise_w": _rms(later.power - clean[1].truth["clean_power"]),
    }
    model: PowerModel | None = diagnosis.model
    if case.outside:
        heldout["oracle_w"] = _without_effect(case, made, clean, later)
        model = None
    elif set(diagnosis.selected) == set(case.truth):
        heldout["oracle_w"] = heldout["after_w"]
    else:
        model = adopt(list(case.truth), made.log, VEHICLE, mapping=made.mapping).model
        heldout["oracle_w"] = rmse(model, later)
    found: dict[str, Any] = {"heldout": heldout}
    if model is not None:
        noiseless = _quiet_fit(clean[0], made, model)
        strengths = as_logged(case, made)
        found["intervals"] = [
            entry
            for slug in case.truth
            for entry in intervals(model, noiseless, slug, strengths[slug])
        ]
    return found


def as_logged(case: Case, made: Made) -> dict[str, Any]:
    """The robot's strengths in terms of the quantities that its log has."""
    strengths = dict(made.truth["strengths"])
    if "slope_transition" in strengths:
        drive = VirtualRobot(str(made.robot), seed=case.number).profile(case.design)
        each = round(drive.row / drive.BIN)
        training = [k for k, label in enumerate(drive.labels) if label not in drive.held_out]
        bins = drive.conditions[training, :, drive.CONDITIONS.index("slope_rate")]
        rows = bins.shape[1] // each
        true = bins[:, : rows * each].reshape(len(training) * rows, each).mean(axis=1)
        clean = _read(_drives(case, made, made.truth["strengths"])[0], made)
        speed = np.hypot(clean.rows[:, INDEX["vx"]], clean.rows[:, INDEX["vy"]])
        logged = clean.rows[:, INDEX["slope_rate"]] * speed
        drag = float(strengths["slope_transition"]["transition_drag"])
        drag *= float((true * speed) @ logged / (logged @ logged))
        strengths["slope_transition"] = {"transition_drag": drag}
    return strengths


def rmse(model: PowerModel, log: Telemetry) -> float:
    """W, of a model on a log."""
    return _rms(log.power - predict(model, log))


def intervals(
    model: PowerModel, noiseless: PowerModel, slug: str, strengths: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Estimate, standard error, truth and noiseless estimate of an effect's fitted parameters."""
    if model.stderr is None:
        return []
    entries = []
    for place, (effect, name, parameter, element) in enumerate(model.slots):
        stderr = float(model.stderr[place])
        if effect.slug != slug or parameter.null is None or not parameter.fitted:
            continue
        if not np.isfinite(stderr) or stderr == 0.0:
            continue
        value = float(model.parameters[place])
        entries.append(
            {
                "parameter": f"{slug}.{name}" + (f".{element}" if parameter.per else ""),
                "value": value,
                "stderr": stderr,
                "truth": _true(model, place, strengths),
                "noiseless": float(noiseless.parameters[place]),
                "at_bound": value in parameter.bounds,
            }
        )
    return entries


def covers(entry: Mapping[str, Any], of: str) -> bool:
    """Whether the 95 % interval of an entry holds its ``truth`` or its ``noiseless`` value."""
    return bool(abs(entry["value"] - entry[of]) <= COVERED * entry["stderr"])


def _true(model: PowerModel, place: int, strengths: Mapping[str, Any]) -> float:
    """The robot's strength in the terms of the fit: grounds against the one that the fit keeps at
    its null value, wheels against their mean.
    """
    effect, name, parameter, element = model.slots[place]
    mine = [p for p, slot in enumerate(model.slots) if slot[0] is effect and slot[1] == name]
    values = model.parameters[mine]
    if parameter.per == "surface":
        true = [float(strengths[name].get(label, 0.0)) for label in model.surfaces]
        kept = int(np.argmin(np.abs(values)))
        return (1.0 + true[element]) / (1.0 + true[kept]) - 1.0
    if parameter.per == "wheel":
        return float(strengths[name][element]) - float(np.mean(strengths[name]))
    if name.endswith("_squared") and name not in strengths:
        return float(strengths[name.removesuffix("_squared")] ** 2)
    return float(strengths[name])


def _drives(case: Case, made: Made, strengths: Mapping[str, Any]) -> tuple[VirtualLog, VirtualLog]:
    """Training and held-out rows of the case's drive without noise."""
    robot = VirtualRobot(str(made.robot), hidden=strengths, seed=case.number)
    return robot.drive(case.design, noise=QUIET, sensors=case.sensors).split()


def _without_effect(
    case: Case, made: Made, clean: tuple[VirtualLog, VirtualLog], later: Telemetry
) -> float:
    plain = _drives(case, made, {})
    pairs = zip(clean, plain, strict=True)
    change = [a.truth["clean_power"] - b.truth["clean_power"] for a, b in pairs]
    training = Telemetry.read(made.log, made.mapping)
    training = replace(training, power=training.power - change[0])
    base = fit(training, starting_model(VEHICLE)).model
    return rmse(base, replace(later, power=later.power - change[1]))


def _quiet_fit(clean: VirtualLog, made: Made, model: PowerModel) -> PowerModel:
    return fit(_read(clean, made), model).model


def _read(clean: VirtualLog, made: Made) -> Telemetry:
    passing = Path(made.log).with_name(f"{made.log.stem}-quiet.parquet")
    clean.write_parquet(passing)
    log = Telemetry.read(passing, made.mapping)
    passing.unlink()
    return log


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
