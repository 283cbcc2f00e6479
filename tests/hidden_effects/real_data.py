"""Logs that nobody of this project made: a Robotino on two floors, a robot with real contacts.

    robotino() -> {"splits": {"by run": {...}, "headings 90-180": {...}, "fastest": {...}}, ...}
    contact("payload") -> {"effects": {slug: {"without_w", "with_w"}}, ...}

Both return None where the data are absent. They are read from ../shared/data beside the repository,
or from the folder that JOULEPATH_TEST_DATA names, and are no part of it.

Every split is diagnosed anew on its training rows alone; errors are those of the rows kept back. A
run of the Robotino is one steady drive of about ten seconds, whose single rows scatter by 1 W: its
bars are for means of runs, and the errors of rows are told beside them. Runs are in the order of
their headings: of every fourth one, a fold takes all headings at which a roller stands, so that
what happens there has to be guessed. That is told beside folds that are drawn.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.quantities import INDEX
from planner.telemetry.adoption import adopt
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.estimation import fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.starting_model import starting_model

Mask = NDArray[np.bool_]

HERE = Path(__file__).resolve().parent
CONTACT_ROBOT = HERE / "contact.toml"
ROBOTINO_BARS = {"by run": 0.7, "headings 90-180": 0.8, "fastest": 1.1}  # W
FOLDS = 4
DRAWS = 3


def data_folder() -> Path:
    """Where the measured logs would be."""
    default = HERE.parents[2] / "shared" / "data"
    return Path(os.environ.get("JOULEPATH_TEST_DATA", default))


def robotino() -> dict[str, Any] | None:
    """Which effects are named, and errors on held-out runs, headings and speeds."""
    path = data_folder() / "robotino" / "robotino_two_floors.csv"
    if not path.exists():
        return None
    log = Telemetry.read(path)
    whole = diagnose(log, "robotino")
    count = np.bincount(log.run)
    vx, vy = (np.bincount(log.run, log.rows[:, INDEX[name]]) / count for name in ("vx", "vy"))
    heading = np.degrees(np.arctan2(vy, vx))[log.run] % 360.0
    speed = np.hypot(vx, vy)[log.run]
    drawn = [np.random.default_rng(n).permutation(len(count)) % FOLDS for n in range(DRAWS)]
    splits: dict[str, list[Mask]] = {
        "by run": [folds[log.run] == fold for folds in drawn for fold in range(FOLDS)],
        "every fourth run": [log.run % FOLDS == fold for fold in range(FOLDS)],
        "headings 90-180": [(heading >= 90.0) & (heading < 180.0)],
        "fastest": [speed > 0.22],
    }
    found: dict[str, Any] = {
        "verdict": whole.verdict,
        "selected": list(whole.selected),
        "names_uneven_wheels": "wheel_imbalance" in whole.selected,
        "names_floor": "surface_rolling" in whole.selected,
        "splits": {},
    }
    for name, held_out in splits.items():
        errors = [_held_out(log, mask, "robotino") for mask in held_out]
        found["splits"][name] = {
            **{key: _pooled([e[key] for e in errors]) for key in errors[0] if key != "selected"},
            "selected": [e["selected"] for e in errors],
            "bar_w": ROBOTINO_BARS.get(name),
        }
    found["holds"] = found["names_uneven_wheels"] and all(
        found["splits"][name]["adopted_w"] <= bar for name, bar in ROBOTINO_BARS.items()
    )
    return found


def contact(kind: str) -> dict[str, Any] | None:
    """Whether each effect that is named lowers the error on held-out runs, and what remains."""
    path = data_folder() / "contact" / f"contact_{kind}.csv"
    if not path.exists():
        return None
    log = Telemetry.read(path)
    whole = diagnose(log, str(CONTACT_ROBOT))
    folds = [log.run % FOLDS == fold for fold in range(FOLDS)]
    base, adopted = [], []
    without: dict[str, list[float]] = {slug: [] for slug in whole.selected}
    for mask in folds:
        training = log.take(~mask)
        base.append(_rmse(fit(training, starting_model(str(CONTACT_ROBOT))).model, log, mask))
        if whole.selected:
            model = adopt(list(whole.selected), training, str(CONTACT_ROBOT)).model
            adopted.append(_rmse(model, log, mask))
        for slug in whole.selected:
            rest = [other for other in whole.selected if other != slug]
            if rest:
                model = adopt(rest, training, str(CONTACT_ROBOT)).model
                without[slug].append(_rmse(model, log, mask))
    after = _pooled(adopted or base)
    effects = {
        slug: {"without_w": _pooled(values or base), "with_w": after}
        for slug, values in without.items()
    }
    return {
        "verdict": whole.verdict,
        "selected": list(whole.selected),
        "sentence": whole.sentence,
        "outside": whole.outside.to_json()["quantities"] if whole.outside else None,
        "base_w": _pooled(base),
        "adopted_w": after,
        "noise_floor_w": whole.baseline.noise_floor_w,
        "effects": effects,
        "regimes": [regime.to_json() for regime in whole.regimes][:5],
        "holds": all(entry["with_w"] < entry["without_w"] for entry in effects.values()),
    }


def _held_out(log: Telemetry, mask: Mask, vehicle: str) -> dict[str, Any]:
    found = diagnose(log.take(~mask), vehicle)
    return {
        "base_w": _rmse(found.base, log, mask, runs=True),
        "adopted_w": _rmse(found.model, log, mask, runs=True),
        "base_rows_w": _rmse(found.base, log, mask),
        "adopted_rows_w": _rmse(found.model, log, mask),
        "selected": list(found.selected),
    }


def _rmse(model: Any, log: Telemetry, mask: Mask, *, runs: bool = False) -> float:
    """W, of rows or of means of runs."""
    kept = log.take(mask)
    residual = kept.power - predict(model, kept)
    if runs:
        _, number, count = np.unique(kept.run, return_inverse=True, return_counts=True)
        residual = np.bincount(number, residual) / count
    return float(np.sqrt(np.mean(residual**2)))


def _pooled(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
