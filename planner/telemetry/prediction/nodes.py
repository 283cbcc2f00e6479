"""Moments within the rows of a log: power is not linear in the averages that a row holds.

    nodes = Nodes.of(log, model)
    predict(model, nodes)                        # (n,) W, to be compared with log.power

Where a wheel or its rollers pass through rest within a row, or change their speed by a large
share, friction changes side: the power at the mean speed is then not the mean of the power. Such a
row is taken at three moments of its interval (Gauss and Legendre's nodes) with the velocity that
its mean acceleration says; all others at their mean. On virtual logs with half-second rows this
takes away half of what an exact model would otherwise miss
(tests/telemetry/prediction/test_nodes.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.arrays import Array, Integers
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction.meter import Readings
from planner.telemetry.prediction.per_log import per_log

MOMENTS, MANY_MOMENTS = 3, 7
"""Moments of a divided row, and the number that shows how far so few of them are off."""
DIVIDING_CHANGE = 0.5
"""Relative change of a wheel's or roller's speed within a row from which the row is divided."""
LEAST_SPEED_CHANGE = 1e-3
"""m/s; a smaller change never divides a row."""


class Nodes(NamedTuple):
    """Rows of the model that stand for the rows of a log.

    Attributes:
        rows: (N, ROW_LENGTH) inputs of the model, N ≥ n.
        first: (n + 1,) rows[first[k]:first[k+1]] stand for row k of the log.
        weight: (N,) their shares, which add up to 1 for every row of the log.
        readings: what the log's meter shows of the power; None shows it as it is.
    """

    rows: Array
    first: Integers
    weight: Array
    readings: Readings | None = None

    @classmethod
    def of(cls, log: Telemetry, model: PowerModel, *, finely: bool = False) -> Nodes:
        """The nodes of a log; ``finely`` takes more moments, to show what the few leave out."""
        moments = MANY_MOMENTS if finely else MOMENTS

        def plain() -> Nodes:
            return interval_nodes(log.rows_for(model.surfaces), log.interval, model, moments)

        # A fit changes neither: a search asks for the same nodes a thousand times.
        key = "nodes", moments, tuple(model.surfaces), model.wheels.tobytes()
        return per_log(log, key, plain)._replace(readings=Readings.of(log))

    def unmetered(self) -> Nodes:
        """The same rows with the power as it is at the supply."""
        return self._replace(readings=None)


def interval_nodes(
    rows: Array, interval: Array, model: PowerModel, moments: int = MOMENTS
) -> Nodes:
    """The moments at which a model is to be evaluated for every row of a log.

    Args:
        rows: (n, ROW_LENGTH) means, ``surface`` counting in the model's list.
        interval: (n,) s.
        model: says how the wheels stand.
        moments: of every divided row.
    """
    vx, vy, wz = (rows[:, INDEX[name]] for name in ("vx", "vy", "wz"))
    # Body velocity changes by inertial acceleration less the turning of the frame.
    change_x = (rows[:, INDEX["ax"]] + wz * vy) * interval
    change_y = (rows[:, INDEX["ay"]] - wz * vx) * interval
    change_w = rows[:, INDEX["yaw_acceleration"]] * interval
    motion = np.stack([vx, vy, wz])
    change = np.stack([change_x, change_y, change_w])
    table = model.wheels
    axes = np.concatenate([table[:, 2:5], table[:, 5:8]])  # rim and roller speed of every wheel
    speed, moved = np.abs(axes @ motion), np.abs(axes @ change)
    divided = np.any((moved > DIVIDING_CHANGE * speed) & (moved > LEAST_SPEED_CHANGE), axis=0)
    places, shares = np.polynomial.legendre.leggauss(moments)
    count = np.where(divided, moments, 1)
    first = np.concatenate([[0], np.cumsum(count)])
    expanded = np.repeat(rows, count, axis=0)
    weight = np.ones(len(expanded))
    at = np.flatnonzero(divided)
    for number, (moment, share) in enumerate(zip(places / 2.0, shares / 2.0, strict=True)):
        place = first[at] + number
        weight[place] = share
        for name, step in zip(("vx", "vy", "wz"), change, strict=True):
            expanded[place, INDEX[name]] += moment * step[at]
    return Nodes(expanded, first, weight)
