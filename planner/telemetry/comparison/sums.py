"""What a comparison adds up while a log passes by: by run, by regime, by bins of the curves.

    sums = Sums(runs, regimes, bins, temperature, run, residual)
    for chunk in source.chunks(): sums.add(chunk, predict(model, chunk))
    sums.whole(), sums.by_run(names), sums.regimes(), sums.curves()

Memory does not grow with the length of the log (it does with the number of runs). The standard
error of a curve comes from clusters, whole runs where there are enough and otherwise blocks of
several correlation times: rows next to each other err alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Array, Integers
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import AXES, FURTHER, all_axes
from planner.telemetry.regimes import WORDS, Regime, cluster_length

CURVE_BINS = 20
"""Bins of a curve, about equally full."""
SECTORS = 24
"""Bins of the heading, 15° each."""
ENOUGH_RUNS = 12
"""Runs from which on whole runs are the clusters of standard errors."""


@dataclass(frozen=True)
class RunComparison:
    """One run, or the whole log.

    Attributes:
        run: its label.
        rows: those that the model gives a power for.
        measured_j, predicted_j: J.
        rmse_w, bias_w: W.
    """

    run: str
    rows: int
    measured_j: float
    predicted_j: float
    rmse_w: float
    bias_w: float

    @property
    def error_share(self) -> float | None:
        """Predicted over measured energy less one; None when nothing was measured."""
        return self.predicted_j / self.measured_j - 1.0 if self.measured_j != 0.0 else None

    def energy(self) -> dict[str, float | None]:
        """J, ready for JSON."""
        joules = {"measured_j": self.measured_j, "predicted_j": self.predicted_j}
        return {**joules, "error_share": self.error_share}


@dataclass(frozen=True)
class CurveBins:
    """Bins of a curve.

    Attributes:
        name: of an axis of motion, or "surface".
        edges: (k - 1,) borders between k bins; of the heading, borders that wrap around.
        labels: of the grounds, for "surface".
    """

    name: str
    edges: Array
    labels: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of bins."""
        return len(self.labels) or (SECTORS if self.name == "heading" else len(self.edges) + 1)

    def place(self, values: Array) -> Integers:
        """(n,) bin of every value; ``count`` where it is not known."""
        if self.labels:
            return np.where(values >= 0, values, self.count).astype(np.int64)
        if self.name == "heading":
            turn = np.mod(values / (2.0 * np.pi) + 0.5 + 0.5 / SECTORS, 1.0)
            place = np.floor(np.where(np.isfinite(turn), turn, 0.0) * SECTORS)
        else:
            place = np.searchsorted(self.edges, values, side="right")
        return np.where(np.isfinite(values), np.minimum(place, self.count - 1), self.count).astype(
            np.int64
        )

    def middle(self, sums: Array, rows: Array) -> list[Any]:
        """x of every bin: its label, the middle of a sector, or the mean of its rows."""
        if self.labels:
            return list(self.labels)
        if self.name == "heading":
            return [float(a) for a in (np.arange(SECTORS) / SECTORS - 0.5) * 2.0 * np.pi]
        return [float(v) for v in sums / np.maximum(rows, 1.0)]


def curve_bins(axes: Mapping[str, Array], surfaces: Sequence[str]) -> Iterator[CurveBins]:
    """Bins of every axis that varies in a sample, and of the grounds.

    Args:
        axes: values by name, each (n,), the ground included.
        surfaces: names of the grounds.
    """
    for name in (*AXES, *FURTHER):
        known = axes[name][np.isfinite(axes[name])]
        if len(known) < 2:
            continue
        if name == "heading":
            turned = np.abs(np.angle(np.exp(1j * (known - known[0]))))
            if float(np.quantile(turned, 0.98)) > np.pi / SECTORS:
                yield CurveBins(name, np.zeros(0))
            continue
        low, high = np.quantile(known, [0.01, 0.99])
        unit = np.pi / 180.0 if WORDS[name].degrees else 1.0
        if high - low < WORDS[name].least * unit:
            continue
        edges = np.quantile(known, np.arange(1, CURVE_BINS) / CURVE_BINS)
        # Several quantiles within a cluster of equal values would cut it into noise.
        kept = [float(edges[0])]
        for edge in edges[1:]:
            if edge - kept[-1] > (high - low) / (4.0 * CURVE_BINS):
                kept.append(float(edge))
        yield CurveBins(name, np.array(kept))
    if len(surfaces) > 1:
        yield CurveBins("surface", np.zeros(0), tuple(surfaces))


