"""How far an energy takes the robot: the reachable area, there or there and back.

    reach = reachable_area(map="jacksboro-1to100", start={"x": 60, "y": 60}, energy_j=2000)
    reach.area_m2, reach.outlines

One least-cost field from the start (and one to it, for the way back) gives what every place takes.
Such a field knows nothing of speeding up, of bends and of turning, and its few directions lose a
per cent. So routes to places at the edge are driven in full
(planner.search.legs.reach_calibration), and the field is corrected by their ratio, interpolated
between them; the next round, at other places of the new edge, tells how good that is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import contourpy
import numpy as np
from scipy.ndimage import binary_erosion

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.progress import Progress, silent
from planner.quantities import STANDARD_GRAVITY
from planner.search.conditions import assumptions
from planner.search.field import CostField, sample_surface
from planner.search.grid import CostToGo
from planner.search.legs import EdgeRoutes
from planner.search.requests import ReachRequest, RequestLike
from planner.search.situation import Situation, check_hold, check_place
from planner.shown import Shown, frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas

Point = tuple[float, float]
FIRST_POINTS, EDGE_POINTS = 10, 30
"""Places at the edge whose routes are driven in the first round, and in each that follows. Bends
and ends are not in the field, so the first edge is too far out: it shows by how much on average."""
CALIBRATION_ROUNDS = 6
"""Rounds at most; two to four usually meet EDGE_TOLERANCE."""
EDGE_TOLERANCE, MET_BY = 0.015, 0.9
"""No further round is needed where so large a share of a round's new places had at most this
relative error. That is the error before they are taken into account; afterwards it is less.
The largest one would never do: some routes take 1 % more than their neighbours."""
NEAR_EDGE = 0.1
"""Share of the energy within which a node on an outline is at the edge: else a wall ends it."""
NEAREST = 0.7
"""Cells within which the distance to a place that was driven to no longer counts."""


@dataclass(frozen=True)
class Reach(Shown):
    """What can be reached with an energy.

    Attributes:
        terrain: the map.
        start: x, y, m.
        energy_j: J that there are to spend.
        and_back: whether that has to last for the way back.
        needed_j: (ny, nx) J that each node takes; infinite where there is no path.
        origin, cell: m, of the nodes.
        area_m2: horizontal area that can be reached.
        outlines: closed lines (k, 2) around it and around holes in it, m.
        error_share: largest relative error among the places at the edge of the last round, before
            their routes were taken into account; NaN without any.
        checked: places whose routes were driven in full.
        notes: what was assumed, and whether no route leads to parts of the edge, in sentences.
    """

    terrain: Terrain
    start: Point
    energy_j: float
    and_back: bool
    needed_j: Array
    origin: Point
    cell: Point
    area_m2: float
    outlines: tuple[Array, ...]
    error_share: float
    checked: int
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The area ready for JSON."""
        return {
            "start": {"x": self.start[0], "y": self.start[1]},
            "energy_j": self.energy_j,
            "and_back": self.and_back,
            "area_m2": self.area_m2,
            "outlines": [line.round(3).tolist() for line in self.outlines],
            "error_share": None if math.isnan(self.error_share) else self.error_share,
            "checked": self.checked,
            "notes": list(self.notes),
        }

    def to_frame(self) -> pandas.DataFrame:
        """The outlines as a DataFrame: ``outline`` counts them, ``x`` and ``y`` are corners, m."""
        corners = np.vstack([np.empty((0, 2)), *self.outlines])
        numbers = np.repeat(np.arange(len(self.outlines)), [len(line) for line in self.outlines])
        return frame({"outline": numbers, "x": corners[:, 0], "y": corners[:, 1]})


