"""Subgroup discovery: regimes of motion in which the residual has structure, in words.

    regimes = regimes_of(log, residual, noise.spread)
    print(regimes[0].sentence)  # "sideways faster than 0.4 m/s: +3.1 W, 41 % of the squared error"

The residual is measured minus model: positive where the robot needs more than the model says. A
regime is one condition or two on different axes (heading, speed, slope, turning, braking, load,
temperature, time, ground). Which conditions, and with which thresholds, is searched: the one whose
bias explains most of the squared error comes first, its bias is taken off, and the search goes on.
Only what chance alone would not bring forth is taken, see search: with
nothing to be found nothing is reported, however long the log and however its noise hangs together.

Left out
    regimes in which only the scatter is larger; three conditions at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Array, Integers, Mask
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import all_axes
from planner.telemetry.regimes.conditions import Condition, conditions_on, refined
from planner.telemetry.regimes.search import Search, box_sums, cells
from planner.telemetry.regimes.units import LEAST_CLUSTERS, units_of

MOST_REGIMES = 6
"""Regimes that are reported; more would hide the largest."""
LEAST_EXPLAINED = 0.02
"""Share of the squared error that a regime's bias must explain to be worth a line."""
ONE_CONDITION_FACTOR, TWO_CONDITIONS_FACTOR = 0.9, 0.8
"""Share of the explained error that counts: 1 for "everywhere", less for every condition."""
MOST_SHARED_ROWS = 0.5
"""Rows that two regimes share, over those of the smaller one, before biases are compared."""
OTHER_BIAS, SAME_AXES_BIAS = 1.5, 2.0
"""Ratio of biases from which an overlapping regime is reported too; the latter on the same axes."""
HIDDEN_SHARE = 0.2
"""Share of the squared error left, below which the search starts again on the remainder."""
_LEAST_STEP_SHARE = 0.5
"""Share of LEAST_EXPLAINED that a further bias must explain for the search to go on."""
_TRIES_PER_REGIME = 6
"""Candidates that are tried for every regime reported."""
_ORDER = ("surface", "load", "slope_along", "slope_across", "heading", "speed")


@dataclass(frozen=True)
class Regime:
    """A part of the log in which the model is off.

    Attributes:
        where: in words; "everywhere" for all rows.
        rows: how many.
        bias_w: W, mean of measured minus model.
        rmse_w: W.
        share_of_squared_error: of the whole log's.
        explained: share of the whole log's squared error that the bias alone makes.
        stderr_w: W, standard error of the bias, by independent pieces of the log.
        chance: probability that a search over as many conditions finds such a bias in noise.
        conditions: the same as ``where`` for programs; all must be met.
    """

    where: str
    rows: int
    bias_w: float
    rmse_w: float
    share_of_squared_error: float
    explained: float
    stderr_w: float
    chance: float
    conditions: tuple[Condition, ...]

    @property
    def sentence(self) -> str:
        """One line: where, how many watts, how much of the squared error."""
        share = 100.0 * self.share_of_squared_error
        return f"{self.where}: {self.bias_w:+.2g} W, {share:.0f} % of the squared error"

    def holds(self, axes: Mapping[str, Array]) -> Mask:
        """Rows of this regime, (n,) bool.

        Args:
            axes: values by name, each (n,), as given to find_regimes.
        """
        return _met(self.conditions, axes)

    def to_json(self) -> dict[str, Any]:
        """Ready for strict JSON."""
        document = {k: v for k, v in vars(self).items() if k not in ("explained", "chance")}
        return {**document, "conditions": [condition.to_json() for condition in self.conditions]}


def regimes_of(log: Telemetry, residual: Array, noise: Array, watts: Array) -> list[Regime]:
    """Regimes of a log over all axes of its rows, and over the predicted power.

    Args:
        log: n rows.
        residual: (n,) W, measured minus model.
        noise: (n,) W, spread of the noise.
        watts: (n,) W, modelled.
    """
    axes = all_axes(log.rows, watts=watts)
    return find_regimes(axes, residual, log.run, noise, log.surfaces)


