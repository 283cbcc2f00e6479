"""Compiled loops of the search for regimes: resampled sums, and the largest z by chance.

They replace a few lines of numpy without its large temporary arrays; small products of
matrices on many threads, which numpy's library would start, are slower than one loop.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from planner.compiled_code import njit

LEAST_UNEXPLAINED = 1e-4
"""Bounds z of few clusters that happen to agree."""
FEW_CLUSTERS = 8
"""A handful of clusters agree by chance too often to be made more of than T."""

_F1 = types.Array(types.float32, 1, "C")
_F2 = types.Array(types.float32, 2, "C")
_I1 = types.Array(types.int64, 1, "C")


@njit(types.void(_F2, _F2, _F2), cache=True, nogil=True, fastmath=True)
def product(factors: Any, sums: Any, result: Any) -> None:
    """result = factors @ sums, for (rounds, units) and (units, bins)."""
    result[:] = 0.0
    for k in range(factors.shape[0]):
        for u in range(factors.shape[1]):
            factor = factors[k, u]
            for j in range(sums.shape[1]):
                result[k, j] += factor * sums[u, j]


@njit(
    types.void(_F2, _F2, _F1, _F1, _F1, _F1, _F1, types.int64, types.float64, _I1, _F2),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def largest_z(
    within: Any,
    between: Any,
    squares: Any,
    clusters: Any,
    spread: Any,
    inner: Any,
    outer: Any,
    runs: Any,
    size: Any,
    kinds: Any,
    largest: Any,
) -> None:
    """Raise ``largest`` (kinds, rounds) to the largest |z| of sums (rounds, sets) by chance.

    The names are those of search._Sets; ``size`` is √Σ of the squared means of runs.
    """
    freedom = max(0, runs - 2)
    for k in range(within.shape[0]):
        for j in range(within.shape[1]):
            x = 0.0
            if squares[j] > 0.0:
                x = min(within[k, j] ** 2 / (squares[j] * clusters[j]), 1.0 - LEAST_UNEXPLAINED)
            rho = 0.0
            if spread[j] > 0.0 and size > 0.0:
                rho = between[k, j] / (spread[j] * size)
            y = min(rho * rho, 1.0 - LEAST_UNEXPLAINED)
            # -ln(1 - x) is at most x/(1 - x): most sets need no logarithm.
            bound = (clusters[j] - 1.0) * x / (1.0 - x) + freedom * y / (1.0 - y) + x
            so_far = largest[kinds[j], k]
            total = inner[j] + outer[j]
            if bound <= so_far * so_far or total <= 0.0:
                continue
            if clusters[j] < FEW_CLUSTERS:
                first = np.sqrt(x * clusters[j])
            else:
                first = np.sqrt(-(clusters[j] - 1.0) * np.log(1.0 - x))
            second = np.sqrt(-freedom * np.log(1.0 - y))
            if (within[k, j] < 0.0) != (rho < 0.0):
                second = -second
            z = abs(first * np.sqrt(inner[j]) + second * np.sqrt(outer[j])) / np.sqrt(total)
            if z > so_far:
                largest[kinds[j], k] = z
