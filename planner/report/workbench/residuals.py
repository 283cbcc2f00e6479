"""What pictures of a result need: measured and predicted power, and the residual over each axis.

    look = look_of(diagnosis)
    look.measured, look.predicted["before"]       # rows spread over the log
    look.curves["speed"]["before"]                # mean residual by bins of the speed

"Before" is the model that the result starts from, "after" the one that it proposes or has made;
a comparison has no "after". Residuals are measured minus predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.report.axes import thinned
from planner.telemetry.adoption import Adoption
from planner.telemetry.comparison import CLOUD, Comparison, Sums, curve_bins
from planner.telemetry.diagnosis import Diagnosis
from planner.telemetry.logs import Telemetry
from planner.telemetry.pictures import Stretch, worst_stretch
from planner.telemetry.prediction import predict
from planner.telemetry.quantities_of_motion import AXES, FURTHER, all_axes, temperature_of
from planner.telemetry.regimes import WORDS

SURE = 1.96
"""Standard errors of a 95 % interval."""
_NAMES = {
    "slope_along": "slope along the travel",
    "slope_across": "slope across the travel",
    "heading": "direction of travel",
    "surface": "ground",
    "headwind": "wind against the travel",
    "com_x": "centre of mass, forward",
    "com_y": "centre of mass, left",
    "slope_rate": "change of slope",
    "odometer": "distance driven",
}


@dataclass(frozen=True)
class Axis:
    """How an axis is written: words, unit, and units of words in one SI unit."""

    words: str
    unit: str
    scale: float
    meaning: str

    @property
    def label(self) -> str:
        """Words and unit."""
        return f"{self.words} ({self.unit})" if self.unit else self.words


def axis_of(name: str) -> Axis:
    """How an axis of motion, or the ground, is written."""
    words = _NAMES.get(name, name.replace("_", " "))
    known = {**AXES, **FURTHER}.get(name)
    if known is None:
        return Axis(words, "", 1.0, "label of the ground in the log")
    degrees = name == "heading" or WORDS[name].degrees
    meaning = known.meaning.replace("π/2", "90°") if degrees else known.meaning
    unit = "°" if degrees else known.unit
    return Axis(words, unit, 180.0 / np.pi if degrees else 1.0, meaning)


@dataclass(frozen=True)
class Bins:
    """A residual in bins of one axis.

    Attributes:
        x: SI, or labels.
        bias: W, mean of measured minus predicted.
        stderr: W; NaN where it cannot be estimated.
        rows: how many.
    """

    x: tuple[Any, ...]
    bias: Array
    stderr: Array
    rows: Array

    @classmethod
    def of(cls, lists: Mapping[str, Sequence[Any]]) -> Bins:
        """From the lists of Comparison.curves."""
        stderr = [np.nan if value is None else value for value in lists["stderr_w"]]
        bias, rows = np.array(lists["bias_w"], float), np.array(lists["rows"], float)
        return cls(tuple(lists["x"]), bias, np.array(stderr, float), rows)

    @property
    def interval(self) -> tuple[Array, Array]:
        """W, both ends of 95 %; the mean itself where the error is unknown."""
        reach = SURE * np.nan_to_num(self.stderr)
        return self.bias - reach, self.bias + reach

    @property
    def structure(self) -> float:
        """W², mean square of the residual that the axis explains, its own uncertainty taken off.

        A bin that holds a single run says nothing about its axis: the run may be off as a whole.
        """
        clear = np.maximum(self.bias**2 - self.stderr**2, 0.0)
        return float(self.rows @ np.nan_to_num(clear) / max(self.rows.sum(), 1.0))


Curve = dict[str, Bins]
"""The residual over one axis, "before" and, where there is a second model, "after"."""


@dataclass(frozen=True)
class Look:
    """What is drawn of a log.

    Attributes:
        measured: (k,) W of rows spread over the log.
        predicted: "before" and perhaps "after" → (k,) W of the same rows.
        curves: axis → residual, most telling first.
        stretch: a minute to look at; None where the rows in a row are not known.
        residuals: "before" and perhaps "after" → W of all rows that are known.
    """

    measured: Array
    predicted: dict[str, Array]
    curves: dict[str, Curve]
    stretch: Stretch | None
    residuals: dict[str, Array]


def look_of(result: Comparison | Diagnosis | Adoption) -> Look:
    """What is drawn of a comparison, a diagnosis or an adoption."""
    if isinstance(result, Adoption):
        found = result.diagnosis
        return _look(found.corrected, {"before": found.base, "after": result.model})
    if isinstance(result, Diagnosis):
        proposed = {"after": result.model} if result.proposed else {}
        look = _look(result.corrected, {"before": result.base, **proposed})
        return replace(look, stretch=result.pictures.stretch)
    curves = {axis: {"before": Bins.of(lists)} for axis, lists in result.curves.items()}
    residuals = {"before": result.measured - result.predicted}
    return Look(result.measured, {"before": result.predicted}, _ordered(curves), None, residuals)


def _look(log: Telemetry, models: Mapping[str, PowerModel]) -> Look:
    watts = {kind: predict(model, log) for kind, model in models.items()}
    known = np.isfinite(np.sum([*watts.values()], axis=0))
    if not known.all():
        log = log.take(known)
        watts = {kind: values[known] for kind, values in watts.items()}
    found = {kind: _curves(log, values) for kind, values in watts.items()}
    curves = {
        axis: {kind: bins[axis] for kind, bins in found.items() if axis in bins}
        for axis in found["before"]
    }
    shown = thinned(len(log), CLOUD)
    return Look(
        log.power[shown],
        {kind: values[shown] for kind, values in watts.items()},
        _ordered(curves),
        worst_stretch(log, watts),
        {kind: log.power - values for kind, values in watts.items()},
    )


def _curves(log: Telemetry, watts: Array, temperature: str | None = None) -> dict[str, Bins]:
    """Residual of a prediction, (n,) W, over every axis that varies in a log."""
    temperature = temperature or temperature_of(log.rows)
    bins = tuple(curve_bins(all_axes(log.rows, temperature=temperature), log.surfaces))
    sums = Sums(len(log.run_names), [], bins, temperature, log.run, log.power - watts)
    sums.add(log, watts)
    return {axis: Bins.of(lists) for axis, lists in sums.curves().items()}


def lacking(diagnosis: Diagnosis) -> Bins | None:
    """What the model lacks without the proposed formula, over the formula's first quantity.

    These are partial residuals: what the model with everything leaves over, and the formula's own
    watts on top. None where there is no formula, or its quantity hardly varies.
    """
    outside, log, model = diagnosis.outside, diagnosis.corrected, diagnosis.model
    if outside is None:
        return None
    own = model.share_of(outside.name, log.rows_for(model.surfaces))
    # The log may know the motors' temperature, too.
    temperature = "ambient_temp" if "ambient_temp" in outside.formula else None
    return _curves(log, predict(model, log) - own, temperature).get(outside.quantities[0])


def _ordered(curves: Mapping[str, Curve]) -> dict[str, Curve]:
    identifiable = {axis: curve for axis, curve in curves.items() if len(curve["before"].x) > 1}
    return dict(sorted(identifiable.items(), key=lambda entry: -entry[1]["before"].structure))
