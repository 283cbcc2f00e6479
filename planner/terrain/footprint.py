"""Whether a robot's body, a rectangle, is free of what is solid: at a place, and along a path.

    body_fits(field, x, y, yaw)                                   # at one pose
    touches(blocked, frame, xa, ya, xb, yb, yaw, turn)            # straight, turning evenly

``field`` is any tuple of arrays with blocked cells, their frame and half the body's sides, such as
the cost field of the search. Compiled searches call both.
"""

from __future__ import annotations

import math
from typing import Any

from planner.compiled_code import njit
from planner.terrain.obstacles import motion_free, rectangle_free

UNDECIDED = 2e-5
"""m by which turning moves the body's corners from the middle of a piece of its motion, from which
on the piece is not halved any more."""


@njit(cache=True, error_model="numpy")
def body_fits(field: Any, x: float, y: float, yaw: float) -> bool:
    """Whether the body with its clearance is free of what is solid."""
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    sides = field.half_length, field.half_width
    return bool(rectangle_free(field.blocked, x0, y0, dx, dy, x, y, yaw, sides[0], sides[1]))


@njit(cache=True, error_model="numpy")
def middle_fits(field: Any, x: float, y: float) -> bool:
    """Whether a square is free that the body covers with any yaw; without it, none fits."""
    return _square_free(field, x, y, math.sqrt(0.5) * min(field.half_length, field.half_width))


@njit(cache=True, error_model="numpy")
def any_yaw_fits(field: Any, x: float, y: float) -> bool:
    """Whether a square is free that holds the body with any yaw."""
    return _square_free(field, x, y, math.hypot(field.half_length, field.half_width))


@njit(cache=True, error_model="numpy")
def _square_free(field: Any, x: float, y: float, half: float) -> bool:
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    return bool(rectangle_free(field.blocked, x0, y0, dx, dy, x, y, 0.0, half, half))


@njit(cache=True, error_model="numpy", nogil=True)
def touches(
    blocked: Any, frame: Any, xa: float, ya: float, xb: float, yb: float, yaw: float, turn: float
) -> bool:
    """Whether the body touches something on a straight path while it turns evenly by ``turn``.

    The way is halved until nothing is met on any part of it, or a middle pose touches something.
    So no contact between samples is missed, up to UNDECIDED.
    """
    x0, y0, dx, dy = frame[0], frame[1], frame[2], frame[3]
    grid = x0, y0, dx, dy
    body = frame[4], frame[5]
    corner = math.sqrt(body[0] * body[0] + body[1] * body[1])
    ex, ey = xb - xa, yb - ya
    length, turned = math.sqrt(ex * ex + ey * ey), abs(turn)
    # m from the body's centre to the corners of cells that it may meet.
    reach = corner + math.sqrt(dx * dx + dy * dy) + length
    pieces, number = 1, 0
    while number < pieces:
        first, last = number / pieces, (number + 1) / pieces
        x, y = (xa + first * ex, xa + last * ex), (ya + first * ey, ya + last * ey)
        angles = yaw + first * turn, yaw + last * turn
        part = turned / pieces
        # A point at this distance leaves the line between its ends by the sagitta of its arc, and
        # seen from the body by what that turns while it moves.
        slack = 0.125 * corner * part * part, 0.125 * (reach * part + 2.0 * length / pieces) * part
        decided = max(0.5 * corner * part, slack[1]) <= UNDECIDED
        if decided:
            slack = 0.0, 0.0
        if not motion_free(blocked, grid, x, y, angles, body, slack):
            if decided:
                return True
            middle = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
            angle = 0.5 * (angles[0] + angles[1])
            if not rectangle_free(blocked, x0, y0, dx, dy, *middle, angle, *body):
                return True
            pieces, number = 2 * pieces, 2 * number
            continue
        number += 1
        # On to the largest piece that begins here.
        while number % 2 == 0 and pieces > 1:
            pieces, number = pieces // 2, number // 2
    return False
