"""Start and stop in the certified lower bound: the idle power of slow motion.

    ends = StartAndStop.of(table, slower, acceleration, mesh, (start, goal))
    costs, gain_j = ends.paid(prices, costs, direction, least)

While a robot is slow, its electronics draw power for few metres. So round both ends the potential
holds, beside what certified_bound says, with t the share of full speed,

    place · fall(t),   fall(1) = 0,   -fall' = v·κ

+ at the start, - at the goal, and ``place`` 0 but for some metres round it. At rest that is a gain
at both ends. It is paid for where, with the acceleration a at most,

    Q_t(μ) - κ·a ≥ t·Q(μ)

for dual_power's least power at the speed t·v. κ is chosen by the prices at a place. Any choice
gives a bound, since triangles in the cone round an end are priced anew for all of it to be paid.
docs/lower-bound.md has the inequalities.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.search.certificate.mesh import Mesh
from planner.search.certificate.potential import weights_at
from planner.search.certificate.price_table import (
    PriceField,
    PriceTable,
    rotor_price,
    table_watts,
)
from planner.search.certificate.triangle_costs import Ramp, triangle_costs
from planner.search.second_core import CORE

Place = tuple[float, float]

SPEED_PARTS = (0.0, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32, 0.42, 0.52, 0.62, 0.73, 0.84, 0.94)
"""Shares of full speed between which κ is constant. In the first step, whose table is the weakest,
and above the last it is zero."""
CONE_WIDTH = 3.0
"""Radius of the cone, in lengths in which the robot stops from full speed."""
CONE_HEIGHT = 0.95
"""Height of the cone; what is left of one pays for its slope."""
NEARBY = 0.4
"""Height of the cone from which the change of prices counts."""


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
        width = CONE_WIDTH * table.robot.speed**2 / (2.0 * acceleration)
        width = min(width, 0.5 * math.dist(*places) - math.hypot(*mesh.cell))
        x = mesh.origin[0] + mesh.cell[0] * np.arange(mesh.ground.heights.shape[1])
        y = mesh.origin[1] + mesh.cell[1] * np.arange(mesh.ground.heights.shape[0])
        cones = []
        for px, py in places:
            away = np.hypot(x[None, :] - px, y[:, None] - py)
            cone = np.maximum(0.0, 1.0 - away / width) if width > 0.0 else np.zeros(away.shape)
            cones.append(CONE_HEIGHT * cone)
        return cls(table, watts, acceleration, mesh, places, (cones[0], cones[1]))

    def paid(
        self, prices: PriceField, costs: Array, direction: Array, least: float
    ) -> tuple[Array, float]:
        """Costs with what both ends ask for, and J that the bound gains for it.

        Args:
            prices: at the nodes.
            costs: (cells y, cells x, 2, directions) J/m without.
            direction: (2, ny, nx) of a good route.
            least: J/m; an end that would leave a direction cheaper than that does not count.
        """
        found = CORE.all([partial(self._end, end, prices, costs, direction) for end in range(2)])
        gain = 0.0
        paid = costs.copy()
        for block, asked, worth in found:
            if worth > 0.0 and asked.min() > least:
                # Where both blocks meet, each knows of its own end alone.
                paid[block] = np.minimum(paid[block], asked)
                gain += worth
        return paid, gain

    def _end(
        self, end: int, prices: PriceField, costs: Array, direction: Array
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
        ramp = self.ramp(1.0 - 2.0 * end, cone, prices, direction, at[int(np.argmax(weights))])
        asked = costs[block].copy()
        triangle_costs(
            self.table,
            PriceField(*(np.ascontiguousarray(f[nodes]) for f in prices)),
            ramp._replace(place=np.ascontiguousarray(cone[nodes])),
            mesh.ground.part(nodes, block),
            asked,
        )
        share = sum(w * float(cone[n]) for n, w in zip(at, weights, strict=True))
        return block, asked, share * float(ramp.fall[0])

    def ramp(
        self,
        sign: float,
        cone: Array,
        prices: PriceField,
        direction: Array,
        at: tuple[int, int],
    ) -> Ramp:
        """The most that prices at a node leave for κ, along the direction of travel there."""
        t, cell = self.table, self.mesh.cell
        robot, parts = t.robot, np.array(SPEED_PARTS)
        ex, ey = direction[:, at[0], at[1]]
        c2, s2 = ex * ex - ey * ey, 2.0 * ex * ey
        odd = float(prices.b1[at] * c2 + prices.b2[at] * s2)
        share, cross = float(prices.share[at]) + odd, float(prices.b2[at] * c2 - prices.b1[at] * s2)
        rotor = float(prices.rotor[at]) + robot.efficiency * odd
        steady = table_watts(t, t.watts, share, cross, t.load)
        steady += robot.rotor_slack * abs(rotor_price(share, robot.efficiency) - rotor)
        # Falling prices earn at most this at full speed.
        near = cone >= min(NEARBY, cone[at])
        falling = np.hypot(*np.gradient(prices.share, cell[1], cell[0]))[near].max()
        change = 0.5 * robot.speed**3 * (robot.moving + robot.rotors) * float(falling)
        left = np.array([table_watts(t, watts, share, cross, t.load) for watts in self.watts])
        left -= parts * steady + (parts - parts**3) * change
        held = np.maximum(0.0, np.minimum(left[:-1], left[1:]))
        held[0] = 0.0
        gained = np.diff(parts) * robot.speed * held / self.acceleration
        fall = np.append(np.cumsum(gained[::-1])[::-1], 0.0)
        return Ramp(sign, cone, self.watts, parts, held, fall)