class Sums:
    """Sums of a residual over a log that passes by once, in order.

    Args:
        runs: number of runs.
        regimes: whose figures are to be those of the whole log.
        bins: of the curves.
        temperature: the quantity that stands for it, see motion_axes.
        run: (n,) runs of the sample.
        residual: (n,) W of the sample; its correlation says how long a block is.
    """

    def __init__(
        self,
        runs: int,
        regimes: Sequence[Regime],
        bins: Sequence[CurveBins],
        temperature: str,
        run: Integers,
        residual: Array,
    ) -> None:
        self.not_computed = 0
        self._regimes, self._bins, self._temperature = regimes, bins, temperature
        self._by_run = np.zeros((runs, 5))  # rows, r, r², measured J, predicted J
        self._absolute = 0.0
        self._power = np.zeros(3)  # rows, mean, sum of squares about the mean
        self._of_regime = np.zeros((len(regimes), 3))  # rows, r, r²
        self._curves = [_Curve(one.count) for one in bins]
        means = np.bincount(run, residual) / np.maximum(np.bincount(run), 1)
        self._block = 0 if runs >= ENOUGH_RUNS else cluster_length(residual - means[run], run)
        self._last_run, self._rows_of_run = -1, 0

    def add(self, chunk: Telemetry, watts: Array) -> None:
        """Take in the next chunk with the power that the model predicts, (n,) W."""
        finite = np.isfinite(watts)
        self.not_computed += int(np.count_nonzero(~finite))
        if not finite.all():
            chunk, watts = chunk.take(finite), watts[finite]
        if not len(chunk):
            return
        residual = chunk.power - watts
        squares = residual * residual
        joules = chunk.power * chunk.interval, watts * chunk.interval
        columns = (np.ones(len(chunk)), residual, squares, *joules)
        for number, column in enumerate(columns):
            self._by_run[:, number] += np.bincount(chunk.run, column, len(self._by_run))
        self._absolute += float(np.abs(residual).sum())
        self._add_power(chunk.power)
        axes = all_axes(chunk.rows, watts=watts, temperature=self._temperature)
        for number, regime in enumerate(self._regimes):
            met = regime.holds(axes)
            self._of_regime[number] += met.sum(), residual[met].sum(), squares[met].sum()
        cluster = self._clusters(chunk.run)
        for bins, curve in zip(self._bins, self._curves, strict=True):
            values = axes[bins.name]
            curve.add(bins.place(values), cluster, residual, values)

    def _add_power(self, power: Array) -> None:
        """Chan, Golub and LeVeque's update: no digits are lost, however large the mean."""
        rows, mean, spread = self._power
        more, here = len(power), float(power.mean())
        total = rows + more
        self._power[:] = (
            total,
            mean + (here - mean) * more / total,
            spread + float(((power - here) ** 2).sum()) + (here - mean) ** 2 * rows * more / total,
        )

    def _clusters(self, run: Integers) -> Integers:
        """Number of the cluster of every row, going on from the chunk before."""
        new = np.concatenate([[run[0] != self._last_run], np.diff(run) != 0])
        starts = np.flatnonzero(new)
        number = np.cumsum(new)
        # Rows since the run began, those of earlier chunks included.
        since = np.arange(len(run)) - np.concatenate([[-self._rows_of_run], starts])[number]
        self._last_run, self._rows_of_run = int(run[-1]), int(since[-1]) + 1
        if not self._block:
            return number.astype(np.int64)
        return np.cumsum(new | (since % self._block == 0)).astype(np.int64)

    @property
    def mae_w(self) -> float:
        """Mean of the residual's magnitude, W."""
        return self._absolute / float(self._power[0])

    @property
    def r2(self) -> float | None:
        """Share of the measured power's variance that the model explains; None without any."""
        variance = float(self._power[2])
        return 1.0 - float(self._by_run[:, 2].sum()) / variance if variance > 0.0 else None

    def whole(self) -> RunComparison:
        """All rows together."""
        return _compared("", self._by_run.sum(axis=0))

    def by_run(self, names: Sequence[str]) -> tuple[RunComparison, ...]:
        """Every run that has rows, by its label."""
        pairs = zip(names, self._by_run, strict=True)
        return tuple(_compared(name, one) for name, one in pairs if one[0] > 0.0)

    def regimes(self) -> list[Regime]:
        """The regimes with the figures of the whole log."""
        total = float(self._by_run[:, 2].sum())
        return [
            replace(
                regime,
                rows=int(rows),
                bias_w=float(plain / rows),
                rmse_w=float(np.sqrt(squares / rows)),
                share_of_squared_error=float(squares / total),
                explained=float(plain * plain / rows / total),
            )
            for regime, (rows, plain, squares) in zip(self._regimes, self._of_regime, strict=True)
            if rows > 0.0 and total > 0.0
        ]

    def curves(self) -> dict[str, dict[str, list[Any]]]:
        """Mean residual over every axis, see Comparison.curves."""
        return {
            bins.name: curve.lists(bins)
            for bins, curve in zip(self._bins, self._curves, strict=True)
        }


