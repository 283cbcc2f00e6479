"""Diagnoses a drawn log and measures the answer, as one row of the benchmark.

row = examine("one", "air_drag", seed=3, split="tuning", folder=folder)
"""

from __future__ import annotations

import time
import traceback
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.power.model import PowerModel
from planner.telemetry.as_measured import as_measured
from planner.telemetry.diagnosis import Diagnosis, diagnose
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import open_source
from planner.telemetry.starting_model import starting_model
from planner.telemetry.tilt_filter import with_true_tilt
from tests.hidden_effects.baselines import METHODS, as_diagnosis, prepare
from tests.hidden_effects.laboratory.draw import Log, draw
from tests.hidden_effects.laboratory.oracle import Oracle, carried, through_meter
from tests.hidden_effects.laboratory.outcomes import outcome
from tests.hidden_effects.scoring import aliases_of, sensors_of

Row = dict[str, Any]
INTERVAL_Z = 1.96


def examine(
    kind: str,
    effect: str,
    seed: int,
    split: str,
    folder: Path,
    *,
    methods: Sequence[str] = (),
    **given: Any,
) -> Row:
    """Draw, diagnose, measure.

    Args:
        kind, effect, seed, split, folder, given: as for ``draw``.
        methods: others that are run on the same log, see tests.hidden_effects.baselines.
    """
    log = draw(kind, effect, seed, split, folder, second=True, **given)
    row: Row = {"log": log.name, "kind": kind, "effect": effect, "truth": log.truth.summary()}
    row["rows"] = len(log.columns["time"])
    try:
        oracle = Oracle.of(log)
        row |= {"floor_w": oracle.floor_w, "rho": oracle.rho, "z": oracle.z}
        row |= {"lead": oracle.lead, "rival": oracle.rival, "testable": oracle.testable}
        before = time.process_time()
        answer = diagnose(log.path, str(log.sheet), mapping=log.mapping)
        row["cpu_seconds"] = time.process_time() - before
    except Exception as error:  # a benchmark goes on and shows what failed
        return row | {"outcome": "error", "error": repr(error), "where": traceback.format_exc()}
    found = answer.to_json()
    row |= {"outcome": outcome(log, found), "sensor": sensors_of(found)}
    for key in ("verdict", "selected", "sentence", "baseline", "after", "meter", "unexplained"):
        row[key] = found.get(key)
    row["ties"] = {s: sorted(t) for s, t in aliases_of(found).items() if t}
    row["shape"] = (found.get("outside_catalogue") or {}).get("quantities")
    row["probabilities"] = [
        (c["effect"], c["probability"], c["effect"] in log.truth.there, c["evidence"]["z"])
        for c in found["candidates"]
        if c.get("testable", True) and c["probability"] is not None
    ]
    row["intervals"] = _intervals(log, answer, found)
    row["second_w"] = _second_drive(log, answer.base)
    row["methods"] = _others(log, methods)
    return row


def _intervals(log: Log, answer: Diagnosis, found: Mapping[str, Any]) -> list[Row]:
    """Truth and 95 % interval of every parameter of named effects that are there."""
    entries = []
    model = answer.model
    for candidate in found["candidates"]:
        slug = candidate["effect"]
        if slug not in found["selected"] or slug not in log.truth.hidden:
            continue
        for name, estimate in candidate["parameters"].items():
            parameter, _, element = name.partition(" ")
            true = _true_value(log, model, slug, parameter, int(element or 0))
            if true is None or not estimate["stderr"]:
                continue
            off = abs(estimate["value"] - true)
            inside = bool(off <= INTERVAL_Z * estimate["stderr"])
            numbers = {"value": estimate["value"], "stderr": estimate["stderr"], "true": true}
            entries.append({"effect": slug, "parameter": name, "inside": inside, **numbers})
    return entries


def _true_value(
    log: Log, model: PowerModel, slug: str, parameter: str, element: int
) -> float | None:
    """A hidden strength in the catalogue's terms; None where that has no such number."""
    settings = log.truth.hidden[slug]
    root = parameter.removesuffix("_squared")
    if parameter not in settings:
        return float(settings[root]) ** 2 if root in settings else None
    value = settings[parameter]
    if isinstance(value, Mapping):
        labels = [label for label in model.surfaces if label in set(log.columns["surface"])]
        if element >= len(model.surfaces) or model.surfaces[element] not in labels:
            return None
        counted = {label: int(np.sum(log.columns["surface"] == label)) for label in labels}
        usual = max(labels, key=lambda label: counted[label])
        own = 1.0 + float(value.get(model.surfaces[element], 0.0))
        return own / (1.0 + float(value.get(usual, 0.0))) - 1.0
    if isinstance(value, list):
        return float(value[element] - np.mean(value))
    return float(value)


def _second_drive(log: Log, base: PowerModel) -> tuple[float, float]:
    """W rms on another drive of the same robot: the fitted base model, and the stated vehicle.

    The drive is read as ``compare`` reads it, beside the stated vehicle: on the clock, and with the
    speeds and angles, that predict it best.
    """
    start = starting_model(log.sheet)
    source = as_measured(open_source(Telemetry.read(log.second_path, log.mapping)), start)
    read = with_true_tilt(source, start).sample
    instruments, row = log.truth.instruments, 1.0 / log.truth.conditions.rate
    errors = []
    for model in (base, start):
        watts = through_meter(
            read, predict(model, read)[:, None], instruments.meter, row, instruments.clock_rate
        )
        left = read.power[:, None] - watts
        left -= carried(read, left, instruments.meter.time_constant)
        errors.append(float(np.sqrt(np.mean(left**2))))
    return errors[0], errors[1]


def _others(log: Log, methods: Sequence[str]) -> dict[str, Row]:
    """What other methods name."""
    found: dict[str, Row] = {}
    if not methods:
        return found
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of iterations that did not converge
        task = prepare(log.path, log.mapping, str(log.sheet))
        for method in methods:
            selected = METHODS[method](task)
            said = outcome(log, as_diagnosis(selected))
            found[method] = {"selected": selected, "outcome": said}
    return found
