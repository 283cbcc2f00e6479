"""Why a start is refused and why there is no route, in one sentence that names the place."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from planner.amounts import span
from planner.arrays import Array
from planner.errors import RequestError
from planner.power.limits import LIMIT_NAMES, broken_limit
from planner.power.motion_row import set_motion
from planner.power.sanity import oddities
from planner.power.vehicles import Vehicle
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.limit_places import Infeasible
from planner.search.requests import PoseRequest, SituationRequest
from planner.search.resolution import ALL_YAWS, DIRECTIONS, YAW_BINS
from planner.search.situation.bottleneck import Node, bottleneck
from planner.search.situation.narrow_passage import narrowest_place, passage_width
from planner.search.situation.remedies import limit_on_slope, remedy
from planner.search.situation.traversability import DrivingGround
from planner.terrain.footprint import body_fits
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate

if TYPE_CHECKING:
    from planner.search.situation.situation import Situation

Place = tuple[float, float]
STEEP_SHARE = 0.5
"""Share of a limit that driving straight up must take to be what refuses a turn: bends and ramps
take up to as much again."""
YAW_TRIES = 64
"""Yaw angles over a full turn at which a place is tried, where the request leaves the yaw free."""


def check_place(
    name: str,
    pose: PoseRequest,
    ground: DrivingGround,
    field: CostField,
    conditions: OperatingConditions,
    request: SituationRequest,
) -> None:
    """Refuse a start, goal or via point at which there is no room for the robot.

    Args:
        name: field of the request.
        pose: the place, with or without a yaw.
        ground, field, conditions: map and model.
        request: its areas to avoid stand on the map as obstacles.

    Raises:
        RequestError: naming the field, the place and what would be accepted.
    """
    terrain = ground.terrain
    x, y = pose.x, pose.y
    west, south, east, north = terrain.extent
    if not terrain.contains(x, y):
        raise RequestError(
            name,
            "outside the map",
            value=(x, y),
            accepted=f"x from {span(west, east)}, y from {span(south, north)} m",
        )
    j, i = field.nodes_at((x, y))
    if ground.blocked[j, i]:
        what = _what_blocks(ground, x, y)
        article = {"obstacle": "on an obstacle", "hole": "on a hole (height unknown)"}
        area = _area_at(request, ground.terrain, x, y)
        raise RequestError(
            name,
            f"in {area}" if area else article.get(what, f"on a {what}"),
            value=(x, y),
            accepted=_nearest_free(ground, field, x, y),
        )
    yaws = _tried(pose.yaw)
    if not any(body_fits(field, x, y, yaw) for yaw in yaws):
        at = "with this yaw" if pose.yaw is not None else "with any yaw"
        touched = _touched(request, ground, x, y)
        raise RequestError(
            name,
            f"the body with {conditions.model.vehicle.limits.clearance:g} m clearance touches "
            f"{touched} {at}",
            value=(x, y) if pose.yaw is None else (x, y, pose.yaw),
            accepted=_nearest_free(ground, field, x, y, pose.yaw),
        )


def _tips(vehicle: Vehicle, row: Array) -> bool:
    """Whether a load's place leaves some wheel without weight, whatever effects the model has."""
    places = np.vstack([np.ones(vehicle.layout.wheel_count), vehicle.layout.table[:, :2].T])
    centre = np.array([1.0, row[INDEX["com_x"]], row[INDEX["com_y"]]])
    return bool((np.linalg.pinv(places) @ centre).min() <= 0.0)


