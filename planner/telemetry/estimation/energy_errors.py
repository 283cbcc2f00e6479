"""Uncertainty of the energies that a fitted model predicts, calibrated on held-out runs.

    covariance, error = energy_error(log, fitted)
    replace(fitted.model, covariance=covariance, energy_error=error)

Two things make a predicted energy differ from the one that is measured on the next drive. The
parameters are known no better than the log determines them; and a measured energy has noise, which
averages out along a drive only in part (planner.power.saved.energy_error).

Covariance
    A sandwich over clusters of rows, H⁻¹·(S·Sᵀ + Λ·Σ·Λ)·H⁻¹ with H = J'J + Λ, J the whitened
    derivatives of the free parameters, S the sums of the score over blocks, Λ the fit's own wide
    prior and Σ what the declarations state: a parameter that the log says nothing about is known as
    well as its declaration, not as badly as the fit's prior. Parameters that are never fitted
    (the torque constant, beside which the resistance is) are uncertain too, and the fitted ones
    have made up for their error: they are *considered* (S. F. Schmidt, Application of state-space
    methods to navigation problems, 1966), which gives them their spread and the covariance with
    the others that follows from H.

Calibration
    Folds of whole runs are left out in turn. The fit without a fold, by one Gauss-Newton step, has
    a covariance of its own and predicts the energies of its runs with a standard deviation s. The
    errors e of all held-out energies give the scale

        scale² = (k·s₀² + n·mean(e²/s²))/(k + n)    k = PRIOR_RUNS, s₀ = PRIOR_SCALE,
                                                    n held-out runs

    and the interval is Student's with k + n/2 degrees of freedom: half of them, because errors of
    runs that share a fit are neither independent nor normal, and a few runs make up most of their
    scatter. Few runs thus move the scale a little and leave wide tails; many runs decide it.

Left out
    that effects were chosen with the same log: a wrong choice shows in the held-out energies only
    as far as the log's own runs show it;
    a sensor's error for which a diagnosis corrected the log: energies are those of right sensors;
    standing on a slope, where friction or the motors may hold the robot: an energy that is mostly
    such rows is less well known than told;
    what the log does not cover: a model fitted on a level floor has learnt nothing about slopes,
    beyond what its parameters' declarations say. ``covered`` says how far the log goes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.power.model import PowerModel
from planner.power.saved import Covered, EnergyError, ParameterCovariance
from planner.telemetry.estimation.model_fit import Fit
from planner.telemetry.estimation.parameter_errors import inverse_of
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import Nodes, tangent
from planner.telemetry.quantities_of_motion import motion_axes
from planner.telemetry.sampling import cluster_numbers

PRIOR_RUNS = 4.0
"""Held-out runs that the usual scale counts for."""
PRIOR_SCALE = 1.5
"""Usual scale, from virtual robots: runs differ by more than their rows show."""
FOLDS = 5
"""Parts of the log, of which each is held out in turn."""
COVERED_SHARE = 0.99
"""Share of a log's rows below what it is said to cover: single rows of noise teach nothing."""
SUBSTITUTE_RUNS = 20
"""Stretches of rows that stand in for runs where the log has only one."""


def energy_error(log: Telemetry, fitted: Fit) -> tuple[ParameterCovariance, EnergyError]:
    """Covariance of a fitted model's parameters, and the error of energies that it predicts.

    Args:
        log: the rows that the model was fitted to.
        fitted: of ``fit`` or ``fit_with`` on these rows.
    """
    sums = _Sums(log, fitted)
    everything = np.ones(sums.blocks, bool)
    values = sums.covariance(everything)
    names = fitted.model.parameter_names
    covariance = ParameterCovariance(tuple(names[place] for place in sums.places), values)
    noise = fitted.noise
    curve = tuple(noise.powers.tolist()), tuple((noise.spreads * _outlying(fitted)).tolist())
    offset, gain = np.sqrt(np.maximum(np.diag(noise.by_run), 0.0)).tolist()
    time = _correlation_time(noise, float(np.median(log.interval)))
    covered = covered_by(log)
    unscaled = EnergyError(*curve, time, offset, gain, 1.0, PRIOR_RUNS, 0, covered)
    return covariance, _calibrated(unscaled, log, fitted, sums)


def covered_by(log: Telemetry) -> Covered:
    """How fast, how steep and how loaded the drives of a log are."""
    axes = motion_axes(log.rows)
    speed, slope, payload = (
        float(np.quantile(np.abs(axes[name]), COVERED_SHARE))
        for name in ("speed", "slope_along", "load")
    )
    return Covered(speed, slope, payload)


