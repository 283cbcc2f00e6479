"""Compare measured power with a model's: errors, regimes, and the share that is noise.

    found = compare("drive.csv", "minibalance")     # base model of the vehicle, fitted to the log
    found = compare("drive.csv", model)             # a model as it is
    print(found.rmse_w, found.noise_floor_w)
    for regime in found.regimes: print(regime.sentence)
    found.to_json()

Residuals are measured minus predicted, as everywhere: positive where the robot needs more than the
model says. Energies have the opposite sign, that of a prediction: ``error_share`` -0.03 is 3 %
predicted too little.

The model predicts steady-state segments at their mean speeds
(planner.telemetry.sampling.steady_drive), as in a diagnosis. Regimes and curves use the speeds as
logged.

A log of any length passes by in chunks and is added up by run, by regime and by bins of the curves.
The sample (planner.telemetry.sampling.sample) settles what cannot be added up: the fit, its
held-out error, the noise, and which regimes there are.

Left out
    wheel currents: power alone is compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.progress import Progress
from planner.quantities import INDEX
from planner.shown import Shown, frame
from planner.telemetry.as_measured import as_measured
from planner.telemetry.belonging import apart, beyond_motors
from planner.telemetry.comparison.sums import RunComparison, Sums, curve_bins
from planner.telemetry.estimation import FittedParameter, RefusedFit, followed_motions
from planner.telemetry.holdout import (
    heldout_residual,
    meter_beside,
    metered_base_fit,
    overall_error,
    rms,
)
from planner.telemetry.logs import Finding, LogLike, MappingLike, Meter, Telemetry
from planner.telemetry.noise import Noise, noise_of, strongest_columns
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import Nodes, Readings, input_uncertainty, predict, tangent
from planner.telemetry.quantities_of_motion import (
    all_axes,
    further_axes,
    motion_axes,
    temperature_of,
)
from planner.telemetry.regimes import Regime, find_regimes
from planner.telemetry.sampling import LogSource, open_source
from planner.telemetry.single_core import single_core
from planner.telemetry.starting_model import is_model, starting_model
from planner.telemetry.tilt_filter import with_true_tilt

if TYPE_CHECKING:
    import pandas

CLOUD = 2000
"""Points of ``measured`` and ``predicted``: as many as a picture can show."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparedModel:
    """The model of a comparison, settled on a sample of the log.

    Attributes:
        model: the model compared; with ``fitted`` the vehicle's base model, fitted to this log.
        fitted: whether it was.
        parameters: of that fit.
        refused: None; where the model as stated beats its fit on held-out runs, both errors.
        noise_floor_w: W rms, about the error of a perfect model.
        meter: what the power was read from; None shows the power as it is.
        apart: what does not belong together in the log, in clauses.
        measured, predicted: (k,) W of rows spread over the log, k <= CLOUD.
    """

    model: PowerModel
    fitted: bool
    parameters: tuple[FittedParameter, ...]
    refused: RefusedFit | None = None
    noise_floor_w: float
    meter: Meter | None = None
    apart: tuple[str, ...] = ()
    measured: Array
    predicted: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison(ComparedModel, Shown):
    """How well a model predicts the power of a log.

    Attributes:
        log: source, size and findings, as in JSON.
        whole: all rows together.
        mae_w, r2: of all rows; R² is None when the measured power never changes.
        heldout_rmse_w: W on runs that the fit has not seen; as ``rmse_w`` without a fit.
        runs: every run.
        regimes: where the model is off, the largest share of the squared error first.
        curves: axis or "surface" → {"x", "bias_w", "stderr_w", "rows"}, lists of equal length; x in
            SI or labels, a standard error None where there are too few rows.
        not_computed: rows for which the model gives no finite power; they count nowhere.
    """

    log: dict[str, Any]
    whole: RunComparison
    mae_w: float
    r2: float | None
    heldout_rmse_w: float
    runs: tuple[RunComparison, ...]
    regimes: tuple[Regime, ...]
    curves: dict[str, dict[str, list[Any]]]
    not_computed: int

    @property
    def rmse_w(self) -> float:
        """Root mean square of measured minus predicted, W."""
        return self.whole.rmse_w

    @property
    def bias_w(self) -> float:
        """Mean of measured minus predicted, W."""
        return self.whole.bias_w

    def to_frame(self) -> pandas.DataFrame:
        """The regimes as a DataFrame, the largest share of the squared error first.

        Columns are those of ``regimes`` in the JSON document: ``where``, ``rows``, ``bias_w``, …
        """
        names = [one.name for one in fields(Regime) if one.name not in ("explained", "chance")]
        return frame((regime.to_json() for regime in self.regimes), names)

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
            "meter": None if self.meter is None else self.meter.to_json(),
            "apart": list(self.apart),
            "energy": self.whole.energy(),
            "runs": [{**asdict(one), **one.energy()} for one in self.runs],
            "regimes": [regime.to_json() for regime in self.regimes],
        }


