"""The search in x, y and yaw: it goes where the body can turn, and says where it cannot."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.search.grid import cost_from, cost_to_go
from planner.search.requests import SituationRequest
from planner.search.resolution import ALL_YAWS
from planner.search.se2.hybrid_search import keeping_yaw, pose_path
from planner.search.situation import situation_of
from planner.terrain.obstacles import rectangle_free
from tests.search.maps import terrain

SOUTH, EAST = (2.0, 1.0), (10.0, 8.0)


def bent_corridor(chamber: float):
    """A corridor of 0.7 m that runs north and then east, with a square chamber at its corner."""
    obstacles = np.ones((120, 120), bool)
    obstacles[4:84, 17:24] = False
    obstacles[77:84, 17:116] = False
    half = round(5.0 * chamber)
    obstacles[80 - half : 80 + half + 1, 20 - half : 20 + half + 1] = False
    return terrain(np.zeros((120, 120)), cell=0.1, obstacles=obstacles)


def asked(ground):
    """Situation and field for a map."""
    situation = situation_of(SituationRequest(map=ground.name), terrain=ground)
    return situation, situation.field("energy")


def way_through(ground, yaws=(None, None), objective="energy", token=None):
    """The way with yaw from the south to the east."""
    situation, _ = asked(ground)
    return pose_path(
        situation,
        situation.field(objective),
        objective,
        (SOUTH, yaws[0]),
        (EAST, yaws[1]),
        token=token or CancellationToken(),
    )


@pytest.mark.parametrize("objective", ["energy", "time", "length"])
def test_the_body_is_free_all_along(objective):
    """Ten looks at every move: nothing is touched, and no yaw jumps."""
    ground = bent_corridor(1.6)
    way = way_through(ground, objective=objective)
    assert way is not None
    for k in range(len(way.points) - 1):
        turn = math.remainder(way.yaws[k + 1] - way.yaws[k], math.pi)
        spins = np.allclose(way.points[k], way.points[k + 1])
        assert spins or abs(turn) < math.radians(20.0)
        for w in np.linspace(0.0, 1.0, 10):
            x, y = way.points[k] + w * (way.points[k + 1] - way.points[k])
            yaw = way.yaws[k] + w * turn
            body = (0.43 + 0.05, 0.26 + 0.05)
            assert spins or rectangle_free(
                ground.obstacles, *ground.origin, *ground.cell, x, y, yaw, *body
            )


def test_where_the_body_cannot_turn_is_named():
    """In a corridor of 0.7 m nobody turns round: that is said of its end, not of its beginning."""
    obstacles = np.ones((60, 120), bool)
    obstacles[26:33, 2:118] = False
    answer = plan_route(
        terrain=terrain(np.zeros((60, 120)), cell=0.1, obstacles=obstacles),
        start={"x": 2.0, "y": 2.9, "yaw": 0.0},
        goal={"x": 9.0, "y": 2.9, "yaw": math.pi},
    )
    assert answer.status == "no_route"
    assert "cannot turn" in answer.reason
    x = float(re.search(r"at x (\d+\.\d+)", answer.reason).group(1))
    assert x > 8.5, answer.reason


def test_a_corner_without_room_is_no_path():
    """In a chamber of 0.9 m a body of 0.96 m does not turn from one corridor into the other."""
    assert way_through(bent_corridor(0.9)) is None


def test_with_room_at_the_corner_the_route_goes_through():
    """A chamber of 1.6 m at the corner is enough to turn in."""
    ground = bent_corridor(1.6)
    answer = plan_route(
        terrain=ground,
        start={"x": SOUTH[0], "y": SOUTH[1]},
        goal={"x": EAST[0], "y": EAST[1]},
    )
    assert answer.status == "ok", answer.reason


def test_no_cheaper_than_without_yaw():
    """What leaves turning out is a floor, and the difference is what a quarter turn can cost."""
    ground = bent_corridor(1.6)
    situation, field = asked(ground)
    to_go = cost_to_go(field, situation.lattice("energy", field), EAST)
    floor = cost_from(field, to_go, SOUTH)
    way = way_through(ground)
    assert floor * 0.99 < way.cost < floor + 80.0


def test_yaw_at_the_ends_is_kept_and_paid_for():
    """The yaw asked for is had, and the way costs more than the cheapest one."""
    free = way_through(bent_corridor(1.6))
    fixed = way_through(bent_corridor(1.6), (math.pi / 2.0, math.pi))
    assert math.remainder(fixed.yaws[0] - math.pi / 2.0, math.pi) == pytest.approx(0.0, abs=0.05)
    assert math.remainder(fixed.yaws[-1] - math.pi, math.pi) == pytest.approx(0.0, abs=0.05)
    assert fixed.cost >= free.cost - 1e-3


def test_refinement_keeps_to_the_yaw_of_the_path():
    """Near the way and near obstacles some angles are left, far from it none, in the open all."""
    ground = bent_corridor(3.0)
    _, field = asked(ground)
    way = way_through(ground)
    near = keeping_yaw(field, [way])
    crowded = field.mask != ALL_YAWS
    assert (near.mask[~crowded] == field.mask[~crowded]).all()
    assert ((near.mask & ~field.mask) == 0).all()
    j, i = (
        np.rint((way.points[:, 1] - field.y0) / field.dy).astype(int),
        np.rint((way.points[:, 0] - field.x0) / field.dx).astype(int),
    )
    assert (near.mask[j, i] != 0).all()
    assert np.bitwise_count(near.mask[crowded]).sum() < np.bitwise_count(field.mask[crowded]).sum()


def test_whoever_cancels_is_heard():
    """The flag that compiled searches look at ends this one as well."""
    token = CancellationToken(lambda: True)
    token.cancelled()
    with pytest.raises(Cancelled):
        way_through(bent_corridor(1.6), token=token)
