"""The energy from each of many places to each of many others.

    matrix = energy_matrix(map="warehouse", starts=[{"x": 2, "y": 2}, {"x": 27, "y": 17}])
    matrix.energy_j                    # (starts, goals), infinite where there is no route

One least-cost field answers for all starts of a goal. Its costs know nothing of speeding up, of
bends and of turning, so some pairs are driven in full and the others are corrected by what these
show: dissipated energy = a · field + b. Up to ``DRIVEN_PAIRS``, all are driven.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.power.model import PowerModel
from planner.progress import Progress, silent
from planner.quantities import STANDARD_GRAVITY
from planner.search.conditions import assumptions
from planner.search.field import CostField, sample_surface
from planner.search.grid import cost_from
from planner.search.legs import LegPlanner
from planner.search.requests import MatrixRequest, PoseRequest, RequestLike
from planner.search.situation import Situation, check_hold, check_place
from planner.shown import Shown, frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas

DRIVEN_PAIRS = 32
"""Pairs that are driven in full; enough to fit two coefficients well within a second or two."""


@dataclass(frozen=True)
class Matrix(Shown):
    """Energies between places.

    Attributes:
        starts, goals: the places.
        energy_j: (starts, goals) J; infinite where there is no path, or none that can be driven.
        driven: (starts, goals) True where a motion was looked for in full.
        error_share: relative error of the corrected energies that nine of ten driven pairs keep
            to, each predicted by the others; 0 where all were driven, NaN where too few were.
        notes: what was assumed, in sentences.
    """

    starts: tuple[PoseRequest, ...]
    goals: tuple[PoseRequest, ...]
    energy_j: Array
    driven: NDArray[np.bool_]
    error_share: float
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The matrix ready for JSON; None where there is no route."""
        return {
            "starts": [place.model_dump(exclude_none=True) for place in self.starts],
            "goals": [place.model_dump(exclude_none=True) for place in self.goals],
            "energy_j": [
                [value if math.isfinite(value) else None for value in row]
                for row in self.energy_j.tolist()
            ],
            "driven": int(self.driven.sum()),
            "error_share": None if math.isnan(self.error_share) else self.error_share,
            "notes": list(self.notes),
        }

    def to_frame(self) -> pandas.DataFrame:
        """The energies as a DataFrame, J; a row for each start, a column for each goal.

        Both are labelled by number; infinite where there is no route.
        """
        table = frame({k: self.energy_j[:, k].copy() for k in range(len(self.goals))})
        return table.rename_axis(index="start", columns="goal")


