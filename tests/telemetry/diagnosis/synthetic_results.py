"""Results of the workbench put together from a virtual drive, with names that try to break out.

The robot hides air drag and a ripple over the heading. What a diagnosis would say about it is
written down here instead of computed, so that a page can be held against it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.power.catalogue import find_effect
from planner.power.model import PowerModel
from planner.telemetry.adoption import Adoption
from planner.telemetry.comparison import Comparison, RunComparison
from planner.telemetry.diagnosis.results import (
    Candidate,
    Diagnosis,
    Errors,
    Estimate,
    Experiment,
    NotTestable,
    Outside,
    SensorFault,
)
from planner.telemetry.diagnosis.unexplained import Unexplained
from planner.telemetry.diagnosis.unknown_effect import formula_of
from planner.telemetry.estimation import Fit, fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Shape
from planner.telemetry.pictures import (
    ELSEWHERE,
    Pictures,
    ResidualCurve,
    Share,
    worst_stretch,
)
from planner.telemetry.prediction import predict
from planner.telemetry.regimes import Regime
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import Addition, fit_with
from planner.telemetry.virtual import QUIET, VirtualRobot

EVIL = "</td><script>alert('1')</script> & \"quoted\" \x07\ud800"
"""Markup, quotes, a control character and half a character."""
RIPPLE_W = 1.5
BEFORE, AFTER, FLOOR = Errors(2.361, 2.345, 0.4321), Errors(0.612, 0.678), 0.4321
CURVE = tuple((h, RIPPLE_W * np.cos(3 * h)) for h in np.linspace(-np.pi, np.pi, 41))


@dataclass(frozen=True)
class Material:
    """A drive, and models fitted to it without and with what the robot hides."""

    log: Telemetry
    base: Fit
    full: Fit
    formula: Addition


def material(folder: Path) -> Material:
    """Drive, fit, and give runs, grounds and the file hostile names."""
    robot = VirtualRobot(
        "minibalance",
        hidden={"air_drag": {}, "heading_ripple": {"power": RIPPLE_W, "harmonic": 3}},
        seed=2,
    )
    robot.drive(robot.profile("rich", runs=8, rows=120), noise=QUIET).write_csv(folder / "log.csv")
    log = Telemetry.read(folder / "log.csv")
    log = replace(
        log,
        source=EVIL,
        run_names=tuple(f"{EVIL} {name}" for name in log.run_names),
        surfaces=tuple(f"{EVIL} {name}" for name in log.surfaces),
    )
    base = fit(log, replace(starting_model("minibalance"), name=EVIL))
    effect, start = formula_of(
        Shape("heading", "cos", 3.0), (-np.pi, np.pi), "motor_temp", (1.0, 0.0)
    )
    formula = Addition(effect, start)
    drag = Addition.usual(find_effect("air_drag"), base.model)
    return Material(log, base, fit_with(base.model, log, [drag, formula]), formula)


def described() -> dict[str, Any]:
    """A log's description."""
    return {
        "source": f"logs/{EVIL}",
        "sha256": "5eed" * 16,
        "rows": 123_456,
        "runs": 8,
        "report": [{"kind": "gap", "column": "", "rows": 3, "sentence": f"3 gaps of {EVIL}"}],
        "derived": ["ax: d(vx)/dt - wz·vy"],
        "assumed": ["no payload: taken as 0 kg"],
    }


def regime(**changes: Any) -> Regime:
    """A place where the model is off."""
    given: dict[str, Any] = {
        "where": f"faster than 0.4 m/s {EVIL}",
        "rows": 321,
        "bias_w": 3.1,
        "rmse_w": 3.4,
        "share_of_squared_error": 0.41,
        "explained": 0.35,
        "stderr_w": 0.2,
        "chance": 1e-4,
        "conditions": (),
    }
    return Regime(**{**given, **changes})


def candidate(effect: str, probability: float, **changes: Any) -> Candidate:
    """One of those that compete."""
    given: dict[str, Any] = {
        "effect": effect,
        "probability": probability,
        "heldout_rmse_w": 2.2,
        "parameters": {"size": Estimate(0.1234, 0.0056, "m²")},
        "z": 2.5,
        "p_value": 0.012,
        "rho": 0.31,
        "gain": 4.0,
        "degrees_of_freedom": 1,
    }
    return Candidate(**{**given, **changes})


def outside(made: Material) -> Outside:
    """The ripple as a formula."""
    effect = made.formula.declaration
    formula = str((effect.definition or {})["formula"])
    return Outside(("heading",), CURVE, effect.slug, formula, effect, 12.3, 1.7)


