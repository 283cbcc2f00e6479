"""Start and stop of a question in the certified lower bound: what they gain, and where it is paid.

    ends = StartAndStop.of(table, slower, acceleration, mesh, (start, goal))
    costs, gain_j = ends.paid(prices, costs, direction, steepest, least)

Round each of both places lies a cone of some metres in which prices depend on the speed
(ramps); triangles in it are priced anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.search.certificate.mesh import Mesh
from planner.search.certificate.potential import weights_at
from planner.search.certificate.price_table import PriceField, PriceTable
from planner.search.certificate.ramps import Nearby, ramp_for
from planner.search.certificate.triangle_costs import triangle_costs
from planner.search.second_core import CORE

Place = tuple[float, float]

WIDTH = 3.0
"""Width of the cone, in lengths in which the robot stops from full speed."""
FULL = 0.95
"""Height of the cone; what is left of one pays for its slope."""
CLOSE = 0.4
"""Height from which ground counts for the slope along the travel."""


@dataclass(frozen=True)
class StartAndStop:
    """Both ends of a question.

    Attributes:
        table: of the model at full speed.
        watts: (parts, a, b, 2) at parts of it.
        acceleration: m/s² at most.
        mesh: of the ground.
        places: start and goal, m.
        cones: (ny, nx) each, at the nodes.
    """

    table: PriceTable
    watts: Array
    acceleration: float
    mesh: Mesh
    places: tuple[Place, Place]
    cones: tuple[Array, Array]

    @classmethod
    def of(
        cls,
        table: PriceTable,
        watts: Array,
        acceleration: float,
        mesh: Mesh,
        places: tuple[Place, Place],
    ) -> StartAndStop:
        """The ends with their cones: no triangle is in both, and places too near have none."""
        width = WIDTH * table.speed**2 / (2.0 * acceleration)
        width = min(width, 0.5 * math.dist(*places) - math.hypot(*mesh.cell))
        x = mesh.origin[0] + mesh.cell[0] * np.arange(mesh.heights.shape[1])
        y = mesh.origin[1] + mesh.cell[1] * np.arange(mesh.heights.shape[0])
        cones = []
        for px, py in places:
            away = np.hypot(x[None, :] - px, y[:, None] - py)
            cone = np.maximum(0.0, 1.0 - away / width) if width > 0.0 else np.zeros(away.shape)
            cones.append(FULL * cone)
        return cls(table, watts, acceleration, mesh, places, (cones[0], cones[1]))

    def paid(
        self, prices: PriceField, costs: Array, direction: Array, steepest: float, least: float
    ) -> tuple[Array, float]:
        """Costs with what both ends ask for, and J that the bound gains for it.

        Args:
            prices: at the nodes.
            costs: (cells y, cells x, 2, directions) J/m without.
            direction: (2, ny, nx) of a good route.
            steepest: largest tan(slope) that is driven.
            least: J/m; an end that would leave a direction cheaper than that does not count.
        """
        found = CORE.all(
            [partial(self._end, end, prices, costs, direction, steepest) for end in range(2)]
        )
        gain = 0.0
        paid = costs.copy()
        for block, asked, worth in found:
            if worth > 0.0 and asked.min() > least:
                # Where both blocks meet, each knows of its own end alone.
                paid[block] = np.minimum(paid[block], asked)
                gain += worth
        return paid, gain

    def _end(
        self, end: int, prices: PriceField, costs: Array, direction: Array, steepest: float
    ) -> tuple[tuple[slice, slice], Array, float]:
        """Block of cells round one end, their costs, and J at the place itself."""
        mesh, cone = self.mesh, self.cones[end]
        inside = np.argwhere(cone > 0.0)
        if not len(inside):
            return (slice(0, 0), slice(0, 0)), costs[:0, :0], 0.0
        low = np.maximum(inside.min(axis=0) - 1, 0)
        high = np.minimum(inside.max(axis=0) + 1, np.array(costs.shape[:2]))
        block = slice(low[0], high[0]), slice(low[1], high[1])
        nodes = slice(low[0], high[0] + 1), slice(low[1], high[1] + 1)
        at, weights = weights_at(self.places[end], mesh.origin, mesh.cell, cone.shape)
        sign = 1.0 - 2.0 * end
        here = self._nearby(sign, cone, prices, costs, direction, at[int(np.argmax(weights))])
        ramp = ramp_for(self.table, self.watts, self.acceleration, sign, cone, here)
        asked = costs[block].copy()
        triangle_costs(
            self.table,
            PriceField(*(np.ascontiguousarray(f[nodes]) for f in prices)),
            ramp._replace(place=np.ascontiguousarray(cone[nodes])),
            np.ascontiguousarray(mesh.heights[nodes]),
            np.ascontiguousarray(mesh.ranges[block]),
            np.ascontiguousarray(mesh.rolling[nodes]),
            np.ascontiguousarray(mesh.wall[block]),
            *mesh.cell,
            steepest,
            asked,
        )
        share = sum(w * float(cone[n]) for n, w in zip(at, weights, strict=True))
        return block, asked, share * float(ramp.fall[0])

    def _nearby(
        self,
        sign: float,
        cone: Array,
        prices: PriceField,
        costs: Array,
        direction: Array,
        at: tuple[int, int],
    ) -> Nearby:
        """Prices at a node along the direction of travel there, and the ground in its cone."""
        mesh, t = self.mesh, self.table
        ex, ey = direction[:, at[0], at[1]]
        c2, s2 = ex * ex - ey * ey, 2.0 * ex * ey
        slope_y, slope_x = _gradient(mesh.heights, mesh.cell)
        share_y, share_x = _gradient(prices.share, mesh.cell)
        inside = cone > 0.0
        y, x = np.nonzero(cone >= min(CLOSE, cone[at]))
        # On the way that leads from the start or to the goal, a cell to both sides.
        dx, dy = (x - at[1]) * mesh.cell[0], (y - at[0]) * mesh.cell[1]
        on = np.abs(dx * ey - dy * ex) <= max(mesh.cell)
        on &= sign * (dx * ex + dy * ey) >= -0.5 * max(mesh.cell)
        along = sign * (slope_x[y, x] * ex + slope_y[y, x] * ey)[on]
        cells = costs[inside[:-1, :-1]]
        steep = float(np.max(np.hypot(slope_x, slope_y), where=inside, initial=0.0))
        moved = 0.5 * t.speed**3 * (t.moving + t.rotors)
        odd = float(prices.b1[at] * c2 + prices.b2[at] * s2)
        return Nearby(
            float(prices.share[at]) + odd,
            float(prices.rotor[at]) + t.efficiency * odd,
            float(prices.b2[at] * c2 - prices.b1[at] * s2),
            sign * float(along.min()),
            steep,
            float(cells.min()) if cells.size else 0.0,
            moved * float(np.hypot(share_x[y, x], share_y[y, x])[on].max()),
            max(float(mesh.rolling[inside][:, 0].min()) / math.hypot(1.0, steep), t.load),
        )


def _gradient(values: Array, cell: tuple[float, float]) -> tuple[Array, Array]:
    """Change per metre along y and x at the nodes."""
    down, right = np.gradient(values, cell[1], cell[0])
    return np.asarray(down), np.asarray(right)
