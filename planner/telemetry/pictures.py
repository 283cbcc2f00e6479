"""What a person looks at to believe a diagnosis, as numbers: command line, page and report draw it.

    pictures = pictures_of(log, before, after, parts, regimes)
    pictures.stretch        # measured and predicted power where the model errs most
    pictures.curves         # the residual over the quantity that explains it, and what is claimed
    pictures.shares         # which rows the squared error is in; every row counts once

Residuals are those of the model as it is. Of a claim the picture shows what it changes: prediction
with it less prediction without it, every parameter refitted. So a claim that explains the residual
goes through the dots.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Array, Mask
from planner.telemetry.comparison import CurveBins, Sums, curve_bins
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import (
    AXES,
    FURTHER,
    STANDSTILL,
    all_axes,
    temperature_of,
)
from planner.telemetry.regimes import Regime

STRETCH_SECONDS, STRETCH_ROWS = 30.0, (120, 300)
"""Length of the stretch that is drawn over time, and its fewest and most rows."""
LEAST_STRETCH_ROWS = 8
"""Rows in a row from which on there is something to see."""
EDGES = 5
"""Borders between dots that are equally far apart; that many more hold equally many rows, and that
many more equal parts of what is claimed."""
FIXED = {"predicted_power": 0.0, "speed": STANDSTILL}
"""Borders between what is not to be mixed: power that flows back, a robot that stands."""
LEAST_BIN_SHARE, LEAST_BIN_ROWS = 0.005, 5
"""Rows of a dot, at least: as a share of the log, and how many."""
ELSEWHERE = "everywhere else"


@dataclass(frozen=True)
class Stretch:
    """Consecutive rows of one run, those in which the model at the start errs most.

    Attributes:
        run: its label.
        time: (n,) s since the run's first row.
        measured: (n,) W.
        predicted: "before" and perhaps "after" → (n,) W.
    """

    run: str
    time: Array
    measured: Array
    predicted: Mapping[str, Array]

    def to_json(self) -> dict[str, Any]:
        """The entry ``stretch``."""
        after = self.predicted.get("after")
        return {
            "run": self.run,
            "time_s": _figures(self.time),
            "measured_w": _figures(self.measured),
            "predicted_w": _figures(self.predicted["before"]),
            "proposed_w": None if after is None else _figures(after),
        }


@dataclass(frozen=True)
class ResidualCurve:
    """A residual in bins of one quantity, and what a claim says there.

    Attributes:
        of: what is claimed, a slug, a formula's name or a sensor's error; None claims nothing.
        quantity: an axis of motion, or "surface".
        x: SI and rad, or labels of the ground.
        missing: (k,) W, mean of measured minus predicted.
        stderr: (k,) W; NaN where it cannot be estimated.
        rows: (k,) how many.
        fitted: (k,) W, what everything that is claimed adds there; None where nothing is.
    """

    of: str | None
    quantity: str
    x: tuple[Any, ...]
    missing: Array
    stderr: Array
    rows: Array
    fitted: Array | None

    @property
    def structure(self) -> float:
        """W², mean square of the residual that the bins hold."""
        return float(self.rows @ self.missing**2 / max(self.rows.sum(), 1))

    def to_json(self) -> dict[str, Any]:
        """One entry of ``curves``."""
        known = np.isfinite(self.stderr)
        errors = [e if k else None for e, k in zip(_figures(self.stderr), known, strict=True)]
        return {
            "of": self.of,
            "quantity": self.quantity,
            "x": [x if isinstance(x, str) else _figure(x) for x in self.x],
            "missing_w": _figures(self.missing),
            "stderr_w": errors,
            "rows": [int(n) for n in self.rows],
            "fitted_w": None if self.fitted is None else _figures(self.fitted),
        }


@dataclass(frozen=True)
class Share:
    """Rows that hold a share of the squared error, without those of the shares before it.

    Attributes:
        where: in words.
        rows: how many.
        share_of_rows, share_of_squared_error: of the log.
        bias_w: W, mean of measured minus predicted.
    """

    where: str
    rows: int
    share_of_rows: float
    share_of_squared_error: float
    bias_w: float

    def to_json(self) -> dict[str, Any]:
        """One entry of ``shares``."""
        return dict(vars(self))


@dataclass(frozen=True)
class Pictures:
    """What to look at.

    Attributes:
        stretch: where the model at the start errs most; None where no rows follow each other.
        curves: one for every claim, most telling first, or one where nothing is claimed.
        shares: of the squared error, the rest last; () where no regime stands out.
    """

    stretch: Stretch | None
    curves: tuple[ResidualCurve, ...]
    shares: tuple[Share, ...]

    def to_json(self) -> dict[str, Any]:
        """The entry ``pictures`` of a diagnosis."""
        return {
            "stretch": None if self.stretch is None else self.stretch.to_json(),
            "curves": [curve.to_json() for curve in self.curves],
            "shares": [share.to_json() for share in self.shares],
        }


def pictures_of(
    log: Telemetry,
    before: Array,
    after: Array | None,
    parts: Mapping[str, Array],
    regimes: Sequence[Regime],
) -> Pictures:
    """What to look at in a log.

    Args:
        log: n rows as they were measured.
        before: (n,) W, predicted by the model as it is.
        after: (n,) W, predicted with everything that is claimed; None claims nothing.
        parts: name of each claim → (n,) W that follow the same quantity as the claim does.
        regimes: of the residual.
    """
    known = np.isfinite(before) if after is None else np.isfinite(before + after)
    if not known.all():
        log, before = log.take(known), before[known]
        after = None if after is None else after[known]
        parts = {name: values[known] for name, values in parts.items()}
    predicted = {"before": before} if after is None else {"before": before, "after": after}
    axes = all_axes(log.rows, watts=before)
    shares = shares_of(log.power - before, axes, regimes)
    curves: dict[str, ResidualCurve] = {}
    if parts:
        for name, part in parts.items():
            curve = _curve(log, axes, predicted, name, part)
            if curve is not None:
                curves.setdefault(curve.quantity, curve)
    else:
        first = next((r for r in regimes if shares and r.where == shares[0].where), None)
        own = {condition.axis for condition in first.conditions} if first else set()
        given = {name: values for name, values in axes.items() if name in own} or axes
        curve = _curve(log, given, predicted, None, log.power - before)
        curves = {} if curve is None else {curve.quantity: curve}
    telling = sorted(curves.values(), key=lambda curve: -curve.structure)
    return Pictures(worst_stretch(log, predicted), tuple(telling), shares)


def worst_stretch(log: Telemetry, predicted: Mapping[str, Array]) -> Stretch | None:
    """The rows in a row in which the model at the start errs most.

    Args:
        log: n rows.
        predicted: "before" and perhaps "after" → (n,) W.
    """
    squares = np.concatenate([[0.0], np.cumsum((log.power - predicted["before"]) ** 2)])
    wanted = STRETCH_SECONDS / max(float(np.median(log.interval)), 1e-9)
    rows = int(np.clip(wanted, *STRETCH_ROWS))
    best, place = -1.0, slice(0, 0)
    for start, stop in log.segments():
        length = min(rows, stop - start)
        if length < LEAST_STRETCH_ROWS:
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
    shown = {kind: values[place] for kind, values in predicted.items()}
    return Stretch(log.run_names[run], time, log.power[place], shown)


def shares_of(
    residual: Array, axes: Mapping[str, Array], regimes: Sequence[Regime]
) -> tuple[Share, ...]:
    """Shares of the squared error by regime; a row counts in the first one.

    First comes what holds most of the error in few rows: the one share less the other.

    Args:
        residual: (n,) W.
        axes: values by name, each (n,), as the regimes were found on.
        regimes: that may overlap.
    """
    squares = residual**2
    total = float(squares.sum())
    if not regimes or total == 0.0:
        return ()
    masks = {regime.where: regime.holds(axes) for regime in regimes}
    free = np.ones(len(residual), bool)
    found = []
    while masks:
        where = max(masks, key=lambda name: _excess(squares, masks[name] & free))
        met = masks.pop(where) & free
        if met.any():
            found.append(_share(where, met, residual, total))
            free &= ~met
    return (*found, _share(ELSEWHERE, free, residual, total)) if free.any() else tuple(found)


def _excess(squares: Array, met: Mask) -> float:
    return float(squares[met].sum() / squares.sum() - met.mean())


def _share(where: str, met: Mask, residual: Array, total: float) -> Share:
    inside = residual[met]
    squares = float(inside @ inside) / total
    return Share(where, len(inside), len(inside) / len(residual), squares, float(inside.mean()))


def _curve(
    log: Telemetry,
    axes: Mapping[str, Array],
    predicted: Mapping[str, Array],
    name: str | None,
    part: Array,
) -> ResidualCurve | None:
    """The residual over the quantity that a part of the power, (n,) W, follows most closely."""
    bins = list(_bins(axes, log.surfaces, part))
    if not bins:
        return None
    followed = [_followed(one, axes[one.name], part) for one in bins]
    chosen = bins[int(np.argmax(followed))]
    before = predicted["before"]
    left = _lists(log, chosen, before)
    fitted = None
    if "after" in predicted:
        lists = _lists(replace(log, power=predicted["after"]), chosen, before)
        fitted = np.array(lists["bias_w"], float)
    enough = np.array(left["rows"]) >= max(LEAST_BIN_ROWS, LEAST_BIN_SHARE * len(log))
    kept = [int(k) for k in np.flatnonzero(enough)]
    stderr = np.array([np.nan if e is None else e for e in left["stderr_w"]], float)
    return ResidualCurve(
        of=name,
        quantity=chosen.name,
        x=tuple(left["x"][k] for k in kept),
        missing=np.array(left["bias_w"], float)[kept],
        stderr=stderr[kept],
        rows=np.array(left["rows"])[kept],
        fitted=None if fitted is None else fitted[kept],
    )


def _bins(axes: Mapping[str, Array], surfaces: Sequence[str], part: Array) -> Iterator[CurveBins]:
    """Bins of every quantity that varies: some everywhere, some where many rows or watts are."""
    unknown = np.full(len(part), np.nan)
    every = {name: axes.get(name, unknown) for name in (*AXES, *FURTHER)}
    for one in curve_bins(every, surfaces if "surface" in axes else ()):
        if not len(one.edges):
            yield one
            continue
        values = axes[one.name]
        known = np.flatnonzero(np.isfinite(values))
        known = known[np.argsort(values[known], kind="stable")]
        values, claimed = values[known], np.cumsum(np.abs(part[known] - np.median(part[known])))
        between = np.arange(1, EDGES + 1) / (EDGES + 1)
        low, high = np.quantile(values, [LEAST_BIN_SHARE, 1.0 - LEAST_BIN_SHARE])
        acting = np.searchsorted(claimed, between * claimed[-1])
        edges = [low + between * (high - low), np.quantile(values, between), values[acting]]
        fixed = FIXED.get(one.name, low)
        kept = [fixed] if low < fixed < high else []
        for edge in np.concatenate(edges).tolist():
            if all(abs(edge - other) > (high - low) / (8.0 * EDGES) for other in kept):
                kept.append(edge)
        yield CurveBins(one.name, np.array(sorted(kept)))


def _followed(bins: CurveBins, values: Array, part: Array) -> float:
    """Share of the variance of a part (n,) W that its means in bins hold, less that of chance."""
    place = bins.place(values)
    known = place < bins.count
    if np.count_nonzero(known) < 2 * bins.count:
        return 0.0
    place, part = place[known], part[known]
    rows = np.bincount(place, minlength=bins.count)
    means = np.bincount(place, part, bins.count) / np.maximum(rows, 1)
    total = float(((part - part.mean()) ** 2).sum())
    left = float(((part - means[place]) ** 2).sum())
    freedom = (len(part) - 1) / max(len(part) - int(np.count_nonzero(rows)), 1)
    share = 1.0 - left / total * freedom if total > 0.0 else 0.0
    return share * float(known.mean())


def _lists(log: Telemetry, bins: CurveBins, watts: Array) -> Mapping[str, Sequence[Any]]:
    """Mean of power less watts, (n,), in bins, with its standard error by clusters."""
    temperature = temperature_of(log.rows)
    residual = log.power - watts
    sums = Sums(len(log.run_names), [], [bins], temperature, log.run, residual)
    sums.add(log, watts)
    return sums.curves()[bins.name]


def _figure(value: float) -> float:
    """Five significant digits: more is not seen."""
    return float(f"{float(value):.5g}")


def _figures(values: Array) -> list[float]:
    return [_figure(value) for value in values]