@single_core()
def compare(
    log: LogLike,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: MappingLike | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Comparison:
    """Compare a log with a model.

    Args:
        log: what Telemetry.read gave, or what it takes: a path, a DataFrame; of any length.
        model: a model or its .json file, taken as it is; or a vehicle, by name or file, whose base
            model is fitted to the log first.
        mapping: a mapping file for other names, units and signs, or its content.
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
    source = source.with_findings(beyond_motors(source.sample, start))
    fitted = not is_model(model)
    source = as_measured(source, start)
    source = with_true_tilt(source, start, settled=not fitted)
    reading = _reading(source, start, fitted)
    settled, reading, sums, share = _settle(source, reading, start, fitted, watch)
    done = 0
    for chunk in source.chunks():
        watch(0.65 + 0.35 * done / source.rows, f"comparing {source.rows:,} rows")
        read = reading.reading.of(chunk)
        sums.add(chunk, predict(settled.model, replace(read, meter=reading.sample.meter)))
        done += len(chunk)
    whole = sums.whole()
    watch(1.0, "compared")
    return Comparison(
        **vars(settled),
        log=_described(source, sums.not_computed),
        whole=whole,
        mae_w=sums.mae_w,
        r2=sums.r2,
        heldout_rmse_w=whole.rmse_w * share,
        runs=sums.by_run(source.sample.run_names),
        regimes=tuple(sorted(sums.regimes(), key=lambda regime: -regime.share_of_squared_error)),
        curves=sums.curves(),
        not_computed=sums.not_computed,
    )


def _reading(source: LogSource, model: PowerModel, fitted: bool) -> LogSource:
    """The log as usual, or with the motion that its power follows, where the model errs less."""

    def error(reading: LogSource) -> float:
        if fitted:
            return overall_error(*metered_base_fit(reading.sample, model))
        log = meter_beside(reading.sample, model)
        return rms(log.power - predict(model, log))

    usual = source.steady()
    followed = followed_motions(source, model, settled=not fitted)
    return followed[0] if followed and error(followed[0]) < error(usual) else usual


def _settle(
    source: LogSource, reading: LogSource, model: PowerModel, fitted: bool, watch: Progress
) -> tuple[ComparedModel, LogSource, Sums, float]:
    """The model, the reading with its meter, empty sums, and the held-out error over the error."""
    sample = source.sample
    parameters: tuple[FittedParameter, ...] = ()
    refused: RefusedFit | None = None
    unseen: Array | None = None
    steady = reading.sample
    if fitted:
        watch(0.3, "fitting the base model")
        steady, result = metered_base_fit(steady, model)
        model, parameters, refused = result.model, result.parameters, result.refused
        watch(0.45, "predicting held-out runs")
        unseen = heldout_residual(steady, result)
    watch(0.5, "separating noise from misfit")
    watts = predict(model, steady)
    finite = np.isfinite(watts)
    if not finite.any():
        raise ModelError(
            model.name,
            "gives no finite power for any row of the log",
            accepted="a model whose parameters are all numbers",
        )
    if not finite.all():
        sample, steady, watts = sample.take(finite), steady.take(finite), watts[finite]
    if not fitted:
        steady = meter_beside(steady, model)
        watts = predict(model, steady)
    residual = sample.power - watts
    rmse = float(np.sqrt(np.mean(residual**2)))
    noise, spread = _noise(steady, model, watts)
    watch(0.6, "looking for regimes")
    temperature = temperature_of(sample.rows)
    axes = all_axes(sample.rows, watts=watts, temperature=temperature)
    regimes = find_regimes(axes, residual, sample.run, spread, sample.surfaces)
    bins = tuple(curve_bins(axes, sample.surfaces))
    sums = Sums(len(source.run_rows), regimes, bins, temperature, sample.run, residual)
    cloud = np.unique(np.linspace(0, len(sample) - 1, CLOUD).astype(int))
    settled = ComparedModel(
        model=model,
        fitted=fitted and refused is None,
        parameters=parameters,
        refused=refused,
        noise_floor_w=noise.floor_w,
        meter=steady.meter_as_logged,
        apart=apart(steady, residual if unseen is None else unseen[finite], model),
        measured=sample.power[cloud],
        predicted=watts[cloud],
    )
    share = rms(unseen) / rmse if unseen is not None and rmse > 0.0 else 1.0
    return settled, reading.with_meter(steady.meter), sums, share


def _noise(sample: Telemetry, model: PowerModel, watts: Array) -> tuple[Noise, Array]:
    """Noise of a log, whatever the model lacks, and its spread (n,) W.

    Parameters of the model and a few shapes over the axes of motion may take what they explain, so
    that misfit does not count as noise.
    """
    rows = sample.rows_for(model.surfaces)
    nodes = Nodes.of(sample, model)
    _, own = tangent(model, nodes, free_places(model, sample))
    shapes = Readings.as_shown(sample, Dictionary.of(sample).columns(sample.rows))
    ground = sample.rows[:, INDEX["surface"]]
    grounds = [ground == number for number in range(len(sample.surfaces))]
    others = np.column_stack([shapes, *_further(sample.rows), *grounds]).astype(float)
    others = others[:, np.isfinite(others).all(axis=0)]
    residual, input_error = sample.power - watts, input_uncertainty(model, rows)
    columns = np.column_stack([own, others[:, strongest_columns(residual, own, others)]])
    noise, _ = noise_of(sample, residual, watts, input_error, columns)
    return noise, noise.spread(watts, input_error)


def _further(rows: Array) -> list[Array]:
    """Plain columns over wind, place of the load, sampling rate …, alone and times the speed."""
    speed = motion_axes(rows)["speed"]
    columns = []
    for values in further_axes(rows).values():
        bent = values * np.abs(values)
        columns += [values, values * speed, bent, bent * speed]
    return columns


def _described(source: LogSource, not_computed: int) -> dict[str, Any]:
    document = source.describe()
    if not_computed:
        rows = f"{not_computed:,} of {source.rows:,} rows"
        text = f"the model gives no finite power for {rows}; they are left out"
        document["report"].append(asdict(Finding("not computed", "", not_computed, text)))
    return document
