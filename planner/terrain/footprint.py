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
from planner.terrain.obstacles import rectangle_free, sweep_free

UNDECIDED = 2e-5
"""m of body's motion by turning below which a piece of a motion is judged by its middle pose."""


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

    What turns is halved until the body, grown by what turning moves its corners, sweeps nothing, or
    its middle pose touches something. So no contact between samples is missed, up to UNDECIDED.
    """
    x0, y0, dx, dy = frame[0], frame[1], frame[2], frame[3]
    grid = x0, y0, dx, dy
    half_length, half_width = frame[4], frame[5]
    # From its middle yaw, a corner moves no further than along an arc of this length.
    arc = 0.5 * abs(turn) * math.sqrt(half_length * half_length + half_width * half_width)
    ex, ey = xb - xa, yb - ya
    pieces, number = 1, 0
    while number < pieces:
        first, last = number / pieces, (number + 1) / pieces
        angle = yaw + 0.5 * (first + last) * turn
        grown = arc / pieces
        x, y = (xa + first * ex, xa + last * ex), (ya + first * ey, ya + last * ey)
        if grown <= UNDECIDED:
            if not sweep_free(blocked, grid, x, y, angle, (half_length, half_width)):
                return True
        elif not sweep_free(blocked, grid, x, y, angle, (half_length + grown, half_width + grown)):
            middle = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
            if not rectangle_free(blocked, x0, y0, dx, dy, *middle, angle, half_length, half_width):
                return True
            pieces, number = 2 * pieces, 2 * number
            continue
        number += 1
        # On to the largest piece that begins here.
        while number % 2 == 0 and pieces > 1:
            pieces, number = pieces // 2, number // 2
    return False
