"""Thresholds on an axis: round figures, where few rows lie.

thresholds(values, 12, least=0.02)                 # about equally full bins in between
best_bounds(values, residual, 0.4, None, 0.02)     # nearby bounds that explain more
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array

Bound = float | None

LEAST_ROW_SHARE = 0.01
"""Share of the rows that must lie on either side of a threshold."""
REFINING_STEPS = 40
"""Steps of refined bounds over the range of an axis."""
_MOST_CROWDED = 4.0
"""Times as many rows as usual around a threshold: it would cut a cluster of equal values in two."""
_ODDNESS_BINS = 0.15
"""Share of a bin that a rounder figure may lie away from the quantile."""
_ODDNESS_GAIN = 0.015
"""Share of the explained error that a rounder figure may cost."""
_MOST_SHIFT = 0.1
"""Share of the rows by which refinement may move a bound."""


def thresholds(values: Array, bins: int, least: float) -> Array:
    """Bounds of about equally full bins.

    Args:
        values: (n,) of an axis, in the unit that words use.
        bins: how many at most.
        least: spread below which all values are one, and the smallest bound.

    Returns:
        (at most bins - 1,), increasing; empty when the values do not vary.
    """
    ordered = np.sort(values)
    grid, odd, crowd = _grid(ordered, 2 * bins, least)
    if not len(grid):
        return grid
    below = np.searchsorted(ordered, grid) / len(ordered)
    chosen = set()
    for k in range(1, bins):
        cost = np.abs(below - k / bins) * bins + 0.3 * crowd + _ODDNESS_BINS * odd
        chosen.add(float(grid[np.argmin(cost)]))
    return np.array(sorted(chosen))


def best_bounds(
    values: Array, residual: Array, low: Bound, high: Bound, least: float
) -> tuple[Bound, Bound]:
    """Bounds near the given ones whose mean residual explains most of the squared error.

    Args:
        values: (n,) of an axis, in the unit that words use.
        residual: (n,) W.
        low, high: bounds, low <= value < high; None is open and stays so.
        least: the smallest bound, whatever its sign.
    """
    order = np.argsort(values)
    ordered = values[order]
    sums = np.concatenate([[0.0], np.cumsum(residual[order])])

    def moved(bound: Bound, other: Bound, edge: int) -> Bound:
        if bound is None:
            return None
        grid, odd, _ = _grid(np.sort(np.abs(ordered)), REFINING_STEPS, least)
        grid, odd = np.copysign(np.append(grid, abs(bound)), bound), np.append(odd, 2.0)
        at, here = np.searchsorted(ordered, grid), int(np.searchsorted(ordered, bound))
        end = edge if other is None else int(np.searchsorted(ordered, other))
        rows = np.maximum(np.abs(end - at), 1)
        gain = (sums[at] - sums[end]) ** 2 / rows * (1.0 - _ODDNESS_GAIN * odd)
        allowed = np.abs(at - here) <= _MOST_SHIFT * len(ordered)
        allowed &= np.sign(at - end) == np.sign(here - end)
        return float(grid[np.argmax(np.where(allowed, gain, -1.0))])

    low = moved(low, high, len(ordered))
    return low, moved(high, low, 0)


def _grid(ordered: Array, steps: int, least: float) -> tuple[Array, Array, Array]:
    """Round figures within sorted values, how odd each is (0 to 2), and how crowded its place."""
    low, high = np.quantile(ordered, [LEAST_ROW_SHARE, 1.0 - LEAST_ROW_SHARE])
    spread = float(high - low)
    if spread < least:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    step = _round_down(spread / steps)
    number = np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
    grid = number * step
    # Rows close to each threshold, against the average: a gap between two settings has few.
    near = np.searchsorted(ordered, grid + step / 3) - np.searchsorted(ordered, grid - step / 3)
    crowd = near / max(1.0, len(ordered) * (2.0 * step / 3.0) / spread)
    odd = np.where(number % 10 == 0, 0.0, np.where((number % 2 == 0) | (number % 5 == 0), 1.0, 2.0))
    below = np.searchsorted(ordered, grid) / len(ordered)
    kept = (grid >= min(least, low)) & (crowd <= _MOST_CROWDED)
    kept &= (below >= LEAST_ROW_SHARE) & (below <= 1.0 - LEAST_ROW_SHARE)
    return grid[kept], odd[kept], crowd[kept]


def _round_down(value: float) -> float:
    """The next of 1, 2, 5 · 10^k at or below a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(f for f in (1.0, 2.0, 5.0) if f * power <= value * (1.0 + 1e-9)))
