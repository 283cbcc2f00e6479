"""Measured power against a model's: how far apart, in which regimes, and how much of it is noise.

    found = compare("drive.csv", "minibalance")     # base model of the vehicle, fitted to the log
    found = compare("drive.csv", model)             # a model as it is
    print(found.rmse_w, found.noise_floor_w)
    for regime in found.regimes: print(regime.sentence)
    found.to_json()

Residuals are measured minus predicted, as everywhere: positive where the robot needs more than the
model says. Energies are told the other way round, as one speaks of a prediction: ``error_share``
-0.03 is 3 % predicted too little.

The model is asked about steady drives at their mean speeds
(planner.telemetry.sampling.steady_drive), as in a diagnosis; regimes and curves lie over the speeds
as logged.

A log of any length passes by in chunks and is added up by run, by regime and by bins of the curves.
What cannot be added up is settled on the sample (planner.telemetry.sampling.sample): the fit, its
error on held-out runs, the noise, and which regimes there are.

Left out
    wheel currents: power alone is compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.progress import Progress
from planner.quantities import INDEX
from planner.shown import Shown
from planner.telemetry.comparison.sums import CurveBins, RunComparison, Sums, curve_bins
from planner.telemetry.estimation import FittedParameter, RefusedFit
from planner.telemetry.holdout import base_fit, heldout_rmse
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise, noise_of
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import Nodes, doubt_of, predict, tangent
from planner.telemetry.quantities_of_motion import (
    FURTHER,
    all_axes,
    temperature_of,
)
from planner.telemetry.regimes import Regime, find_regimes
from planner.telemetry.sampling import LogSource, at_steady_speeds, open_source
from planner.telemetry.starting_model import starting_model

CLOUD = 2000
"""Points of ``measured`` and ``predicted``: as many as a picture can show."""
HELPERS = 4
_WORTH = 0.01  # share of what is left that a helper must take


@dataclass(frozen=True, eq=False)
class Comparison(Shown):
    """How well a model tells the power of a log.

    Attributes:
        model: the model compared; with ``fitted`` the vehicle's base model, fitted to this log.
        fitted: whether it was.
        parameters: of that fit.
        log: source, size and findings, as in JSON.
        whole: all rows together.
        mae_w, r2: of all rows; R² is None when the measured power never changes.
        heldout_rmse_w: W on runs that the fit has not seen; as ``rmse_w`` without a fit.
        noise_floor_w: W rms that no model can go below, about.
        runs: every run.
        regimes: where the model is off, the largest share of the squared error first.
        curves: axis or "surface" → {"x", "bias_w", "stderr_w", "rows"}, lists of equal length; x in
            SI or labels, a standard error None where it cannot be told.
        measured, predicted: (k,) W of rows spread over the log, k <= CLOUD.
        not_computed: rows for which the model gives no finite power; they count nowhere.
        refused: None; where the model as stated beats its fit on held-out runs, both errors.
    """

    model: PowerModel
    fitted: bool
    parameters: tuple[FittedParameter, ...]
    log: dict[str, Any]
    whole: RunComparison
    mae_w: float
    r2: float | None
    heldout_rmse_w: float
    noise_floor_w: float
    runs: tuple[RunComparison, ...]
    regimes: tuple[Regime, ...]
    curves: dict[str, dict[str, list[Any]]]
    measured: Array
    predicted: Array
    not_computed: int
    refused: RefusedFit | None = None

    @property
    def rmse_w(self) -> float:
        """Root mean square of measured minus predicted, W."""
        return self.whole.rmse_w

    @property
    def bias_w(self) -> float:
        """Mean of measured minus predicted, W."""
        return self.whole.bias_w

    def to_json(self) -> dict[str, Any]:
        """The document of ``joulepath compare --json``, strict JSON."""
        return {
            "model": self.model.describe(),
            "fitted": self.fitted,
            "refused_fit": None if self.refused is None else self.refused.to_json(),
            "log": self.log,
            "rmse_w": self.rmse_w,
            "mae_w": self.mae_w,
            "bias_w": self.bias_w,
            "r2": self.r2,
            "heldout_rmse_w": self.heldout_rmse_w,
            "noise_floor_w": self.noise_floor_w,
            "energy": self.whole.energy(),
            "runs": [
                {
                    "run": one.run,
                    "rows": one.rows,
                    **one.energy(),
                    "rmse_w": one.rmse_w,
                    "bias_w": one.bias_w,
                }
                for one in self.runs
            ],
            "regimes": [regime.to_json() for regime in self.regimes],
        }


def compare(
    log: Telemetry | str | Path,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: str | Path | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Comparison:
    """Compare a log with a model.

    Args:
        log: what Telemetry.read gave, or a path as it takes; of any length.
        model: a model, taken as it is; or a vehicle, by name or file, whose base model is fitted
            to the log first.
        mapping: a mapping file for other names, units and signs.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked between the steps.

    Raises:
        LogError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` said so.
    """
    watch = CancellationToken(cancelled).watched(progress)
    watch(0.0, "reading the log")
    start = starting_model(model)
    source = open_source(log, mapping, watch)
    settled = _settle(source.sample, start, not isinstance(model, PowerModel), watch)
    sums = _add_up(source, settled, watch)
    whole = sums.whole()
    share = settled.heldout / settled.rmse if settled.rmse > 0.0 else 1.0
    watch(1.0, "compared")
    return Comparison(
        settled.model,
        settled.fitted,
        settled.parameters,
        _described(source, sums.not_computed),
        whole,
        sums.mae_w,
        sums.r2,
        # The sample tells by how much runs that were not seen are worse.
        whole.rmse_w * share,
        settled.noise.floor_w,
        sums.by_run(source.sample.run_names),
        tuple(sorted(sums.regimes(), key=lambda regime: -regime.share_of_squared_error)),
        sums.curves(),
        settled.measured,
        settled.predicted,
        sums.not_computed,
        settled.refused,
    )


@dataclass(frozen=True, eq=False)
class _Settled:
    """What the sample tells."""

    model: PowerModel
    fitted: bool
    parameters: tuple[FittedParameter, ...]
    refused: RefusedFit | None
    rmse: float
    heldout: float
    noise: Noise
    regimes: tuple[Regime, ...]
    bins: tuple[CurveBins, ...]
    temperature: str
    measured: Array
    predicted: Array
    residual: Array
    run: NDArray[np.int64]


def _settle(sample: Telemetry, model: PowerModel, fitted: bool, watch: Progress) -> _Settled:
    parameters: tuple[FittedParameter, ...] = ()
    refused: RefusedFit | None = None
    heldout = None
    calm = at_steady_speeds(sample)
    if fitted:
        watch(0.3, "fitting the base model")
        result = base_fit(calm, model)
        model, parameters, refused = result.model, result.parameters, result.refused
        watch(0.45, "predicting held-out runs")
        heldout = heldout_rmse(calm, result)
    watch(0.5, "telling noise from misfit")
    watts = predict(model, calm)
    finite = np.isfinite(watts)
    if not finite.any():
        raise ModelError(
            model.name,
            "gives no finite power for any row of the log",
            accepted="a model whose parameters are all numbers",
        )
    if not finite.all():
        sample, calm, watts = sample.take(finite), calm.take(finite), watts[finite]
    residual = sample.power - watts
    rmse = float(np.sqrt(np.mean(residual**2)))
    noise, spread = _noise(calm, model, watts)
    watch(0.6, "looking for regimes")
    temperature = temperature_of(sample.rows)
    axes = all_axes(sample.rows, temperature=temperature)
    regimes = find_regimes(axes, residual, sample.run, spread, surfaces=sample.surfaces)
    thin = np.unique(np.linspace(0, len(sample) - 1, CLOUD).astype(int))
    return _Settled(
        model,
        fitted and refused is None,
        parameters,
        refused,
        rmse,
        rmse if heldout is None else heldout,
        noise,
        tuple(regimes),
        tuple(curve_bins(axes, sample.surfaces)),
        temperature,
        sample.power[thin],
        watts[thin],
        residual,
        sample.run,
    )


def _noise(sample: Telemetry, model: PowerModel, watts: Array) -> tuple[Noise, Array]:
    """Noise of a log, whatever the model lacks, and its spread (n,) W.

    Parameters of the model and a few shapes over the axes of motion may take what they explain, so
    that misfit does not count as noise.
    """
    rows = sample.rows_for(model.surfaces)
    nodes = Nodes.of(sample, model)
    _, own = tangent(model, nodes, free_places(model, sample))
    shapes = Dictionary.of(sample).columns(sample.rows)
    ground = sample.rows[:, INDEX["surface"]]
    grounds = [ground == number for number in range(len(sample.surfaces))]
    others = np.column_stack([shapes, *_further(sample.rows), *grounds]).astype(float)
    others = others[:, np.isfinite(others).all(axis=0)]
    residual, doubt = sample.power - watts, doubt_of(model, rows)
    columns = np.column_stack([own, others[:, _helpers(residual, own, others)]])
    noise = noise_of(sample, residual, watts, doubt, columns)
    return noise, noise.spread(watts, doubt)


def _further(rows: Array) -> list[Array]:
    """Plain columns over wind, place of the load, sampling rate …, alone and times the speed."""
    axes = all_axes(rows)
    speed = axes["speed"]
    columns = []
    for values in (axes[name] for name in FURTHER):
        bent = values * np.abs(values)
        columns += [values, values * speed, bent, bent * speed]
    return columns


def _helpers(residual: Array, own: Array, others: Array) -> list[int]:
    """Up to HELPERS of the other columns that take most of what the model's own leave over."""
    basis, _ = np.linalg.qr(own)
    before = np.linalg.norm(others, axis=0)
    left = residual - basis @ (basis.T @ residual)
    rest = others - basis @ (basis.T @ others)
    chosen: list[int] = []
    for _ in range(HELPERS):
        norms = np.linalg.norm(rest, axis=0)
        # What hardly differs from the model's own columns says nothing of its own.
        usable = norms > 0.03 * np.maximum(before, 1e-300)
        taken = np.where(usable, np.abs(rest.T @ left) / np.maximum(norms, 1e-300), 0.0)
        best = int(np.argmax(taken))
        if taken[best] ** 2 < _WORTH * float(left @ left):
            break
        chosen.append(best)
        direction = rest[:, best] / norms[best]
        left = left - direction * float(direction @ left)
        rest = rest - np.outer(direction, direction @ rest)
    return chosen


def _add_up(source: LogSource, settled: _Settled, watch: Progress) -> Sums:
    sums = Sums(
        len(source.run_rows),
        settled.regimes,
        settled.bins,
        settled.temperature,
        settled.run,
        settled.residual,
    )
    done = 0
    for chunk in source.chunks():
        watch(0.65 + 0.35 * done / source.rows, f"comparing {source.rows:,} rows")
        sums.add(chunk, predict(settled.model, at_steady_speeds(chunk)))
        done += len(chunk)
    return sums


def _described(source: LogSource, not_computed: int) -> dict[str, Any]:
    document = source.describe()
    if not_computed:
        sentence = (
            f"the model gives no finite power for {not_computed:,} of {source.rows:,} rows; "
            "they are left out"
        )
        document["report"] = [
            *document["report"],
            {"kind": "not computed", "column": "", "rows": not_computed, "sentence": sentence},
        ]
    return document