def find_regimes(
    axes: Mapping[str, Array], residual: Array, run: Integers, noise: Array, surfaces: Sequence[str]
) -> list[Regime]:
    """Find the regimes in which a residual has structure.

    Args:
        axes: values by name (see quantities_of_motion), each (n,), NaN where not known; "surface"
            holds numbers of ``surfaces``.
        residual: (n,) W, measured minus model; rows that are not finite are left out.
        run: (n,) which run a row belongs to; rows of a run stand together, in time's order.
        noise: (n,) W, spread of the noise. Rows with less say more.
        surfaces: names of the grounds.

    Returns:
        Regimes, that with the largest share of the squared error first; none when there is no
        structure, or too little data to tell.
    """
    kept = np.isfinite(residual)
    if not kept.all():
        axes = {name: values[kept] for name, values in axes.items()}
        residual, run, noise = residual[kept], run[kept], noise[kept]
    total = float(residual @ residual)
    if len(residual) < 2 * LEAST_CLUSTERS or total == 0.0:
        return []
    units = units_of(run, residual)
    if units.clusters < LEAST_CLUSTERS:
        return []
    bins = [conditions_on(name, values, labels=surfaces) for name, values in axes.items()]
    known = [axis for axis in bins if axis is not None]
    weight = _weight(noise)
    found: list[Regime] = []
    masks: list[Mask] = []
    left = residual.copy()
    squares = np.inf
    # What a large bias hid from the tests stands out once that is taken off: search again.
    while len(found) < MOST_REGIMES and float(left @ left) < HIDDEN_SHARE * squares:
        squares = float(left @ left)
        search = Search(known, left, weight, units)
        candidates = _Candidates(search, left, total)
        for _ in range(_TRIES_PER_REGIME * MOST_REGIMES):
            conditions = candidates.best(left, total)
            if conditions is None or len(found) == MOST_REGIMES:
                break
            conditions = _refined(conditions, axes, left)
            met = _met(conditions, axes)
            sides = _sides(conditions, met, axes)
            if not met.any() or not _stands_out(sides, left, len(conditions), search):
                candidates.drop()
                continue
            left[met] -= left[met].mean()
            regime = _regime(conditions, met, sides, residual, total, search)
            repeated = any(
                _says_the_same(regime, met, *other) for other in zip(found, masks, strict=True)
            )
            if regime.explained >= LEAST_EXPLAINED and not repeated:
                found.append(regime)
                masks.append(met)
    return sorted(found, key=lambda regime: -regime.share_of_squared_error)


def _met(conditions: Sequence[Condition], axes: Mapping[str, Array]) -> Mask:
    met = np.ones(len(next(iter(axes.values()))), bool)
    for condition in conditions:
        met &= condition.holds(axes[condition.axis])
    return met


def _sides(conditions: tuple[Condition, ...], met: Mask, axes: Mapping[str, Array]) -> list[Mask]:
    """The rows of a regime, and those on the other side of its only bound, if it has just one.

    A contrast with the rest of the log is one of both sides. Where one of them holds few rows in
    few clusters, the other one may show it more surely.
    """
    rest = conditions[0].rest if len(conditions) == 1 else None
    if rest is None:
        return [met]
    other = rest.holds(axes[rest.axis])
    return [met, other] if other.any() else [met]


def _stands_out(sides: Sequence[Mask], left: Array, axes: int, search: Search) -> bool:
    return any(
        abs(search.excess_of(side, left, axes)) >= 1.0 and search.runs_agree(side, left)
        for side in sides
    )


def _refined(
    conditions: tuple[Condition, ...], axes: Mapping[str, Array], left: Array
) -> tuple[Condition, ...]:
    """Thresholds between the bins, one condition after the other."""
    done = list(conditions)
    for number, condition in enumerate(done):
        others = _met([*done[:number], *done[number + 1 :]], axes)
        done[number] = refined(condition, axes[condition.axis][others], left[others])
    return tuple(done)


def _weight(noise: Array) -> Array:
    middle = float(np.median(noise))
    if not middle > 0.0:
        return np.ones(len(noise))
    # Rows that seem to have next to no noise must not decide everything.
    return np.asarray((middle / np.maximum(noise, middle / 2.0)) ** 2)


