"""Noise of the measured power: its spread, its correlation, and whitening.

    noise, left = noise_of(log, residual, watts, input_error, columns)
    noise.floor_w                        # W rms, the error that no model can go below
    spread = noise.spread(watts, input_error)  # (n,) W of single rows
    white = noise.whiten(log, watts, spread, Z)   # (n, m), unit and uncorrelated noise

Three layers, each estimated robustly from the residual after the model and a few columns:

    spread       standard deviation as a function of |P| (medians of absolute deviations in bins),
                 combined with the uncertainty of the model's inputs in single rows
                 (planner.telemetry.prediction.sensitivity.input_uncertainty)
    correlation  an autoregression within consecutive rows, pooled over all of them
    runs         an offset and a gain of every run, random with a covariance

The first rows after a gap are whitened with the lower orders of the same autoregression
(Levinson & Durbin), so that no row is lost, however short the runs are.

Left out
    noise that changes along the log; correlation between runs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import nnls

from planner.arrays import Array
from planner.compiled_code import njit
from planner.telemetry.logs import Telemetry

MOST_LAGS = 12
"""Order of the autoregression, in rows."""
LARGEST_REFLECTION = 0.98
"""Largest partial correlation of two rows: beyond, they would hardly count any more."""
CLIP = 3.5
"""Residuals count at most this many spreads: one outlier cannot carry a fit."""
MOST_OUTLIERS = 0.02
"""Share of the rows that may be outliers; what more of them do is the noise of this log."""
SPREAD_BINS = 10
"""Bins over |P| of the spread, each of at least 40 rows."""
LEAST_RUNS = 4
"""Runs below which their offsets and gains are not estimated."""
MOST_HELPERS, HELPER_SHARE = 4, 0.01
"""Columns that noise is estimated beside, and the share of squares that each must explain."""
COLLINEAR = 0.03
"""Share of a column's norm that the model's own columns, and each chosen one, must leave."""
LEAST_SPREAD = 1e-6
"""W; a log without any noise has this."""
_MAD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def clipped(residual: Array, spread: Array) -> Array:
    """Residuals (n,) that count at most CLIP of their spreads (n,)."""
    return np.clip(residual, -CLIP * spread, CLIP * spread)


def counted(residual: Array, spread: Array) -> Array:
    """Residuals (n,) W, the MOST_OUTLIERS furthest out cut back to CLIP of their spreads (n,)."""
    size = np.abs(residual) / spread
    far = np.flatnonzero(size > CLIP)
    most = int(MOST_OUTLIERS * len(residual))
    far = far[np.argsort(-size[far], kind="stable")[:most]]
    kept = residual.copy()
    kept[far] = np.sign(residual[far]) * CLIP * spread[far]
    return kept


def huber(z: Array) -> Array:
    """Loss of residuals in spreads: their squares, straight lines beyond CLIP."""
    size = np.abs(z)
    return np.where(size < CLIP, size * size, CLIP * (2.0 * size - CLIP))


@dataclass(frozen=True)
class Noise:
    """Scatter of the measured power.

    Attributes:
        powers, spreads: (b,) |P| in W and the standard deviation there, linear in between.
        reflections: (k, k) autoregressions of order 0 to k-1, one a row, in lower triangles.
        shrink: (k,) innovation's standard deviation of each order over that of the noise.
        by_run: (2, 2) covariance of the runs' offset and gain in whitened units.
        floor_w: rms over the log of what no column explains, W: noise of the meter, and what errors
            of the inputs make of a perfect model.
        even_w: W, the spread of every row in fits; 0 where fits weight rows by this noise. Noise
            says which rows tell most about a perfect model. What a model misses, and errors of the
            inputs, are largest elsewhere: a fit that trusts the quiet rows pays for it in others.
    """

    powers: Array
    spreads: Array
    reflections: Array
    shrink: Array
    by_run: Array
    floor_w: float
    even_w: float = 0.0

    @property
    def correlation(self) -> float:
        """Correlation of neighbouring rows."""
        return float(self.reflections[1, 0]) if len(self.reflections) > 1 else 0.0

    @property
    def redundancy(self) -> float:
        """Rows that weigh as much in what is slow as one row of independent noise does."""
        if not self.even_w:
            return 1.0
        return float((self.shrink[-1] / (1.0 - self.reflections[-1].sum())) ** 2)

    def for_fits(self) -> Noise:
        """What fits weight rows by: this noise, or none but ``even_w``."""
        if not self.even_w:
            return self
        return replace(
            self, reflections=np.zeros((1, 1)), shrink=np.ones(1), by_run=np.zeros((2, 2))
        )

    def spread_for_fits(self, spread: Array) -> Array:
        """(n,) W, by what fits divide single rows whose standard deviation is ``spread`` (n,)."""
        return np.full_like(spread, self.even_w) if self.even_w else spread

    def spread(self, watts: Array, input_error: Array) -> Array:
        """(n,) W, standard deviation of single rows at a modelled power and input uncertainty."""
        return np.hypot(np.interp(np.abs(watts), self.powers, self.spreads), input_error)

    def whiten(self, log: Telemetry, watts: Array, spread: Array, columns: Array) -> Array:
        """Columns in units of independent noise of standard deviation 1.

        Args:
            log: the rows; their runs and times say which rows follow each other.
            watts: (n,) modelled power, for the gains of the runs.
            spread: (n,) W, standard deviation of single rows.
            columns: (n, m) W.

        Returns:
            (n, m).
        """
        scale = 1.0 / spread
        runs = bool(np.any(self.by_run > 0.0))
        ahead = [scale[:, None], (watts * scale)[:, None]] if runs else []
        scaled = np.concatenate([columns * scale[:, None], *ahead], axis=1)
        white = np.empty_like(scaled)
        segments = np.array(log.segments(), np.int64).reshape(-1, 2)
        _filter(scaled, segments, self.reflections, self.shrink, white)
        if not runs:
            return white
        kept, shared = white[:, : columns.shape[1]], white[:, columns.shape[1] :]
        kept, shared = np.ascontiguousarray(kept), np.ascontiguousarray(shared)
        _take_out_runs(kept, shared, self.by_run, np.array(log.run_pieces()))
        return kept


@njit(cache=True, nogil=True)
def _filter(columns: Any, segments: Any, reflections: Any, shrink: Any, white: Any) -> None:
    last, count = reflections.shape[0] - 1, columns.shape[1]
    for piece in range(segments.shape[0]):
        start, stop = segments[piece]
        for k in range(start, stop):
            order = min(k - start, last)
            # Loops, not whole rows: these would be allocated for every lag.
            for j in range(count):
                white[k, j] = columns[k, j]
            for lag in range(order):
                share = reflections[order, lag]
                for j in range(count):
                    white[k, j] -= share * columns[k - 1 - lag, j]
            for j in range(count):
                white[k, j] /= shrink[order]


@njit(cache=True, nogil=True)
def _take_out_runs(columns: Any, shared: Any, by_run: Any, pieces: Any) -> None:
    """Apply (1 + shared·by_run·sharedᵀ)^(-1/2) to every run in place; two directions change."""
    for piece in range(pieces.shape[0]):
        start, stop = pieces[piece]
        basis, upper = np.linalg.qr(shared[start:stop])
        size = upper.shape[0]
        grown = np.eye(size) + upper @ by_run @ np.ascontiguousarray(upper.T)
        values, vectors = np.linalg.eigh(grown)
        for j in range(columns.shape[1]):
            share = np.zeros(size)
            for a in range(size):
                for k in range(stop - start):
                    share[a] += basis[k, a] * columns[start + k, j]
            change = np.zeros(size)
            for v in range(size):
                along = 0.0
                for a in range(size):
                    along += vectors[a, v] * share[a]
                along *= 1.0 - values[v] ** -0.5
                for a in range(size):
                    change[a] += vectors[a, v] * along
            for k in range(stop - start):
                for a in range(size):
                    columns[start + k, j] -= basis[k, a] * change[a]


def strongest_columns(residual: Array, own: Array, others: Array) -> list[int]:
    """Numbers of the other columns that explain most of a residual, found one after the other.

    Args:
        residual: (n,).
        own: (n, p) columns of the model, which come first.
        others: (n, m).

    Returns:
        At most MOST_HELPERS; none that explains less than HELPER_SHARE of the squares left.
    """
    basis, _ = np.linalg.qr(own[:, np.any(own != 0.0, axis=0)])
    before = np.linalg.norm(others, axis=0)
    left = residual - basis @ (basis.T @ residual)
    rest = others - basis @ (basis.T @ others)
    chosen: list[int] = []
    if not others.shape[1]:
        return chosen
    usable = np.ones(others.shape[1], bool)
    for _ in range(MOST_HELPERS):
        norms = np.linalg.norm(rest, axis=0)
        usable &= norms > COLLINEAR * np.maximum(before, 1e-300)
        before = norms
        taken = np.where(usable, np.abs(rest.T @ left) / np.maximum(norms, 1e-300), 0.0)
        best = int(np.argmax(taken))
        if taken[best] ** 2 < HELPER_SHARE * float(left @ left):
            break
        chosen.append(best)
        direction = rest[:, best] / norms[best]
        left = left - direction * float(direction @ left)
        rest = rest - np.outer(direction, direction @ rest)
    return chosen


def noise_of(
    log: Telemetry, residual: Array, watts: Array, input_error: Array, columns: Array
) -> tuple[Noise, Array]:
    """Noise in the residual of a model, once ``columns`` have taken what they can explain.

    Args:
        log: the rows.
        residual: (n,) W, measured less modelled.
        watts: (n,) W, modelled.
        input_error: (n,) W, uncertainty of single rows by errors of the inputs.
        columns: (n, m) W per unit of whatever may still be in the residual: the model's tangent
            and a few shapes. Too many would take slow noise for an effect.

    Returns:
        The noise, and (n,) W that the columns leave over.
    """
    powers, spreads = np.array([0.0]), np.array([max(deviation(residual), LEAST_SPREAD)])
    left = residual
    for _ in range(3):
        scale = 1.0 / np.hypot(np.interp(np.abs(watts), powers, spreads), input_error)
        left = _leftover(residual, columns, scale)
        # Rows that the model itself is unsure of say little about the measurement.
        clear = input_error <= 0.5 * float(np.median(spreads))
        if np.count_nonzero(clear) < 0.2 * len(clear):
            clear = np.ones(len(clear), bool)
        powers, spreads = _spread(np.abs(watts)[clear], left[clear])
    scale = 1.0 / np.hypot(np.interp(np.abs(watts), powers, spreads), input_error)
    z = np.clip(left * scale, -CLIP, CLIP)
    reflections, shrink = _autoregression(log, z)
    floor = _floor(left * scale, 1.0 / scale)
    plain = Noise(powers, spreads, reflections, shrink, np.zeros((2, 2)), floor)
    by_run = _run_covariance(log, plain, np.clip(left, -CLIP / scale, CLIP / scale), watts, scale)
    return Noise(powers, spreads, reflections, shrink, by_run, floor), left


def row_likelihood(
    log: Telemetry, residual: Array, watts: Array, spread: Array, columns: Array
) -> Array:
    """Log-likelihood of every row once columns have taken what they can, up to a constant.

    The noise may follow any autoregression, which is estimated anew: what a slow meter does to the
    residual can also be noise that is slow, and only what goes beyond that speaks for a meter.

    Args:
        log: the rows.
        residual: (n,) W, measured less modelled.
        watts: (n,) W, modelled.
        spread: (n,) W of single rows, up to a factor.
        columns: (n, m) W per unit.

    Returns:
        (n,), 0 in the first row of each stretch, which no row before it foretells.
    """
    left = _leftover(residual, columns, 1.0 / spread)
    size = max(deviation(left / spread), 1e-9)
    z = np.clip(left / (size * spread), -CLIP, CLIP)
    reflections, shrink = _autoregression(log, z)
    one = np.ones(1)
    noise = Noise(np.zeros(1), one, reflections, shrink, np.zeros((2, 2)), 1.0)
    white = noise.whiten(log, watts, np.ones(len(left)), z[:, None])[:, 0]
    likelihood = -0.5 * huber(white)
    last = len(shrink) - 1
    for start, stop in log.segments():
        order = np.minimum(np.arange(stop - start), last)
        likelihood[start:stop] -= np.log(size * shrink[order])
        likelihood[start] = 0.0
    return likelihood


def _floor(z: Array, spread: Array) -> float:
    """W, rms of what no column explains; ``z`` (n,) is that over the ``spread`` (n,) W.

    Spreads are medians of deviations: they leave out rows in which a robot accelerates, whose
    inputs are less sure than others', and which every model has to live with.
    """
    if np.mean(np.abs(z) > CLIP) <= MOST_OUTLIERS:
        z = np.clip(z, -CLIP, CLIP)
    return float(np.sqrt(np.mean((z * spread) ** 2)))


def deviation(values: Array) -> float:
    """Standard deviation about 0 of most of some values: half of them are nearer."""
    return _MAD * float(np.median(np.abs(values)))


def _leftover(residual: Array, columns: Array, scale: Array) -> Array:
    """Residual after a robust regression on the columns."""
    left = residual
    weighted = columns * scale[:, None]
    norms = np.sqrt((weighted**2).sum(axis=0))
    weighted = weighted[:, norms > 0] / norms[norms > 0]
    gram = weighted.T @ weighted + 1e-9 * np.eye(weighted.shape[1])
    fitted = np.zeros(len(residual))
    for _ in range(3):
        z = (residual - fitted) * scale
        z = np.clip(z, -CLIP, CLIP)
        fitted = fitted + (weighted @ np.linalg.solve(gram, weighted.T @ z)) / scale
        left = residual - fitted
    return left


def _spread(size: Array, left: Array) -> tuple[Array, Array]:
    """Spread over |P|; P crosses zero, so that a share of it alone would not do."""
    count = int(min(SPREAD_BINS, max(1, len(size) // 40)))
    order = np.argsort(size, kind="stable")
    bins = np.array_split(order, count)
    # Rows of a bin stand in order: their median is in the middle.
    powers = np.array([0.5 * (size[b[(len(b) - 1) // 2]] + size[b[len(b) // 2]]) for b in bins])
    spreads = np.array([deviation(left[b]) for b in bins])
    padded = np.concatenate([spreads[:1], spreads, spreads[-1:]])
    smooth = np.convolve(padded, [0.25, 0.5, 0.25], "valid")
    floor = max(0.3 * float(np.median(smooth)), LEAST_SPREAD)
    keep = np.concatenate([[True], np.diff(powers) > 0])
    return powers[keep], np.maximum(smooth, floor)[keep]


def _autoregression(log: Telemetry, z: Array) -> tuple[Array, Array]:
    """Predictors of every order up to MOST_LAGS, and the spread that each leaves.

    Returns:
        (order + 1, order) weights of the rows before, and (order + 1,) standard deviations.
    """
    segments = np.array(log.segments(), np.int64).reshape(-1, 2)
    longest = int(np.max(segments[:, 1] - segments[:, 0]))
    products, pairs = _pooled(z, segments, min(MOST_LAGS, longest // 4))
    table, shrink, any_noise = _levinson(products / np.maximum(pairs, 1.0))
    if not any_noise:
        # Means over many short stretches need not be those of any noise, and their predictors
        # explode. Sums over as many rows each are, though they say too little of distant rows.
        table, shrink, _ = _levinson(products / len(z))
    return table, shrink


@njit(cache=True, nogil=True)
def _pooled(z: Any, segments: Any, most: int) -> Any:
    """Sums of products of rows that are 0 to ``most`` apart, over all stretches, and their pairs.

    Returns:
        two of (most + 1,).
    """
    products, pairs = np.zeros(most + 1), np.zeros(most + 1)
    for start, stop in segments:
        for lag in range(min(most, stop - start - 1) + 1):
            pairs[lag] += stop - start - lag
            for n in range(start + lag, stop):
                products[lag] += z[n] * z[n - lag]
    return products, pairs


@njit(cache=True, nogil=True)
def _levinson(covariance: Any) -> Any:
    """Levinson & Durbin's recursion; and whether the autocovariance is that of any noise."""
    most = covariance.shape[0] - 1
    table, shrink = np.zeros((most + 1, max(most, 1))), np.empty(most + 1)
    shrink[0], any_noise = math.sqrt(max(covariance[0], 1e-12)), True
    for k in range(1, most + 1):
        left = covariance[k]
        for lag in range(k - 1):
            left -= table[k - 1, lag] * covariance[k - 1 - lag]
        reflection = left / shrink[k - 1] ** 2
        any_noise &= k == 1 or abs(reflection) <= LARGEST_REFLECTION
        reflection = min(max(reflection, -LARGEST_REFLECTION), LARGEST_REFLECTION)
        table[k, k - 1] = reflection
        for lag in range(k - 1):
            table[k, lag] = table[k - 1, lag] - reflection * table[k - 1, k - 2 - lag]
        shrink[k] = shrink[k - 1] * math.sqrt(1.0 - reflection**2)
    return table, shrink, any_noise