def energy_matrix(
    request: MatrixRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Matrix:
    """Energies from every start to every goal.

    Args:
        request: a MatrixRequest, a mapping with its fields or the path of a JSON file; or give
            the fields as keywords.
        terrain, model: already there, instead of those that the request names; a text or a path
            as model is the request's field ``model``.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``; ``map`` may be a Terrain,
            ``vehicle`` a Vehicle and ``model`` a PowerModel.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    request, situation = Situation.asked(MatrixRequest, request, fields, terrain, model)
    field = situation.field("energy")
    starts, goals = request.starts, request.goals or request.starts
    for name, places in (("starts", starts), ("goals", goals)):
        for k, place in enumerate(places):
            check_place(
                f"{name}[{k}]",
                *(place, situation.ground, field, situation.conditions, request),
            )
            check_hold(f"{name}[{k}]", place, field, situation.conditions)
    with CancellationToken(cancelled) as token:
        found = _filled(situation, field, starts, goals, progress or silent, token)
    notes = assumptions(request, situation.conditions, situation.ground.terrain)
    return replace(found, notes=(*notes, *found.notes))


def _filled(
    situation: Situation,
    field: CostField,
    starts: tuple[PoseRequest, ...],
    goals: tuple[PoseRequest, ...],
    progress: Progress,
    token: CancellationToken,
) -> Matrix:
    done = 0

    def column(goal: PoseRequest) -> list[float]:
        nonlocal done
        token.check()
        least_cost_to = situation.least_cost_to("energy", field, (goal.x, goal.y), token=token)
        costs = [cost_from(field, least_cost_to, (start.x, start.y)) for start in starts]
        done += 1
        progress(0.7 * done / len(goals), f"{done} of {len(goals)} fields")
        return costs

    with ThreadPoolExecutor(max_workers=2) as pool:
        dissipated = np.array(list(pool.map(column, goals))).T
    weight = situation.conditions.mass * STANDARD_GRAVITY
    heights = [
        sample_surface(field, np.array([[place.x, place.y] for place in places]))[0]
        for places in (starts, goals)
    ]
    climbed = weight * (heights[1][None, :] - heights[0][:, None])
    pairs = _spread_pairs(dissipated)
    driven = np.zeros(dissipated.shape, np.bool_)
    seen: list[tuple[float, float]] = []
    exact = dissipated.copy()
    legs = LegPlanner(situation, field, token)

    def drive(pair: tuple[int, int]) -> float | None:
        token.check()
        start, goal = starts[pair[0]], goals[pair[1]]
        path = situation.path("energy", field, (start.x, start.y), (goal.x, goal.y))
        if path is None or len(path) < 2:
            return None
        leg = legs.near(path, (start.yaw, goal.yaw))
        return None if leg is None else leg.route.energy_j

    with ThreadPoolExecutor(max_workers=2) as pool:
        for number, (pair, energy) in enumerate(
            zip(pairs, pool.map(drive, pairs), strict=True), start=1
        ):
            progress(0.7 + 0.3 * number / len(pairs), f"{number} of {len(pairs)} motions")
            driven[pair] = True
            exact[pair] = math.inf
            if energy is not None:
                exact[pair] = energy - climbed[pair]
                seen.append((float(dissipated[pair]), float(exact[pair])))
    corrected, error = _corrected(dissipated, np.array(seen).reshape(-1, 2))
    result = np.where(driven, exact, corrected) + climbed
    same = np.array([[(a.x, a.y) == (b.x, b.y) for b in goals] for a in starts])
    result[same & ~driven] = 0.0
    estimated = np.isfinite(result) & ~driven & ~same
    refused = len(pairs) - len(seen)
    notes = () if not refused or not estimated.any() else (_may_have_none(refused, len(pairs)),)
    return Matrix(starts, goals, result, driven, error if estimated.any() else 0.0, notes)


def _may_have_none(refused: int, driven: int) -> str:
    """What a user ought to know of pairs that were not driven, where some have no route."""
    return (
        f"{refused} of {driven} pairs that were driven have a path but no route within all limits; "
        "of the other pairs, whose energies are estimates, some may have none either"
    )


def _spread_pairs(dissipated: Array) -> list[tuple[int, int]]:
    """Pairs to drive: all of few, else evenly from the cheapest to the most expensive."""
    possible = np.argwhere(np.isfinite(dissipated) & (dissipated > 0.0))
    order = possible[np.argsort(dissipated[tuple(possible.T)], kind="stable")]
    if len(order) > DRIVEN_PAIRS:
        order = order[np.linspace(0, len(order) - 1, DRIVEN_PAIRS).round().astype(int)]
    return [(int(a), int(b)) for a, b in order]


def _corrected(dissipated: Array, seen: Array) -> tuple[Array, float]:
    """a · field + b by the driven pairs, and the error that nine of ten keep to, each left out."""
    if len(seen) < 4:
        return dissipated, math.nan
    # Relative errors count: each pair is weighted by its own energy.
    design = np.column_stack([seen[:, 0], np.ones(len(seen))]) / seen[:, 1:]
    ones = np.ones(len(seen))
    slope, offset = np.linalg.lstsq(design, ones, rcond=None)[0]
    hat = np.einsum("ij,ji->i", design, np.linalg.pinv(design))
    errors = (design @ np.array([slope, offset]) - ones) / np.maximum(1.0 - hat, 1e-6)
    return slope * dissipated + offset, float(np.quantile(np.abs(errors), 0.9))