class _Candidates:
    """Sets of rows that stand out from chance, and which of them explains most of what is left."""

    def __init__(self, search: Search, residual: Array, total: float) -> None:
        self.search = search
        self.axes = search.axes
        self._counts: list[Array] = []
        self._sign: list[Array] = []
        self._merit: list[Array] = []
        ones = np.ones(len(residual))
        for pair, excess in zip(search.pairs, search.excess, strict=True):
            count = np.maximum(self._box(ones, pair), 1.0)
            sums = self._box(residual, pair)
            if pair[1] < 0:
                excess = self._surer(excess, pair[0])
            stands_out = np.abs(excess) > 1.0
            stands_out &= (sums * sums / count > LEAST_EXPLAINED * total) & (sums * excess > 0.0)
            self._counts.append(count)
            self._sign.append(np.sign(sums))
            self._merit.append(np.where(stands_out, self._plain(pair), 0.0))
        whole = float(residual.sum())
        self._everywhere = float(abs(search.excess_of(ones > 0.0, residual, 1)) > 1.0)
        self._everywhere *= float(whole * whole / len(residual) > LEAST_EXPLAINED * total)
        self._last: tuple[int, int] = (-1, 0)

    def best(self, left: Array, total: float) -> tuple[Condition, ...] | None:
        """Conditions of the best set for the residual that is left, (n,); None: all are small."""
        gain = LEAST_EXPLAINED * total * _LEAST_STEP_SHARE
        self._last = (-2, 0)
        if self._everywhere:
            whole = float(left.sum()) ** 2 / len(left)
            if whole > gain:
                gain, self._last = whole, (-1, 0)
        for number, merit in enumerate(self._merit):
            if not merit.any():
                continue
            sums = self._box(left, self.search.pairs[number])
            score = np.where(sums * self._sign[number] > 0.0, merit, 0.0)
            score = score * sums * sums / self._counts[number]
            at = int(np.argmax(score))
            if score.flat[at] > gain:
                gain, self._last = float(score.flat[at]), (number, at)
        return self._conditions()

    def drop(self) -> None:
        """Never offer the last one again."""
        number, at = self._last
        if number == -1:
            self._everywhere = 0.0
        else:
            self._merit[number].flat[at] = 0.0

    def _conditions(self) -> tuple[Condition, ...] | None:
        number, at = self._last
        if number == -2:
            return None
        if number == -1:
            return ()
        a, b = self.search.pairs[number]
        if b < 0:
            return (self.axes[a].sets[at],)
        first, second = (np.flatnonzero(self.axes[k].paired) for k in (a, b))
        return (
            self.axes[a].sets[first[at // len(second)]],
            self.axes[b].sets[second[at % len(second)]],
        )

    def _surer(self, excess: Array, axis: int) -> Array:
        """Excess (sets,) of conditions on one axis, or of the other side where that is larger."""
        place = {condition: k for k, condition in enumerate(self.axes[axis].sets)}
        rest = [place.get(c.rest, k) if c.rest else k for k, c in enumerate(place)]
        other = np.where(np.arange(len(rest)) == rest, excess, -excess[rest])
        return np.where(np.abs(other) > np.abs(excess), other, excess)

    def _plain(self, pair: tuple[int, int]) -> Array:
        a, b = pair
        if b < 0:
            return ONE_CONDITION_FACTOR * np.array([c.plain for c in self.axes[a].sets])
        first, second = (
            np.array([c.plain for c in self.axes[k].sets])[self.axes[k].paired] for k in (a, b)
        )
        return np.asarray(ONE_CONDITION_FACTOR * TWO_CONDITIONS_FACTOR * first[:, None] * second)

    def _box(self, values: Array, pair: tuple[int, int]) -> Array:
        cell, shape = cells(self.axes, pair)
        sums = np.bincount(cell, values, int(np.prod(shape))).reshape(shape)
        return box_sums(self.axes, sums.astype(float), pair).astype(float)


def _regime(
    conditions: tuple[Condition, ...],
    met: Mask,
    sides: Sequence[Mask],
    residual: Array,
    total: float,
    search: Search,
) -> Regime:
    inside = residual[met]
    bias, squares = float(inside.mean()), float(inside @ inside)
    ordered = tuple(sorted(conditions, key=_order))
    return Regime(
        where=words_of(ordered),
        rows=len(inside),
        bias_w=bias,
        rmse_w=float(np.sqrt(squares / len(inside))),
        share_of_squared_error=squares / total,
        explained=len(inside) * bias * bias / total,
        stderr_w=search.stderr_of(met, residual),
        chance=min(search.chance_of(side, residual, len(conditions)) for side in sides),
        conditions=ordered,
    )


def _says_the_same(regime: Regime, met: Mask, other: Regime, other_met: Mask) -> bool:
    shared = np.count_nonzero(met & other_met)
    if shared <= MOST_SHARED_ROWS * min(regime.rows, other.rows):
        return False
    ratio = regime.bias_w / other.bias_w if other.bias_w != 0.0 else np.inf
    same = {c.axis for c in regime.conditions} == {c.axis for c in other.conditions}
    least = SAME_AXES_BIAS if same else OTHER_BIAS
    return bool(1.0 / least < ratio < least)


def words_of(conditions: Sequence[Condition]) -> str:
    """Conditions as a part of a sentence, "everywhere" when there are none."""
    if not conditions:
        return "everywhere"
    together = {"heading", "speed"} == {c.axis for c in conditions}
    return (" " if together else ", ").join(c.words for c in conditions)


def _order(condition: Condition) -> int:
    return _ORDER.index(condition.axis) if condition.axis in _ORDER else len(_ORDER)