def diagnosis(made: Material, **changes: Any) -> Diagnosis:
    """Air drag is missing, and a formula beside it; air drag is tied with another effect."""
    tied = candidate("vibration", 0.02, heldout_rmse_w=None)
    best = candidate(
        "air_drag",
        0.97,
        heldout_rmse_w=0.678,
        z=26.5,
        p_value=0.0,
        indistinguishable_from=("vibration",),
    )
    legs = [
        {"vx": way * 0.25, "vy": 0.0, "wz": 0.0, "ramp": 0.625, "hold": 8.0} for way in (1.0, -1.0)
    ]
    settings = {
        "runs": [{"payload": 5.0, "motor_temp": None}],
        "rounds": 7,
        "slope": np.pi / 36,
        "uphill": 0.0,
        "robot": [0.86, 0.52],
        "area": [3.2, 1.1],
        "legs": legs,
    }
    given: dict[str, Any] = {
        "verdict": "outside_catalogue",
        "selected": ("air_drag",),
        "sentence": f"Something is missing: {EVIL}",
        "baseline": BEFORE,
        "after": AFTER,
        "candidates": (best, tied, candidate("wear", 0.0, why_not="no odometer")),
        "not_testable": (
            NotTestable("wear", f"no odometer {EVIL}", "Drive for weeks."),
            NotTestable("battery_sag", f"no odometer {EVIL}", "Drive for weeks."),
        ),
        "regimes": (regime(), regime(where="climbing more than 2°", bias_w=-1.25)),
        "unexplained": Unexplained(1.57, (regime(),)),
        "outside": outside(made),
        "sensors": (SensorFault("slope_offset", 0.034, 0.002, "rad", f"pitch is off {EVIL}"),),
        "experiments": (
            Experiment(
                ("air_drag", "vibration"), f"Drive against a wind. {EVIL}", settings, 3.0, 2.0
            ),
        ),
        "base": made.base.model,
        "fitted": made.full,
        "additions": {},
        "corrected": made.log,
        "log": described(),
        "pictures": pictures(made),
    }
    return Diagnosis(**{**given, **changes})


def pictures(made: Material, **changes: Any) -> Pictures:
    """Something to look at: a ripple, and the formula that goes through it."""
    x, y = np.array(CURVE[::4]).T
    place = regime()
    given: dict[str, Any] = {
        "stretch": worst_stretch(made.log, {"before": made.base.watts, "after": made.full.watts}),
        "curves": (
            ResidualCurve(
                "air_drag", "heading", tuple(x), y + 0.05, 0.1 + 0.0 * y, 9.0 + 0.0 * y, y
            ),
        ),
        "shares": (
            Share(place.where, place.rows, 0.2, 0.41, place.bias_w),
            Share(ELSEWHERE, 1605, 0.8, 0.59, 0.02),
        ),
    }
    return Pictures(**{**given, **changes})


def complete(made: Material) -> Diagnosis:
    """Nothing is missing."""
    return diagnosis(
        made,
        verdict="complete",
        selected=(),
        after=BEFORE,
        regimes=(),
        unexplained=Unexplained(1.05),
        outside=None,
        sensors=(),
        experiments=(),
        not_testable=(),
        fitted=made.base,
    )


def comparison(made: Material) -> Comparison:
    """What a comparison with the base model would say, in figures of our own."""
    runs = tuple(
        RunComparison(f"{EVIL} {k}", 100, 1000.0, 1000.0 + 10.0 * (k - 3), 1.0 + k, 0.1 * k)
        for k in range(30)
    )
    lists = {
        "speed": {"x": [0.1, 0.2, 0.3], "bias_w": [0.0, 1.0, 2.0], "stderr_w": [0.1, None, 0.1]},
        "surface": {"x": [EVIL, "wet"], "bias_w": [-1.0, 1.0], "stderr_w": [0.1, 0.1]},
        "heading": {"x": [0.0, 1.57], "bias_w": [0.5, -0.5], "stderr_w": [0.1, 0.1]},
    }
    return Comparison(
        model=made.base.model,
        fitted=True,
        parameters=made.base.parameters,
        log=described(),
        whole=RunComparison("", 123_456, 50_000.0, 48_500.0, 2.361, 0.5),
        mae_w=1.75,
        r2=0.9321,
        heldout_rmse_w=2.345,
        noise_floor_w=FLOOR,
        runs=runs,
        regimes=(regime(),),
        curves={axis: {**curve, "rows": [9] * len(curve["x"])} for axis, curve in lists.items()},
        measured=made.log.power,
        predicted=predict(made.base.model, made.log),
        not_computed=0,
    )


def entry(version: int, **changes: Any) -> dict[str, Any]:
    """One version of a history."""
    given: dict[str, Any] = {
        "version": version,
        "parent": f"robot v{version - 1}",
        "action": "adopt",
        "adopted": ["air_drag"],
        "effects": {},
        "log": {"source": EVIL, "sha256": "5eed", "rows": 4800, "runs": 16},
        "before": {"rmse_w": 2.0, "heldout_rmse_w": 2.0},
        "after": {"rmse_w": 1.0, "heldout_rmse_w": 1.0},
        "noise_floor_w": 0.5,
        "warnings": [f"this log does not call for it {EVIL}"],
        "at": "2026-05-04T12:34:56+00:00",
        "snapshot": {},
    }
    return {**given, **changes}


def model(made: Material) -> PowerModel:
    """Fitted, extended on another log, and taken back."""
    return replace(
        made.full.model,
        version=3,
        history=(
            entry(1, action="fit", adopted=[], parent=None, before=None),
            entry(2, log={"source": "other.csv", "sha256": "0dd", "rows": 7, "runs": 1}),
            entry(3, action="revert", adopted=[], reverted_to=1),
        ),
    )


def adoption(made: Material) -> Adoption:
    """The formula and air drag, adopted."""
    found = diagnosis(made)
    return Adoption(
        model(made), found.proposed, BEFORE, AFTER, made.full.parameters, (EVIL, EVIL), found
    )


RESULTS: dict[str, Callable[[Material], Any]] = {
    "comparison": comparison,
    "diagnosis": diagnosis,
    "complete": complete,
    "adoption": adoption,
    "model": model,
}
