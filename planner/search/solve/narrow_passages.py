"""Routes through passages that nodes and yaw bins miss: straight in each, and planned between.

    attempt = through_passages(run, field, "energy")        # or None

Where the grid finds no path, or none on which the body can turn in time, the narrowest place of the
widest path is passed on the middle line of the widest empty strip, with the yaw along it. Start,
entrance, exit and goal are then joined by searches of their own, which may meet further passages.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.requests import PoseRequest
from planner.search.resolution import YAW_BINS
from planner.search.results import Route
from planner.search.run import Run
from planner.search.solve.pipeline import Attempt, drive_legs
from planner.search.solve.sketch import with_costs
from planner.search.wanted_yaw import arriving, leaving

MOST_PASSAGES = 8
"""Narrow passages between two places that are given, at most."""

Search = Callable[[Run], Attempt]
Piece = tuple[Array, PoseRequest]
"""A polyline (k, 2), and the pose at its end."""


def through_passages(run: Run, field: CostField, objective: str, search: Search) -> Attempt | None:
    """The route through narrow passages; None if there is none.

    Args:
        run, field, objective: the request, map and costs, "energy", "time" or "length".
        search: what the grid comes to for a part of the request.
    """
    if all(run.situation.narrow_passage(a, b) is None for a, b in itertools.pairwise(run.places)):
        return None
    legs: list[Array] = []
    pieces: list[Piece] = []
    passages: list[Array] = []
    yaws = run.yaws
    for k, (a, b) in enumerate(itertools.pairwise(run.places)):
        start = PoseRequest(x=a[0], y=a[1], yaw=leaving(yaws[k]))
        goal = PoseRequest(x=b[0], y=b[1], yaw=arriving(yaws[k + 1]))
        leg = _pieces(run, start, goal, search, passages)
        if leg is None:
            return None
        pieces += leg
        legs.append(np.vstack([leg[0][0], *(path[1:] for path, _ in leg[1:])]))
    if not passages:
        return None
    field = _opened(field, passages)
    asked = run.request.model_copy(update={"via": tuple(pose for _, pose in pieces[:-1])})
    driven = drive_legs(
        replace(run, request=asked),
        field,
        with_costs(field, [path for path, _ in pieces]),
        objective,
    )
    if not isinstance(driven, Route):
        return None
    return Attempt(field, None, with_costs(field, legs), driven)


def _pieces(
    run: Run,
    start: PoseRequest,
    goal: PoseRequest,
    search: Search,
    passages: list[Array],
) -> list[Piece] | None:
    """Polylines from start to goal, each with the pose at its end; new passages are added.

    Those are (2, 2) m, entrance and exit.
    """
    asked = run.request.model_copy(update={"start": start, "goal": goal, "via": ()})
    attempt = search(replace(run, request=asked))
    if attempt.route is not None and attempt.legs is not None:
        return [(attempt.legs[0][0], goal)]
    if len(passages) == MOST_PASSAGES:
        return None
    passage = run.situation.narrow_passage((start.x, start.y), (goal.x, goal.y))
    if passage is None:
        return None
    line = np.array([passage.entrance, passage.exit])
    passages.append(line)
    # The body passes forwards or backwards, whichever turns it less.
    known = start.yaw if start.yaw is not None else goal.yaw
    backwards = known is not None and math.cos(known - passage.direction) < 0.0
    yaw = passage.direction + (math.pi if backwards else 0.0)
    ends = [PoseRequest(x=x, y=y, yaw=yaw) for x, y in (passage.entrance, passage.exit)]
    before = _pieces(run, start, ends[0], search, passages)
    after = None if before is None else _pieces(run, ends[1], goal, search, passages)
    if before is None or after is None:
        return None
    return [*before, (line, ends[1]), *after]


def _opened(field: CostField, passages: list[Array]) -> CostField:
    """The field with the yaw along each passage (2, 2), in m, allowed at the nodes along it.

    The mask speaks for nodes, which lie off the line; prices on the line test the body exactly.
    """
    mask: NDArray[np.uint32] = field.mask.copy()
    for entrance, leaving_at in passages:
        line = leaving_at - entrance
        count = 2 * math.ceil(math.hypot(*line) / min(field.dx, field.dy)) + 1
        at = field.nodes_at(entrance + np.linspace(0.0, 1.0, count)[:, None] * line)
        nearest = round(math.atan2(line[1], line[0]) / math.pi * YAW_BINS)
        for b in (nearest - 1, nearest, nearest + 1):
            mask[at] |= np.uint32(1 << b % YAW_BINS)
    return field._replace(mask=mask)