def reachable_area(
    request: ReachRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Reach:
    """The area that an energy reaches.

    Args:
        request: a ReachRequest, a mapping with its fields or the path of a JSON file; or give
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
    request, situation = Situation.asked(ReachRequest, request, fields, terrain, model)
    say = progress or silent
    budget = _budget(request, situation)
    field = situation.field("energy")
    ground, conditions = situation.ground, situation.conditions
    check_place("start", request.start, ground, field, conditions, request)
    check_hold("start", request.start, field, situation.conditions)
    say(0.1, "least-cost field")
    with CancellationToken(cancelled) as token:
        search = EdgeSearch(situation, field, request, budget, token)
        return _reached(search, request, say)


def _reached(search: EdgeSearch, request: ReachRequest, say: Progress) -> Reach:
    situation, field, budget = search.situation, search.field, search.budget
    factor = np.ones(field.heights.shape)
    routes = EdgeRoutes(situation, field, search.fields, request.start.yaw, search.token)
    error = math.nan
    for number in range(CALIBRATION_ROUNDS):
        say(0.2 + 0.7 * number / CALIBRATION_ROUNDS, "routes to the edge")
        edge = search.edge(search.needed(factor), number)
        if not edge:
            break
        driven = routes.drive(edge)
        if driven:
            errors = [abs(factor[node] / routes.ratio(node) - 1.0) for node in driven]
            error = max(errors)
            factor = search.interpolated(*routes.ratios())
            if number > 0 and np.quantile(errors, MET_BY) < EDGE_TOLERANCE:
                break
    needed = search.needed(factor)
    say(1.0, "done")
    lines = tuple(search.lines(needed))
    inside = needed <= budget
    return Reach(
        situation.ground.terrain,
        (request.start.x, request.start.y),
        budget,
        request.and_back,
        needed,
        (field.x0, field.y0),
        (field.dx, field.dy),
        float(inside.sum()) * field.dx * field.dy,
        lines,
        float(error),
        len(routes.legs),
        (*assumptions(request, situation.conditions, situation.ground.terrain), *_refused(routes)),
    )


def _refused(routes: EdgeRoutes) -> tuple[str, ...]:
    """What a user ought to know of the edge, where no route leads to some of it."""
    if not routes.refused:
        return ()
    count = len(routes.refused)
    return (
        f"to {count} of {count + len(routes.legs)} places at the edge a path leads, but no route "
        "within all limits; less than this area may be in reach",
    )


def _budget(request: ReachRequest, situation: Situation) -> float:
    """J that there are to spend."""
    if request.energy_j is not None:
        return request.energy_j
    capacity = situation.conditions.model.vehicle.battery.capacity
    if not math.isfinite(capacity):
        raise RequestError(
            "energy_j", "is missing, and the vehicle's battery is not known", accepted="J to spend"
        )
    charge = request.conditions.battery_charge
    return capacity * (1.0 if charge is None else charge)


class EdgeSearch:
    """The fields from and to a start, and routes to places at the edge of what they reach."""

    def __init__(
        self,
        situation: Situation,
        field: CostField,
        request: ReachRequest,
        budget: float,
        token: CancellationToken,
    ) -> None:
        self.situation, self.field, self.budget, self.token = situation, field, budget, token
        self.start = (request.start.x, request.start.y)
        self.weight = situation.conditions.mass * STANDARD_GRAVITY
        self.base = float(sample_surface(field, np.array([self.start]))[0][0])
        self.fields: list[CostToGo] = [situation.least_cost_from(field, self.start, token)]
        if request.and_back:
            self.fields.append(situation.least_cost_to("energy", field, self.start, token=token))
        self.dissipated = np.sum([f.values.astype(float) for f in self.fields], axis=0)

    def needed(self, factor: Array) -> Array:
        """J to every node (and back), with the field's costs times a factor (ny, nx)."""
        climb = 0.0 if len(self.fields) == 2 else self.weight * (self.field.heights - self.base)
        return np.asarray(self.dissipated * factor + climb)

    def lines(self, needed: Array) -> list[Array]:
        """The edge of what can be reached, as closed lines (k, 2) in m."""
        ny, nx = needed.shape
        field = self.field
        # Beyond the border nothing can be reached: the edge closes there.
        share = np.full((ny + 2, nx + 2), 2.0)
        share[1:-1, 1:-1] = np.minimum(needed / self.budget, 2.0)
        x = field.x0 + field.dx * np.arange(-1, nx + 1)
        y = field.y0 + field.dy * np.arange(-1, ny + 1)
        x[[0, -1]] = x[[1, -2]] + np.array([-0.5, 0.5]) * field.dx
        y[[0, -1]] = y[[1, -2]] + np.array([-0.5, 0.5]) * field.dy
        return [np.asarray(line) for line in contourpy.contour_generator(x, y, share).lines(1.0)]

    def edge(self, needed: Array, number: int) -> list[Point]:
        """Places on the edge, evenly along it, others in every round.

        None beside a wall or at the map's border: there it is not the energy that ends the area.
        """
        spots = []
        reached = np.isfinite(needed) & (self.field.mask != 0)
        inner = binary_erosion(reached, np.ones((3, 3), bool))
        for line in self.lines(needed):
            rows, columns = self.field.nodes_at(line)
            near = np.abs(needed[rows, columns] / self.budget - 1.0) < NEAR_EDGE
            spots.append(line[near & inner[rows, columns]])
        points = np.vstack(spots) if spots else np.empty((0, 2))
        if not len(points):
            return []
        count = EDGE_POINTS if number else FIRST_POINTS
        share = (np.arange(count) + number / CALIBRATION_ROUNDS) / count
        picked = points[np.unique((share * len(points)).astype(int))]
        return [(float(x), float(y)) for x, y in picked]

    def interpolated(self, places: Array, ratios: Array) -> Array:
        """The ratio everywhere (ny, nx): the mean of those that were seen, near ones first."""
        ny, nx = self.field.heights.shape
        x = self.field.x0 + self.field.dx * np.arange(nx)[None, :]
        y = self.field.y0 + self.field.dy * np.arange(ny)[:, None]
        weights, total = np.zeros((ny, nx)), np.zeros((ny, nx))
        softening = (NEAREST * max(self.field.dx, self.field.dy)) ** 2
        for (px, py), ratio in zip(places, ratios, strict=True):
            weight = 1.0 / ((x - px) ** 2 + (y - py) ** 2 + softening) ** 2
            weights += weight
            total += weight * ratio
        return np.asarray(total / weights)
