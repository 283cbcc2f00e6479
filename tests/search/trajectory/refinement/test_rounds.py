"""Rounds of refinement go on while they save much, and end where they do not."""

from __future__ import annotations

import numpy as np

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
    motion = move(field, conditions, [path], (None, None), care=care)
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


def test_two_rounds_are_all_where_the_second_saves_little(monkeypatch) -> None:
    """On open hills, where no yaw rate comes near its limit."""
    asked = []
    refined_yaw = rounds.refined_yaw

    def counted(*given, evenly):
        asked.append(evenly)
        return refined_yaw(*given, evenly=evenly)

    monkeypatch.setattr(rounds, "refined_yaw", counted)
    path = np.array([[3.0, 4.0], [12.0, 9.0], [20.0, 18.0]])
    field, conditions = _circumstances(terrain(hills(96, rms_degrees=5.0)), path)
    motion = _moved(field, conditions, path)
    rate = np.abs(np.diff(motion.yaw) / np.diff(motion.time))
    assert rate.max() < 0.8 * conditions.model.vehicle.limits.yaw_rate
    assert asked == [False, True]