def _run_covariance(log: Telemetry, plain: Noise, left: Array, watts: Array, scale: Array) -> Array:
    """Variances of the runs' offsets and gains, by moments: what is there less what noise gives.

    With B the two whitened columns of a run and e its whitened leftover, the square of B'e is on
    average the diagonal of G + GΣG, where G = B'B. No inverse of G is needed, since in a steady run
    offset and gain are the same thing.
    """
    pieces = log.run_pieces()
    if len(pieces) < LEAST_RUNS:
        return np.zeros((2, 2))
    one = np.ones_like(left)
    white = plain.whiten(log, watts, 1.0 / scale, np.column_stack([left, one, watts]))
    rows, excess = [], []
    for start, stop in pieces:
        shared, rest = white[start:stop, 1:], white[start:stop, 0]
        gram, score = shared.T @ shared, shared.T @ rest
        for k in range(2):
            if gram[k, k] > 0.0:
                rows.append(gram[k] ** 2 / gram[k, k])
                # A run whose square is far above all others' must not speak for them.
                excess.append(score[k] ** 2 / gram[k, k] - 1.0)
    limit = 9.0 * float(np.median(np.abs(excess))) + 1.0
    found, _ = nnls(np.array(rows), np.minimum(excess, limit))
    return np.diag(found)
