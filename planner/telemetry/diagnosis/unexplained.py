"""What an answer leaves unexplained: its held-out error over the noise floor, and where it is.

    floor = floor_of(log, examination, explained)        # (n,) W, expected scatter of every row
    left = unexplained_by(log, residual, floor, watts)
    left.heldout_over_floor, left.where, left.little

The floor is the scatter that remains once the answer and the strongest further columns of the
design matrix have taken what they can. It is the error of a model that knew everything. Two things
make it larger than the noise of most rows:

    tails    the spread of the noise is a median; the mean square of the same rows is larger where
             the scatter differs from row to row (Huber's proposal 2 measures it)
    rest     where a wheel may stand or turn, errors of odometry decide the direction of friction;
             the scatter of these rows counts as it is
    change   where the power changes from row to row, so does what a slightly other moment shows,
             and errors of an acceleration that was derived; these rows count as they are, too

It is measured on held-out runs. A few rows must not decide. At most MOST_OUTLIERS of the rows,
those furthest out, count at the clip of the noise model.

No column may tell a load that switches, or a ground that changes, and then it looks like slow
noise. Meters drift little. A residual that lasts, and is larger than their drift, is a power.

Source
    P. J. Huber, Robust Statistics, Wiley 1981, section 6.4 (proposal 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import norm

from planner.arrays import Array, Integers
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import LinearHeldout, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted, noise_of, strongest_columns
from planner.telemetry.other_terms import GIVEN
from planner.telemetry.prediction import input_uncertainty
from planner.telemetry.regimes import Regime, regimes_of

MOST_OVER_FLOOR = 1.2
"""Held-out error over the noise floor up to which an answer explains a log."""
NEAR_RATIO = 1.05
"""Factor around a threshold within which a decision is called a near one."""
LEAST_STRUCTURE = 0.05
"""Share of the held-out squared error that the mean residual of a regime must make."""
STRUCTURE_CHANCE = 0.01
"""p-value of such a regime, after counting all regimes tried."""
TAIL = 2.0
"""Standard deviations at which proposal 2 bends; beyond lie 5 % of normal rows."""
LASTING = 2.0
"""s; what still is there after so long is slow. The filters of usual meters forget it sooner."""
MOST_DRIFT = 0.04
"""Slow power over mean power that meters, and the noise of the motion, may make. Meters wander by
one or two hundredths of what they read."""
SHARES = (1.0, 0.618, 0.382, 0.236)
"""Parts of that time, in the golden ratio: a power that swings is not back after all of them."""
COMPARED, LASTING_Z = 20.0, 3.0
"""s, stretches whose slow powers are compared, and standard errors that their mean must reach."""
UNSURE_GROUPS = 4
"""Groups of unsure rows, of at least 40 rows, whose own scatter is measured."""


@dataclass(frozen=True)
class Unexplained:
    """What an answer leaves of a log.

    Attributes:
        heldout_over_floor: held-out error of the answer over the noise floor; 1 is perfect. The
            floor is at most what correcting the worst of these regimes would leave.
        where: regimes whose mean residual makes a fair share of the held-out squared error.
        slow_w: W rms, what lasts longer than LASTING and is no drift of a meter; 0 where there is
            none. The floor does not hold it.
    """

    heldout_over_floor: float
    where: tuple[Regime, ...] = ()
    slow_w: float = 0.0

    @property
    def little(self) -> bool:
        """Whether the answer explains the log: an error near the floor, and no structure."""
        return self.heldout_over_floor <= MOST_OVER_FLOOR and not self.where

    @property
    def near(self) -> bool:
        """Whether the ratio is close to what decides."""
        return 1.0 / NEAR_RATIO < self.heldout_over_floor / MOST_OVER_FLOOR < NEAR_RATIO

    def to_json(self) -> dict[str, Any]:
        """The entry ``unexplained`` of a diagnosis."""
        return {
            "heldout_over_floor": self.heldout_over_floor,
            "where": [regime.to_json() for regime in self.where],
        }


def floor_of(
    log: Telemetry, examination: Examination, explained: Sequence[int], *, exact: bool = False
) -> Array:
    """(n,) W, standard deviation of every row that no model can undercut.

    Args:
        log: the rows that were examined.
        examination: of these rows.
        explained: columns of what was selected.
        exact: take data sheet and sensors for exact; otherwise their usual errors are explained.
    """
    raw, watts = examination.raw, examination.watts
    competitors = examination.competitors
    tangent = competitors.first_given if exact else competitors.tangent
    own = raw[:, [*range(tangent), *explained]]
    used = {*range(competitors.tangent), *explained, competitors.residual}
    rest = [k for k in range(raw.shape[1]) if k not in used]
    further = strongest_columns(raw[:, -1], own, raw[:, rest])
    columns = np.column_stack([own, raw[:, [rest[k] for k in further]]])
    model = competitors.library.held_model
    input_error = input_uncertainty(model, log.rows_for(model.surfaces))
    noise, left = noise_of(log, examination.residual, watts, input_error, columns)
    plain = noise.spread(watts, np.zeros(len(log)))
    floor = plain.copy()
    lively = np.abs(examination.given[:, -GIVEN.moments :]).sum(axis=1)
    for rows in _alike(np.hypot(input_error, lively) / plain):
        floor[rows] *= max(_scale(left[rows] / plain[rows]), 1.0)
    # What was fitted to these rows is below the error on others, slow noise above all. And columns
    # that do not hold on other rows, as in a log of a minute, explain nothing.
    held = LinearHeldout(log, examination, exact=exact)
    kinds = [[*explained, *(rest[k] for k in further[:count])] for count in range(len(further) + 1)]
    missed = min(rms(counted(held.residual_with(kind), floor)) for kind in kinds)
    return floor * max(missed, noise.floor_w, rms(floor)) / rms(floor)


def unexplained_by(log: Telemetry, residual: Array, floor: Array, watts: Array) -> Unexplained:
    """What an answer leaves of a log.

    Args:
        log: the rows.
        residual: (n,) W, held-out, measured less modelled.
        floor: (n,) W, from floor_of.
        watts: (n,) W, modelled.
    """
    kept = counted(residual, floor)
    where = [
        regime
        for regime in regimes_of(log, kept, floor, watts)
        # A bias everywhere is the electronics' power, or an offset of the meter.
        if regime.conditions
        and regime.explained >= LEAST_STRUCTURE
        and regime.chance < STRUCTURE_CHANCE
    ]
    # A model that knew everything would leave no mean residual there, and no slow power.
    known = max((regime.explained for regime in where), default=0.0)
    slow = _slow_power(log, kept, watts)
    least = min(rms(without_slow(floor, kept, slow)), math.sqrt(1.0 - known) * rms(kept))
    return Unexplained(rms(kept) / max(least, 1e-300), tuple(where), slow)


def without_slow(floor: Array, residual: Array, slow_w: float) -> Array:
    """The floor (n,) W, at most what is left of a residual (n,) W without what lasts, W rms."""
    fast = math.sqrt(max(rms(counted(residual, floor)) ** 2 - slow_w**2, 0.0))
    return floor * min(1.0, fast / rms(floor)) if slow_w else floor


def _slow_power(log: Telemetry, residual: Array, watts: Array) -> float:
    """W rms, the part of a residual (n,) W that lasts and is no drift; 0 where there is none.

    Products of rows some time apart have the square of that part as their mean. What swings comes
    back at some times, and is gone at others.
    """
    drift = (MOST_DRIFT * float(np.mean(np.abs(watts)))) ** 2
    least = math.inf
    for lag in LASTING * np.array(SHARES):
        mean, z = _product_apart(log, residual, float(lag))
        if mean <= drift or z < LASTING_Z:
            return 0.0
        least = min(least, mean)
    return math.sqrt(least)


def _product_apart(log: Telemetry, residual: Array, lag: float) -> tuple[float, float]:
    """W², the mean product of rows ``lag`` s apart in one stretch; and by how many standard errors
    such rows correlate.

    A power that is there now and then makes a few stretches large. How large it is, all rows tell;
    whether rows have it in common, each stretch of COMPARED tells as much as any other.
    """
    products, squares, blocks, count = [np.empty(0)], [np.empty(0)], [np.empty(0, np.int64)], 0
    for start, stop in log.segments():
        since, own = log.time[start:stop] - log.time[start], residual[start:stop]
        # Times are decimal: half a millionth of a second keeps rounding from deciding.
        later = np.searchsorted(since, since + lag - 5e-7)
        paired = np.flatnonzero(later < len(own))
        one, other = own[paired], own[later[paired]]
        products.append(one * other)
        squares.append(0.5 * (one**2 + other**2))
        blocks.append(count + (since[paired] // COMPARED).astype(np.int64))
        count += int(since[-1] // COMPARED) + 1
    product, block = np.concatenate(products), np.concatenate(blocks)
    if not len(product):
        return 0.0, 0.0
    rows, size = np.bincount(block), np.bincount(block, np.concatenate(squares))
    share = rows * np.bincount(block, product) / np.maximum(size, 1e-300)
    error = math.sqrt(float(np.sum((share - rows * share.sum() / rows.sum()) ** 2)))
    return float(product.mean()), float(share.sum()) / max(error, 1e-300)


def _alike(unsure: Array) -> list[Integers]:
    """Rows by how unsure they are, (n,) input error over noise: the sure ones, then the others."""
    order = np.argsort(unsure, kind="stable")
    sure = int(np.count_nonzero(unsure <= 1.0))
    others = np.array_split(order[sure:], max(1, min(UNSURE_GROUPS, (len(order) - sure) // 40)))
    return [rows for rows in (order[:sure], *others) if len(rows)]


def _scale(values: Array) -> float:
    """Standard deviation about 0 of values (n,) by Huber's proposal 2."""
    expected = 1.0 - 2.0 * TAIL * norm.pdf(TAIL) + 2.0 * (TAIL**2 - 1.0) * norm.sf(TAIL)
    scale = max(float(np.median(np.abs(values))) * 1.4826, 1e-12)
    for _ in range(20):
        cut = np.minimum(np.abs(values) / scale, TAIL)
        scale *= float(np.sqrt(np.mean(cut**2) / expected))
    return scale