class _Sums:
    """Derivatives of a fitted model on its log, whitened, and added up over blocks of rows."""

    def __init__(self, log: Telemetry, fitted: Fit) -> None:
        model = fitted.model
        free = list(fitted.places)
        declared = _declared_spreads(model)
        considered = [
            place for place in range(len(declared)) if declared[place] > 0.0 and place not in free
        ]
        self.places = [*free, *considered]
        self.free = len(free)
        self.prior = Prior.of(model, free)
        self.stated = declared[considered]
        nodes = Nodes.of(log, model)
        _, self.columns = tangent(model, nodes, self.places)
        white = fitted.whitened(log, self.columns)
        self.units, self.folds = _held_out(log)
        # No cluster lies in two folds, so that a fold can be left out of the sums.
        _, number = np.unique(self.folds * (10**9) + cluster_numbers(log), return_inverse=True)
        self.blocks = int(number.max()) + 1
        self.fold_of = np.zeros(self.blocks, np.int64)
        self.fold_of[number] = self.folds
        own, rest = white[:, : self.free], white[:, -1]
        self.scores = np.zeros((self.blocks, self.free))
        np.add.at(self.scores, number, own * rest[:, None])
        self.grams = {
            int(fold): own[self.folds == fold].T @ white[self.folds == fold, :-1]
            for fold in np.unique(self.folds)
        }

    def _normal(self, kept: Mask) -> tuple[Array, Array]:
        """Inverse of H, and what an error of the considered parameters does to the free ones."""
        folds = np.unique(self.fold_of[kept])
        gram = np.sum([self.grams[int(fold)] for fold in folds], axis=0)
        full = gram[:, : self.free] + np.diag(self.prior.weights**2)
        inverse = inverse_of(full, 1e-12)
        return inverse, -inverse @ gram[:, self.free :]

    def covariance(self, kept: Mask) -> Array:
        """(k, k) of ``places``, from the rows of some blocks."""
        inverse, follows = self._normal(kept)
        sums = self.scores[kept]
        share = np.sqrt(len(sums) / max(len(sums) - self.free, 1))
        stated = np.diag(self.prior.declared)
        own = inverse @ np.concatenate([share * sums.T, stated], axis=1)
        fixed = np.zeros((len(self.stated), own.shape[1]))
        both = np.concatenate([follows, np.eye(len(self.stated))]) * self.stated
        # A product with its own transpose has no negative variance, however ill-conditioned H is.
        root = np.concatenate([np.concatenate([own, fixed]), both], axis=1)
        values: Array = root @ root.T
        return 0.5 * (values + values.T)

    def without(self, fold: int) -> tuple[Array, Array]:
        """Change of the free parameters when a fold is left out, and their covariance then."""
        kept = self.fold_of != fold
        inverse, _ = self._normal(kept)
        return -inverse @ self.scores[~kept].sum(axis=0), self.covariance(kept)


def _calibrated(unscaled: EnergyError, log: Telemetry, fitted: Fit, sums: _Sums) -> EnergyError:
    errors, variances = [], []
    for fold in np.unique(sums.folds):
        change, covariance = sums.without(int(fold))
        for unit in np.unique(sums.units[sums.folds == fold]):
            rows = sums.units == unit
            seconds = log.interval[rows]
            slopes = seconds @ sums.columns[rows]
            errors.append(float(seconds @ fitted.residual[rows]) - slopes[: sums.free] @ change)
            noise = unscaled.noise_variance(fitted.watts[rows], seconds)
            variances.append(float(slopes @ covariance @ slopes) + noise)
    ratios = np.array(errors) ** 2 / np.maximum(variances, 1e-300)
    # Stretches of one run say little about the next run.
    runs = len(np.unique(log.run))
    count = float(runs if runs > 1 else 1)
    seen = count * float(np.mean(ratios))
    scale = np.sqrt((PRIOR_RUNS * PRIOR_SCALE**2 + seen) / (PRIOR_RUNS + count))
    freedom, runs = PRIOR_RUNS + 0.5 * count, runs if runs > 1 else 0
    return replace(unscaled, scale=float(scale), degrees_of_freedom=freedom, runs=runs)


def _held_out(log: Telemetry) -> tuple[Integers, Integers]:
    """(n,) number of the drive that every row belongs to, and of the fold that leaves it out."""
    names, unit = np.unique(log.run, return_inverse=True)
    if len(names) == 1:
        unit = np.arange(len(log)) * SUBSTITUTE_RUNS // max(len(log), 1)
        _, unit = np.unique(unit, return_inverse=True)
    return unit, unit % min(FOLDS, int(unit.max()) + 1)


def _declared_spreads(model: PowerModel) -> Array:
    """(P,) standard deviation that a parameter's declaration states for its value."""
    return np.array(
        [abs(v) * s[2].spread for v, s in zip(model.parameters, model.slots, strict=True)]
    )


def _outlying(fitted: Fit) -> float:
    """Root mean square of the residual over what its medians say, at least 1.

    A fit may pass over outliers; an energy adds them up.
    """
    noise = fitted.noise
    usual = np.interp(np.abs(fitted.watts), noise.powers, noise.spreads)
    return max(1.0, fitted.rmse_w / float(np.sqrt(np.mean(usual**2))))


def _correlation_time(noise: Noise, interval: float) -> float:
    """s: interval of a row times what its autoregression adds at the lowest frequency.

    At least half the interval: that errors cancel from row to row is not relied on.
    """
    last = len(noise.shrink) - 1
    passed = 1.0 - float(noise.reflections[last, :last].sum())
    return interval * max((float(noise.shrink[last]) / max(passed, 0.05)) ** 2, 0.5)