def check_hold(
    name: str, pose: PoseRequest, field: CostField, conditions: OperatingConditions
) -> None:
    """Refuse a place at which the robot cannot stand still on the slope.

    Raises:
        RequestError: naming the field, the slope and what would be accepted; the load or the
            vehicle where it cannot stand anywhere.
    """
    _, gradient = sample_surface(field, np.array([[pose.x, pose.y]]))
    px, py = float(gradient[0, 0]), float(gradient[0, 1])
    kind = field.ground[field.nodes_at((pose.x, pose.y))]
    row = conditions.class_rows[kind].copy()
    set_motion(row, 0.0, 0.0, 0.0, 0.0, 0.0)
    broken = broken_limit(conditions.model.evaluate(row[None])[0][0], conditions.limits)
    loaded = conditions.mass > conditions.model.vehicle.mass
    if broken < 0 and loaded and _tips(conditions.model.vehicle, row):
        broken = LIMIT_NAMES.index("wheel load")
    if broken >= 0:
        raise RequestError(
            "payload" if loaded else "vehicle",
            f"the robot, {conditions.mass:.4g} kg, cannot stand even on level ground: "
            f"{LIMIT_NAMES[broken]}",
            accepted="a centre of mass between the wheels, and a load that the motors can hold",
        )
    for yaw in _tried(pose.yaw):
        set_motion(row, px, py, yaw, 0.0, 0.0)
        accounts, _ = conditions.model.evaluate(row[None])
        broken = broken_limit(accounts[0], conditions.limits)
        if broken < 0:
            return
    # With a fitting yaw this slope can be driven in every direction.
    least = float(field.limit[kind, : DIRECTIONS // 2].min()) * field.margin
    odd = "".join(f"; odd in the vehicle's file: {said}" for said in oddities(conditions.model)[:1])
    raise RequestError(
        name,
        f"the slope of {math.degrees(math.atan(math.hypot(px, py))):.1f}° there cannot be held: "
        f"{LIMIT_NAMES[broken]}",
        value=(pose.x, pose.y),
        accepted=f"a slope of at most {math.degrees(math.atan(max(least, 0.0))):.1f}°{odd}",
    )


def explain_no_route(
    situation: Situation,
    objective: str,
    field: CostField,
    ends: tuple[Place, Place],
    request: SituationRequest,
) -> Infeasible:
    """What is in the way between two places, with what would do.

    The widest gap that is too narrow, or the gentlest slope that is too steep, on the path where
    that is least. Fields of the search that failed are read again, not worked out.

    Args:
        situation, objective, field: map and costs of the search that found no path.
        ends: start and goal.
        request: its areas to avoid stand on the map as obstacles.
    """
    ground, (start, goal) = situation.ground, ends
    if float(field.limit.max()) <= 0.0:
        level = limit_on_slope(situation.conditions, 0, 0.0, *start)
        loaded = " with its payload" if request.payload.mass > 0.0 else ""
        words = (
            f"the robot, {situation.conditions.mass:.4g} kg{loaded}, cannot drive even on "
            "level ground: it is too heavy or too weak for it"
        )
        return replace(level, what=words + remedy(situation.conditions, level))
    to_goal = np.isfinite(situation.least_cost_to(objective, field, goal, start).values)
    from_start = np.isfinite(situation.least_cost_from(field, start, objective=objective).values)
    straight = math.atan2(goal[1] - start[1], goal[0] - start[0])
    for reach, words, (x, y) in (
        (to_goal, "the goal cannot be reached", goal),
        (from_start, "the start cannot be left", start),
    ):
        if not reach.any():
            steps = ((a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b)
            ring = [(x, y), *((x + field.dx * a, y + field.dy * b) for a, b in steps)]
            what, bx, by = _blocking(ground, field, ring, straight, request)
            return Infeasible(bx, by, f"{words}: {what} at x {bx:.2f}, y {by:.2f}")
    begun, ended = _node(field, start), _node(field, goal)
    return (
        _too_narrow(ground, start, goal)
        or _too_steep(situation.conditions, ground, field, begun, ended)
        or _between(ground, field, from_start, to_goal, straight, request)
    )


def not_driven(conditions: OperatingConditions, field: CostField, where: Infeasible) -> Infeasible:
    """What is in the way of a path that the robot cannot drive, as a sentence, with what would do.

    Args:
        conditions, field: model and map.
        where: the robot cannot go on. If no yaw leads on, though nothing solid is near, the limit
            is that which driving straight up the slope comes nearest to.
    """
    found = where
    if not (where.limit or where.for_want_of_room):
        found = _on_slope(conditions, field, where)
    what = f"a way was found, but at x {where.x:.2f}, y {where.y:.2f} {found.what}"
    return replace(found, what=what + remedy(conditions, found))


def _on_slope(conditions: OperatingConditions, field: CostField, where: Infeasible) -> Infeasible:
    """The same with the limit that is nearest on the steepest ground within a cell.

    On gentle ground it stays as it is.
    """
    beside = itertools.product((-1.0, 0.0, 1.0), repeat=2)
    at = np.array([(where.x + a * field.dx, where.y + b * field.dy) for a, b in beside])
    slope = float(np.hypot(*sample_surface(field, at)[1].T).max())
    kind = int(field.ground[field.nodes_at((where.x, where.y))])
    cause = limit_on_slope(conditions.steady, kind, slope, where.x, where.y)
    share = cause.value / cause.allowed
    if not share > STEEP_SHARE:
        return where
    if conditions.lasting and cause.limit == "torque peak":
        cause = replace(cause, limit="torque rms")
    what = f"{where.what}, on {cause.what}"
    if share <= 1.0:
        what += f" (straight up takes {100.0 * share:.0f} % of the {cause.limit} allowed)"
    return replace(cause, what=what)


def _node(field: CostField, place: Place) -> Node:
    j, i = field.nodes_at(place)
    return int(j), int(i)


def _too_narrow(ground: DrivingGround, start: Place, goal: Place) -> Infeasible | None:
    """The widest gap on any path, where the body with its clearance does not pass it."""
    found = narrowest_place(ground, start, goal)
    if found is None:
        return None
    place, _ = found
    width = passage_width(ground, place)
    needed = 2.0 * ground.half_width
    if width >= needed:
        return None
    x, y = place
    missing = max(math.ceil(100.0 * (needed - width) - 1e-6), 1)
    return Infeasible(
        x,
        y,
        f"no way from start to goal: the widest passage is too narrow, {width:.2f} m at x {x:.2f}, "
        f"y {y:.2f}; the body with clearance needs {needed:.2f} m, {missing} cm more",
        limit="clearance",
        value=width,
        allowed=needed,
    )


def _too_steep(
    conditions: OperatingConditions,
    ground: DrivingGround,
    field: CostField,
    start: Node,
    goal: Node,
) -> Infeasible | None:
    """The gentlest slope that some path needs, where it is steeper than the robot climbs."""
    slope_y, slope_x = np.gradient(field.heights, field.dy, field.dx)
    steepness = np.hypot(slope_x, slope_y)
    # Across a ridge somewhere the travel goes straight up.
    allowed = np.maximum(field.limit[field.ground, 0] * field.margin, 1e-6)
    found = bottleneck(np.where(ground.mask == 0, np.inf, steepness / allowed), start, goal)
    if found is None or found[0] <= 1.0:
        return None
    j, i = found[1]
    x, y = field.x0 + field.dx * i, field.y0 + field.dy * j
    slope = float(steepness[j, i])
    cause = limit_on_slope(conditions.steady, int(field.ground[j, i]), slope, x, y)
    if conditions.lasting and cause.limit == "torque peak":
        cause = replace(cause, limit="torque rms")
    most = math.degrees(math.atan(float(allowed[j, i])))
    return replace(
        cause,
        what=f"no way from start to goal: the gentlest crossing has {cause.what} at x {x:.2f}, "
        f"y {y:.2f}, above the limit of {most:.1f}°{remedy(conditions, cause)}",
    )


def _between(
    ground: DrivingGround,
    field: CostField,
    from_start: NDArray[np.bool_],
    to_goal: NDArray[np.bool_],
    straight: float,
    request: SituationRequest,
) -> Infeasible:
    """What stands where the places reached from the start come nearest to those of the goal."""
    distance, nearest = ndimage.distance_transform_edt(
        ~to_goal, sampling=(field.dy, field.dx), return_indices=True
    )
    distance = np.where(from_start, distance, np.inf)
    j, i = np.unravel_index(int(np.argmin(distance)), distance.shape)
    j2, i2 = nearest[0][j, i], nearest[1][j, i]
    count = 2 * int(max(abs(j2 - j), abs(i2 - i))) + 1
    if count > 1:
        straight = math.atan2(field.dy * (j2 - j), field.dx * (i2 - i))
    line = [
        (field.x0 + field.dx * (i + (i2 - i) * w), field.y0 + field.dy * (j + (j2 - j) * w))
        for w in np.linspace(0.0, 1.0, count)
    ]
    what, bx, by = _blocking(ground, field, line, straight, request)
    return Infeasible(
        float(bx),
        float(by),
        f"no way from start to goal: between x {line[0][0]:.2f}, y {line[0][1]:.2f} and "
        f"x {line[-1][0]:.2f}, y {line[-1][1]:.2f} there is {what} at x {bx:.2f}, y {by:.2f}",
    )


def _blocking(
    ground: DrivingGround,
    field: CostField,
    points: list[tuple[float, float]],
    direction: float,
    request: SituationRequest,
) -> tuple[str, float, float]:
    """The worst thing along points driven in a direction: something solid, a slope, no room."""
    steep, narrow = (-math.inf, "a slope", *points[0]), None
    for x, y in points:
        j, i = field.nodes_at((x, y))
        if ground.blocked[j, i]:
            if area := _area_at(request, ground.terrain, x, y):
                return area, x, y
            what = _what_blocks(ground, x, y)
            return f"an {what}" if what[0] in "aeiou" else f"a {what}", x, y
        if ground.mask[j, i] != ALL_YAWS and narrow is None:
            needed = 2.0 * ground.half_width
            narrow = (f"a passage too narrow for the body ({needed:.2f} m with clearance)", x, y)
        _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
        steepness = math.hypot(px, py)
        uphill = math.atan2(py, px) - direction
        direction_bin = round(uphill / (2.0 * math.pi) * DIRECTIONS) % DIRECTIONS
        limit = float(field.limit[field.ground[j, i], direction_bin])
        excess = steepness / max(limit * field.margin, 1e-6)
        if excess > steep[0]:
            slope = math.degrees(math.atan(steepness))
            allowed = math.degrees(math.atan(limit * field.margin))
            text = f"a slope of {slope:.1f}° > {allowed:.1f}° limit in this direction"
            if excess <= 1.0:
                # The limit is broken beside the straight line that is looked at here.
                text = f"ground too steep to cross (a slope of {slope:.1f}° and more)"
            steep = (excess, text, x, y)
    if steep[0] <= 1.0 and narrow is not None:
        return narrow
    return steep[1], steep[2], steep[3]


def _area_at(request: SituationRequest, terrain: Terrain, x: float, y: float) -> str:
    """The area of the request that blocks a cell round a point, in words; empty if none does."""
    j, i = terrain.cell_index(x, y)
    for number, area in enumerate(request.avoid):
        covered = terrain.cells_in([area.ring()], touched=True)
        if covered[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2].any():
            return f"the area avoid[{number}] of the request"
    return ""


def _touched(request: SituationRequest, ground: DrivingGround, x: float, y: float) -> str:
    """What a body at a place is nearest to, in words."""
    west, south, east, north = ground.terrain.extent
    px, py = _nearest_blocked(ground, x, y)
    if not ground.blocked.any() or math.dist((x, y), (px, py)) > min(
        x - west, east - x, y - south, north - y
    ):
        return "the edge of the map"
    if area := _area_at(request, ground.terrain, px, py):
        return area
    what = _what_blocks(ground, px, py)
    return f"{'an' if what[0] in 'aeiou' else 'a'} {what} at x {px:.2f}, y {py:.2f}"


def _nearest_blocked(ground: DrivingGround, x: float, y: float) -> Place:
    """The middle of the blocked cell nearest to a point; the point itself without any."""
    j, i = np.nonzero(ground.blocked)
    if not len(i):
        return x, y
    px, py = ground.origin[0] + ground.cell[0] * i, ground.origin[1] + ground.cell[1] * j
    k = int(np.argmin((px - x) ** 2 + (py - y) ** 2))
    return float(px[k]), float(py[k])


def _what_blocks(ground: DrivingGround, x: float, y: float) -> str:
    j, i = ground.terrain.cell_index(x, y)
    return ground.terrain.why_blocked(ground.step_height, j, i) or "ledge"


def _tried(yaw: float | None) -> list[float]:
    if yaw is not None:
        return [yaw]
    return [2.0 * math.pi * k / YAW_TRIES for k in range(YAW_TRIES)]


def _nearest_free(
    ground: DrivingGround, field: CostField, x: float, y: float, yaw: float | None = None
) -> str:
    """The nearest place with room for the body, with a yaw if that is anywhere, in words."""
    free: NDArray[np.bool_] = ground.mask != 0
    if not free.any():
        return "a map with room for the robot somewhere; `joulepath maps check` shows it"
    what = "free ground"
    if yaw is not None:
        below = math.floor(yaw / math.pi * YAW_BINS)
        fits = free.copy()
        for k in (below, below + 1):
            fits &= (ground.mask >> np.uint32(k % YAW_BINS)) & np.uint32(1) != 0
        if fits.any():
            free, what = fits, "free ground for this yaw"
    j, i = np.nonzero(free)
    px, py = field.x0 + field.dx * i, field.y0 + field.dy * j
    k = int(np.argmin((px - x) ** 2 + (py - y) ** 2))
    return f"{what}, the nearest at x {px[k]:.2f}, y {py[k]:.2f}"
