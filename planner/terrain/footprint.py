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
from planner.terrain.obstacles import rectangle_free

SAMPLE_CELLS, SAMPLE_TURN = 0.1, math.radians(2.0)
"""Cells and rad between two poses at which a motion is tested for contact."""


@njit(cache=True, error_model="numpy")
def body_fits(field: Any, x: float, y: float, yaw: float) -> bool:
    """Whether the body with its clearance is free of what is solid."""
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    sides = field.half_length, field.half_width
    return bool(rectangle_free(field.blocked, x0, y0, dx, dy, x, y, yaw, sides[0], sides[1]))


@njit(cache=True, error_model="numpy", nogil=True)
def touches(
    blocked: Any, frame: Any, xa: float, ya: float, xb: float, yb: float, yaw: float, turn: float
) -> bool:
    """Whether the body touches something on a straight path while it turns evenly by ``turn``."""
    x0, y0, dx, dy = frame[0], frame[1], frame[2], frame[3]
    half_length, half_width = frame[4], frame[5]
    ex, ey = xb - xa, yb - ya
    cells = math.sqrt(ex * ex + ey * ey) / min(dx, dy)
    count = max(1, int(math.ceil(max(cells / SAMPLE_CELLS, abs(turn) / SAMPLE_TURN))))
    for n in range(count + 1):
        w = n / count
        x, y, angle = xa + w * ex, ya + w * ey, yaw + w * turn
        if not rectangle_free(blocked, x0, y0, dx, dy, x, y, angle, half_length, half_width):
            return True
    return False
