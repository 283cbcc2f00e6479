"""Rounds of refinement go on where they save, and turn evenly only where the body turns fast."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.field import CostField
from planner.search.requests import PlanRequest
from planner.search.results import energy_of
from planner.search.situation import situation_of
from planner.search.trajectory.drive import CLOSELY, move
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.refinement import rounds
from tests.benchmarks.hard_maps import made
from tests.search.maps import hills, terrain

ROUND_SHELVES = np.array(
    [
        *((14.29, 18.50), (13.58, 18.54), (12.44, 18.44), (12.22, 18.13), (12.12, 16.97)),
        *((12.90, 14.82), (13.75, 14.04), (13.78, 13.29), (13.50, 12.75), (12.17, 12.54)),
        *((10.80, 12.41), (10.29, 11.97), (9.85, 10.96), (8.97, 9.80), (9.05, 9.06)),
        *((9.27, 8.77), (10.35, 8.35), (10.78, 7.72), (10.73, 6.96)),
    ]
)
"""m; aisles of shelves of seed 311, where the body turns at most corners."""


def _circumstances(relief, path):
    ends = {
        name: {"x": float(x), "y": float(y)}
        for name, (x, y) in zip(("start", "goal"), path[[0, -1]], strict=True)
    }
    situation = situation_of(
        PlanRequest.from_json({"map": "test", **ends}),
        terrain=relief,
        model=PowerModel.from_vehicle(load_vehicle("minibalance")),
    )
    return situation.field("energy"), situation.conditions


def _moved(field: CostField, conditions, path, care=CLOSELY) -> Motion:
    motion = move(field, conditions, [path], (None, None), objective=0, care=care)
    assert isinstance(motion, Motion)
    return motion


def test_rounds_go_on_where_the_last_one_saved_much() -> None:
    field, conditions = _circumstances(made("shelves", 311), ROUND_SHELVES)
    joules = []
    for most in (1, 2, CLOSELY.refined):
        motion = _moved(field, conditions, ROUND_SHELVES, CLOSELY._replace(refined=most))
        assert not broken_limits(field, conditions, motion, finely=True)
        joules.append(energy_of(field, conditions, motion))
    assert joules[1] < 0.995 * joules[0]
    assert joules[2] < 0.998 * joules[1]


@pytest.mark.parametrize("among_shelves", [False, True])
def test_a_body_turns_evenly_only_where_it_turns_fast(among_shelves, monkeypatch) -> None:
    """On open hills, one round is all; the yaw rate is far from its limit there."""
    asked: Counter[bool] = Counter()
    refined_yaw = rounds.refined_yaw

    def counted(*given, evenly):
        asked[evenly] += 1
        return refined_yaw(*given, evenly=evenly)

    monkeypatch.setattr(rounds, "refined_yaw", counted)
    path = ROUND_SHELVES if among_shelves else np.array([[3.0, 4.0], [12.0, 9.0], [20.0, 18.0]])
    relief = made("shelves", 311) if among_shelves else terrain(hills(96, rms_degrees=5.0))
    field, conditions = _circumstances(relief, path)
    motion = _moved(field, conditions, path)
    rate = np.abs(np.diff(motion.yaw) / np.diff(motion.time))
    fast = rate > 0.8 * conditions.model.vehicle.limits.yaw_rate
    assert fast.mean() > 0.1 if among_shelves else not fast.any()
    assert (asked[True] > 0) == among_shelves
