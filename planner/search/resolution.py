"""How finely searches look at yaw, direction, slope and speed, and the reserve that they keep.

    from planner.search.resolution import DIRECTIONS, YAWS

Compiled code reads these numbers as constants. They stand here because several rooms share them; a
number that one room alone uses stands there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

OBJECTIVES = {"energy": 0, "time": 1, "length": 2}
MOST_WEIGHT = 1e2
"""Time weight, as a multiple of the mean power, above which only time counts."""
LEAST_COST = 1e-3
"""J, s or m that a metre costs at least in a search: wind may push for nothing."""

YAWS, DIRECTIONS, STEEPNESSES = 64, 72, 17
"""Entries of the tables of steady costs: yaw to the travel, direction, share of the slope limit."""
GENTLE = 161
"""Slopes along each axis of the table ``gentle``."""
MARGIN = 0.985
"""Share of the true slope limit that search may use, so that what it finds stays drivable."""

YAW_BINS = 32
"""Bins of the body's yaw in the mask; its rectangle looks the same after half a turn."""
ALL_YAWS = np.uint64((1 << YAW_BINS) - 1)
"""The mask of a node at which every yaw is free."""

STATES = 64
"""Angles to the travel at which the body may stand."""
WIDTH = 2.0 * math.pi / STATES
"""rad from one to the next."""
TURNS = 24
"""Bends of the table of what turning on the move adds."""
OFF_MIDDLE = 0.5
"""Share of a step, and of its turn, between its middle and where it is looked at early and late: at
its ends, where a body that turns stands most askew to the travel."""
STILL = 1e-9
"""rad: what turns less does not turn."""

SPIN_UP = 2.0
"""1/s: a turn on the spot gets to its full yaw rate within half a second."""
SLOPE_SPEED = 0.125
"""Share of full speed at which a slope is tried: the slowest in the tables of steady driving."""
SLOWEST = 0.05
"""Share of full speed below which the robot stops rather than creeps."""
CREEP = (0.0, SLOWEST, 0.1, 0.15)
"""Standstill and three speeds to creep round corners, as shares of full speed."""
LEVELS, MORE_LEVELS = len(CREEP) + 20, len(CREEP) + 40
"""Levels of speed: those of ``CREEP``, and an even grid of the squared speed. There are more where
steps are short beside the way to full speed, and a motion is worked out closely."""
EVENLY = (LEVELS - len(CREEP)) ** -0.5
"""Share of the largest speed from which the grid of the squared speed is even."""


def grid_moves() -> NDArray[np.int64]:
    """Offsets (16, 2) in columns and rows, by angle."""
    moves = {
        (sx * x, sy * y)
        for a, b in ((1, 0), (1, 1), (2, 1))
        for x, y in ((a, b), (b, a))
        for sx in (1, -1)
        for sy in (1, -1)
    }
    return np.array(sorted(moves, key=lambda m: math.atan2(m[1], m[0])), np.int64)


MOVES = grid_moves()
"""Moves of a robot at a node of the grid: coprime offsets of up to two cells."""
COUNT = len(MOVES)