def _compared(name: str, sums: Array) -> RunComparison:
    rows, plain, squares, measured, predicted = (float(value) for value in sums)
    return RunComparison(
        name, int(rows), measured, predicted, float(np.sqrt(squares / rows)), plain / rows
    )


class _Curve:
    """Sums of one curve; the cluster that the next chunk may go on with stays open."""

    def __init__(self, count: int) -> None:
        self._rows, self._sums, self._values = np.zeros((3, count))
        self._open = np.zeros((2, count))  # rows and sums of the open cluster
        # Σ s², Σ s·n and Σ n² over clusters give the error of Σ s / Σ n; and how many clusters.
        self._products = np.zeros((4, count))

    def add(self, place: Integers, cluster: Integers, residual: Array, values: Array) -> None:
        """Rows of a chunk: bins, clusters counted from the open one, W, values; each (n,)."""
        count, clusters = len(self._rows), int(cluster[-1]) + 1
        known = place < count
        place, residual = place[known], residual[known]
        self._values += np.bincount(place, values[known], count)
        cell, size = cluster[known] * count + place, clusters * count
        ones = np.ones(len(cell))
        rows = np.bincount(cell, ones, size).astype(float).reshape(clusters, count)
        sums = np.bincount(cell, residual, size).astype(float).reshape(clusters, count)
        self._rows += rows.sum(axis=0)
        self._sums += sums.sum(axis=0)
        rows[0] += self._open[0]
        sums[0] += self._open[1]
        self._close(rows[:-1], sums[:-1])
        self._open[:] = rows[-1], sums[-1]

    def _close(self, rows: Array, sums: Array) -> None:
        self._products += (
            (sums * sums).sum(axis=0),
            (sums * rows).sum(axis=0),
            (rows * rows).sum(axis=0),
            (rows > 0.0).sum(axis=0),
        )

    def lists(self, bins: CurveBins) -> dict[str, list[Any]]:
        """x, bias, its standard error and the number of rows of every bin that has any."""
        self._close(self._open[:1], self._open[1:])
        self._open[:] = 0.0
        x = bins.middle(self._values, self._rows)
        bias = self._sums / np.maximum(self._rows, 1.0)
        squares, mixed, rows, clusters = self._products
        error = np.maximum(squares - 2.0 * bias * mixed + bias * bias * rows, 0.0)
        error *= clusters / np.maximum(clusters - 1.0, 1.0)
        stderr = np.sqrt(error) / np.maximum(self._rows, 1.0)
        kept = np.flatnonzero(self._rows)
        return {
            "x": [x[k] for k in kept],
            "bias_w": [float(bias[k]) for k in kept],
            "stderr_w": [float(stderr[k]) if clusters[k] > 1.0 else None for k in kept],
            "rows": [int(self._rows[k]) for k in kept],
        }
