"""Steady driving: cost of a metre on a slope, for every heading of the body, tabulated once.

On a plane of gradient ∇z, a robot that drives along the horizontal unit vector d with its body
turned by θ from d dissipates, per horizontal metre,

    D = min over v of  P(v, θ, ∇z)·√(1 + m²)/v - M·g·m          m = ∇z·d

where P is the compiled power model and M the mass with payload. D ≥ 0 by the second law, as the
search needs. The energy of a route is ΣD plus M·g times the climb. Only speeds within all limits
count: wheel load, traction, current, voltage, continuous torque.

Three numbers fix D: θ, the direction φ of the gradient seen from d, and its steepness. The tables
are polar in the last two, with steepness as a share of the largest one that can be driven, so that
every entry is finite and the limit itself is exact to the bisection:

    by_yaw[c, θ, φ, s]   yaw_limit[c, θ, φ]      c counts the ground classes of the map
    lean[c, θ, φ, s]                             crab angle, rad by which the body is turned off θ
    best[c, φ, s]        limit[c, φ]             the same with the best θ
    gentle[c, a, b]                              the same by slope along and across the travel,
                                                 as far as ``reach``, the least slope limit

Looking up replaces 1 µs of model by 0.01 µs, and yaw is gone from the search.
steady_cost_tables fills the tables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.search.resolution import DIRECTIONS, STEEPNESSES, YAWS


@njit(cache=True, error_model="numpy", inline="always")
def level_cost(costs: Any, edge: float, steepness: float, levels: int) -> float:
    """Linear in the share of the limit."""
    u = steepness / edge * (levels - 1) if edge > 0.0 else 0.0
    k = min(int(u), levels - 2)
    u -= k
    value: float = (1.0 - u) * costs[k] + u * costs[k + 1]
    return value


@njit(cache=True, error_model="numpy", inline="always")
def polar(table: Any, edge: Any, azimuth: float, steepness: float, margin: float) -> float:
    """Bilinear in direction (periodic) and share of the limit; infinity beyond margin · limit."""
    a = azimuth / (2.0 * math.pi) * DIRECTIONS
    a -= DIRECTIONS * math.floor(a / DIRECTIONS)
    f0 = int(a)
    w = a - f0
    if f0 >= DIRECTIONS:
        f0 = 0
    f1 = f0 + 1 if f0 + 1 < DIRECTIONS else 0
    largest = min(edge[f0], edge[f1])
    if w == 0.0:
        largest = edge[f0]
    if steepness > largest * margin:
        return np.inf
    value = 0.0
    for f, weight in ((f0, 1.0 - w), (f1, w)):
        if weight == 0.0:
            continue
        value += weight * level_cost(table[f], edge[f], steepness, STEEPNESSES)
    return value


@njit(cache=True, error_model="numpy")
def crab_angle_for_yaw(
    crab_angle: Any, yaw_limit: Any, ground: int, turn: int, azimuth: float, steepness: float
) -> float:
    """Crab angle: rad by which the body is turned off ``turn`` bins at the cost tabulated."""
    f = int(math.floor(azimuth / (2.0 * math.pi) * DIRECTIONS + 0.5)) % DIRECTIONS
    edge = yaw_limit[ground, turn, f]
    if not 0.0 < steepness <= edge:
        return 0.0
    # The nearest entry: at an angle between two entries the drag is neither of the two.
    s = int(steepness / edge * (STEEPNESSES - 1) + 0.5)
    found: float = crab_angle[ground, turn, f, s]
    return found


@njit(cache=True, error_model="numpy")
def costs_for_yaws(
    by_yaw: Any,
    yaw_limit: Any,
    ground: int,
    azimuth: float,
    steepness: float,
    margin: float,
    costs: Any,
) -> None:
    """Cost per horizontal metre with the body turned by every bin, (YAWS,) into ``costs``.

    Entry ``turn`` is ``polar`` of the tables of that bin.
    """
    a = azimuth / (2.0 * math.pi) * DIRECTIONS
    a -= DIRECTIONS * math.floor(a / DIRECTIONS)
    f = int(a) % DIRECTIONS
    after = (f + 1) % DIRECTIONS
    w = a - int(a)
    for turn in range(YAWS):
        low, high = yaw_limit[ground, turn, f], yaw_limit[ground, turn, after]
        costs[turn] = np.inf
        if steepness > (low if w == 0.0 else min(low, high)) * margin:
            continue
        costs[turn] = (1.0 - w) * level_cost(by_yaw[ground, turn, f], low, steepness, STEEPNESSES)
        if w > 0.0:
            costs[turn] += w * level_cost(by_yaw[ground, turn, after], high, steepness, STEEPNESSES)


@njit(cache=True, error_model="numpy")
def cost_for_best_yaw(
    best: Any, limit: Any, ground: int, azimuth: float, steepness: float, margin: float
) -> float:
    """Cost per horizontal metre with the body turned as is cheapest."""
    return polar(best[ground], limit[ground], azimuth, steepness, margin)


@dataclass(frozen=True)
class SteadyCosts:
    """Tables of the least cost per horizontal metre; see the module's head for their axes."""

    by_yaw: NDArray[np.float64]
    yaw_limit: NDArray[np.float64]
    crab_angle: NDArray[np.float64]
    best: NDArray[np.float64]
    limit: NDArray[np.float64]
    gentle: NDArray[np.float64]
    order: NDArray[np.uint8]
    reach: float

    @property
    def nbytes(self) -> int:
        """Memory that the cache counts."""
        arrays = (self.by_yaw, self.yaw_limit, self.crab_angle, self.best, self.limit)
        return sum(array.nbytes for array in (*arrays, self.gentle, self.order))
