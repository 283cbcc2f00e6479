"""What poses cost: bends and straight lines that the limits let the body follow."""

from __future__ import annotations

import math

import numpy as np

from planner.search.requests import SituationRequest
from planner.search.resolution import YAW_BINS
from planner.search.se2 import ANGLE
from planner.search.se2.pose_costs import End, bends_of, from_travel, metre_cost, states_near
from planner.search.situation import situation_of
from tests.search.maps import terrain

CELL = 0.25


def slope_of(tangent: float):
    """Field of a slope that rises to the east."""
    ground = terrain(np.tile(tangent * CELL * np.arange(40), (40, 1)), cell=CELL)
    return situation_of(SituationRequest(map=ground.name), terrain=ground).field("energy")


def steepest(field) -> float:
    """Slope that is climbed straight on."""
    return float(field.yaw_limit[0, 0, 0])


def test_a_bend_ends_before_a_direction_that_does_not_hold():
    """Every direction on the bend holds, the next one does not; level ground allows a right angle.

    Straight up a slope near the limit, only a part of a turn holds with the body as it is.
    """
    field = slope_of(0.1)
    costs = field.by_yaw[0], field.yaw_limit[0], field.margin
    assert min(bends_of(*costs, 0.0, 0.0, 0, 0.0)) > 0.5 * math.pi - 1e-6
    steep = 0.95 * steepest(field)
    bends = bends_of(*costs, steep, 0.0, 0, 0.0)
    assert min(bends) < 0.5 * math.pi
    for side, bend in zip((1, -1), bends, strict=True):
        for turned in range(1, round(bend / ANGLE)):
            direction = side * turned * ANGLE
            held = metre_cost(*costs, steep, -direction, from_travel(0, direction))
            assert math.isfinite(held)


def test_a_straight_line_at_an_end_holds_all_along():
    """Straight up a slope near the limit, lines lead on to where something steeper begins."""
    gentle = 0.95 * steepest(slope_of(0.1))
    begun, edge = 14.4 * CELL, 16.5 * CELL
    for steeper, passes in ((gentle, True), (1.5, False)):
        along = CELL * np.arange(40.0)
        heights = gentle * along + (steeper - gentle) * np.clip(along - edge, 0.0, None)
        ground = terrain(np.tile(heights, (40, 1)), cell=CELL)
        field = situation_of(SituationRequest(map=ground.name), terrain=ground).field("energy")
        end = End(begun, 5.1, np.zeros(YAW_BINS))
        nodes = [node for node, _, _ in states_near(field, field.body_frame(), end, True)]
        columns = np.array(nodes) % field.heights.shape[1]
        assert (field.x0 + field.dx * columns.max() > edge) == passes
