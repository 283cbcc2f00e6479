"""On ground as steep as a robot can drive, an answer keeps to all limits between its poses too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.search.trajectory import Motion, motion_rows, move
from planner.search.trajectory.limit_checks import broken_limits as broken_along
from planner.search.trajectory.limit_checks import coarse_pieces, fine_pieces
from tests.benchmarks.peers.case import case_of
from tests.benchmarks.peers.limits import broken_limits
from tests.search.maps import hills, terrain

ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 19.0}}


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_an_answer_on_steep_relief_keeps_to_all_limits(seed: int) -> None:
    """Looked at from its poses, ten times a cell, with rates by differences."""
    case = case_of("test", ASKED, terrain(hills(rms_degrees=11.0, seed=seed)))
    answer = plan_route(terrain=case.situation.ground.terrain, **ASKED)
    assert answer.status == "ok"
    assert broken_limits(case, answer.routes[0]) == {}


@pytest.mark.parametrize("seed", range(4))
def test_a_close_look_where_a_limit_is_near_finds_all_that_one_everywhere_does(seed: int) -> None:
    """Limits are set between what coarse and what fine samples reach: only a close look tells."""
    relief = terrain(hills(rms_degrees=(3.0, 7.0)[seed % 2], seed=seed))
    situation = case_of("test", ASKED, relief).situation
    field, conditions = situation.field("energy"), situation.conditions
    path = np.array([[3.0, 4.0], [11.0 + seed, 12.0 - seed], [20.0, 19.0]])
    motion = move(field, conditions, [path], [None, None], objective=0, checked=False)
    assert isinstance(motion, Motion)

    def reached(pieces):
        rows, _, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
        moving = np.hypot(np.diff(motion.x), np.diff(motion.y))[owner] > 1e-9
        return conditions.model.power_and_limits(rows)[moving], owner[moving]

    coarse, _ = reached(coarse_pieces(field, motion))
    fine, owner = reached(fine_pieces(field, motion))
    for column, number in (("current", 1), ("voltage", 2), ("torque", 3)):
        column_of_results = {"current": 2, "voltage": 3, "torque": 4}[column]
        most, seen = fine[:, column_of_results].max(), coarse[:, column_of_results].max()
        assert most > seen
        limits = np.full(len(conditions.limits), 1e6)
        limits[[0, 4]] = conditions.limits[[0, 4]]
        limits[number] = 0.5 * (most + seen)
        stricter = replace(conditions, limits=limits)
        assert not broken_along(field, stricter, motion)
        found = broken_along(field, stricter, motion, finely=True)
        beyond = owner[fine[:, column_of_results] > limits[number]]
        assert {*found.steps.tolist()} == {*beyond.tolist()} != set()
