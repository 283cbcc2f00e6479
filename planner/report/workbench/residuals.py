"""What pictures of a result need: measured and predicted power, and the residual over each axis.

    look = look_of(diagnosis)
    look.measured, look.before, look.after        # rows spread over the log
    look.curves["speed"].before                   # mean residual by bins of the speed

"Before" is the model that the result starts from, "after" the one that it proposes or has made;
a comparison has no "after". Residuals are measured minus predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.report.axes import thinned
from planner.telemetry.adoption import Adoption
from planner.telemetry.comparison import CLOUD, Comparison, Sums, curve_bins
from planner.telemetry.diagnosis import Diagnosis
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.quantities_of_motion import AXES, FURTHER, all_axes, temperature_of
from planner.telemetry.regimes import WORDS

STRETCH = 120
"""Rows of the stretch that is drawn over time."""
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
        stderr: W; NaN where it cannot be told.
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
    def structure(self) -> float:
        """W², mean square of the residual that the axis tells, its own uncertainty taken off.

        A bin that holds a single run says nothing about its axis: the run may be off as a whole.
        """
        clear = np.maximum(self.bias**2 - self.stderr**2, 0.0)
        return float(self.rows @ np.nan_to_num(clear) / max(self.rows.sum(), 1.0))


@dataclass(frozen=True)
class Curve:
    """The residual over one axis, without and with what was proposed."""

    axis: str
    before: Bins
    after: Bins | None


@dataclass(frozen=True)
class Stretch:
    """Consecutive rows of one run, those in which the model at the start errs most.

    Attributes:
        run: its label.
        time: (n,) s since the run's first row.
        measured, before: (n,) W.
        after: (n,) W, or None.
    """

    run: str
    time: Array
    measured: Array
    before: Array
    after: Array | None


@dataclass(frozen=True)
class Look:
    """What is drawn of a log.

    Attributes:
        measured, before: (k,) W of rows spread over the log.
        after: (k,) W, or None.
        curves: axis → residual, most telling first.
        stretch: a minute to look at; None where the rows in a row are not known.
        residual_before, residual_after: W of all rows that are known.
    """

    measured: Array
    before: Array
    after: Array | None
    curves: dict[str, Curve]
    stretch: Stretch | None
    residual_before: Array
    residual_after: Array | None


@singledispatch
def look_of(result: object) -> Look:
    """What is drawn of a comparison, a diagnosis or an adoption."""
    raise TypeError(f"no picture of {type(result).__name__}")


@look_of.register
def _(result: Comparison) -> Look:
    curves = {axis: Curve(axis, Bins.of(lists), None) for axis, lists in result.curves.items()}
    residual = result.measured - result.predicted
    return Look(result.measured, result.predicted, None, _ordered(curves), None, residual, None)


@look_of.register
def _(result: Diagnosis) -> Look:
    after = result.model if result.proposed else None
    return _look(result.corrected, result.base, after)


@look_of.register
def _(result: Adoption) -> Look:
    return _look(result.diagnosis.corrected, result.diagnosis.base, result.model)


def _look(log: Telemetry, base: PowerModel, new: PowerModel | None) -> Look:
    before = predict(base, log)
    after = None if new is None else predict(new, log)
    known = np.isfinite(before if after is None else before + after)
    if not known.all():
        log, before = log.take(known), before[known]
        after = None if after is None else after[known]
    shown = thinned(len(log), CLOUD)
    old, young = _curves(log, before), {} if after is None else _curves(log, after)
    return Look(
        log.power[shown],
        before[shown],
        None if after is None else after[shown],
        _ordered({axis: Curve(axis, bins, young.get(axis)) for axis, bins in old.items()}),
        _stretch(log, before, after),
        log.power - before,
        None if after is None else log.power - after,
    )


def _curves(log: Telemetry, watts: Array) -> dict[str, Bins]:
    """Residual of a prediction, (n,) W, over every axis that varies in a log."""
    temperature = temperature_of(log.rows)
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
    own = model.watts_by_effect(log.rows_for(model.surfaces))[outside.name]
    return _curves(log, predict(model, log) - own).get(outside.quantities[0])


def _ordered(curves: Mapping[str, Curve]) -> dict[str, Curve]:
    told = {axis: curve for axis, curve in curves.items() if len(curve.before.x) > 1}
    return dict(sorted(told.items(), key=lambda entry: -entry[1].before.structure))


def _stretch(log: Telemetry, before: Array, after: Array | None) -> Stretch | None:
    squares = np.concatenate([[0.0], np.cumsum((log.power - before) ** 2)])
    best, place = -1.0, slice(0, 0)
    for start, stop in log.segments():
        length = min(STRETCH, stop - start)
        if length < 8:
            continue
        gathered = squares[start + length : stop + 1] - squares[start : stop + 1 - length]
        at = int(np.argmax(gathered))
        # Of short segments none may win because its few rows are bad: sums, not means.
        if gathered[at] > best:
            best, place = float(gathered[at]), slice(start + at, start + at + length)
    if best < 0.0:
        return None
    run = int(log.run[place.start])
    time = log.time[place] - float(log.time[np.argmax(log.run == run)])
    return Stretch(
        log.run_names[run],
        time,
        log.power[place],
        before[place],
        None if after is None else after[place],
    )
