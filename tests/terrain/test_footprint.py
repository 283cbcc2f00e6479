"""Contact on the way, against poses close together."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.terrain.footprint import touches
from planner.terrain.obstacles import rectangle_free

TOLERANCE = 4e-5
"""m: what may be decided either way, and the sagitta between two poses of the check."""


def touched(blocked, frame, ends, yaw, turn, shrink) -> bool:
    """The same by 1000 poses, with a body smaller by ``shrink``."""
    xa, ya, xb, yb = ends
    for w in np.linspace(0.0, 1.0, 1001):
        pose = xa + w * (xb - xa), ya + w * (yb - ya), yaw + w * turn
        sides = frame[4] - shrink, frame[5] - shrink
        if not rectangle_free(blocked, *frame[:4], *pose, *sides):
            return True
    return False


@pytest.mark.parametrize("cell", [0.02, 0.1])
@pytest.mark.parametrize("turning", [0.0, 0.3, 2.0])
def test_contact_between_two_poses_is_that_of_poses_close_together(cell, turning):
    rng = np.random.default_rng(1)
    wide = 60 * cell
    frame = np.array([0.0, 0.0, cell, cell, 0.12 * wide, 0.06 * wide])
    found = 0
    for _ in range(40):
        blocked = rng.random((60, 60)) < 0.004
        start = rng.uniform(0.25 * wide, 0.75 * wide, 2)
        ends = (*start, *(start + rng.normal(0.0, 0.05 * wide, 2)))
        yaw, turn = rng.uniform(-3.0, 3.0), rng.normal(0.0, turning)
        answer = touches(blocked, frame, *ends, yaw, turn)
        found += answer
        if answer:
            assert touched(blocked, frame, ends, yaw, turn, -TOLERANCE)
        else:
            assert not touched(blocked, frame, ends, yaw, turn, TOLERANCE)
    assert 5 < found < 35


def test_a_way_along_a_wall_and_past_a_corner_between_two_poses():
    """Contact is free; a post that no pose of a tenth of a cell covers is met all the same."""
    blocked = np.zeros((40, 40), bool)
    blocked[20:] = True
    frame = np.array([0.0, 0.0, 1.0, 1.0, 3.0, 1.0])
    assert not touches(blocked, frame, 5.0, 18.5, 30.0, 18.5, 0.0, 0.0)
    assert touches(blocked, frame, 5.0, 18.5, 30.0, 18.5001, 0.0, 0.0)
    blocked[:] = False
    blocked[10, 20] = True
    # The cell's corner lies 0.1 mm inside the diagonal on which the body's corner travels.
    corner = 19.5 + 1e-4, 9.5 + 1e-4
    way = np.array([1.0, -1.0]) * 5.0
    middle = np.array(corner) - (3.0, 1.0)
    ends = (*(middle - way), *(middle + way))
    assert touches(blocked, frame, *ends, 0.0, 0.0)
    assert not touches(blocked, frame, *(np.array(ends) - 3e-4), 0.0, 0.0)


def test_no_number_is_contact():
    blocked = np.zeros((40, 40), bool)
    frame = np.array([0.0, 0.0, 1.0, 1.0, 3.0, 1.0])
    assert touches(blocked, frame, 20.0, 20.0, 21.0, 20.0, 0.0, math.nan)
