"""Attempts to break the certified bound: routes, grids, and limits where it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.certificate.certified_bound import certify, tables_of
from planner.search.certificate.quick_bound import lower_bound
from planner.search.field import sample_surface
from tests.search.certificate.robots import STEEPEST, around_of, field_of, model_of
from tests.search.maps import hills, terrain
from tests.search.random_motions import energies


def test_one_load_is_looked_at_only_where_more_never_takes_less() -> None:
    """Near rest friction may hold the robot: there the heavier load can be the cheaper one."""
    tables = tables_of(around_of(model_of("minibalance")), STEEPEST, False)
    assert tables is not None
    assert (tables.slower[..., 1] < tables.slower[..., 0]).any()
    assert not tables.full.heavier


def test_level_ground_is_bounded_by_the_cost_of_steady_driving() -> None:
    """On a plane the best motion is known: straight, at full speed, with both ramps."""
    model = model_of("minibalance")
    ground = terrain(np.zeros((40, 80)), cell=0.5)
    field, conditions = field_of(ground, model)
    steady = float(field.best.min(axis=(0, 1))[0])
    found = certify(field, conditions, (4.0, 10.0), (36.0, 10.0), seconds=600.0)
    assert found.how == "potential"
    assert 0.95 * 32.0 * steady < found.bound_j < 32.0 * steady + 1.0


@pytest.mark.parametrize("seconds", [2.0, 12.0])
@pytest.mark.parametrize("kind", ["hills", "rough", "tiny"])
def test_no_motion_at_random_undercuts_the_bound(kind: str, seconds: float) -> None:
    """Hundreds of motions at random speeds, yaw and accelerations, on the best routes and off."""
    heights = {
        "hills": hills(56, rms_degrees=5.0),
        "rough": hills(40, rms_degrees=7.0, seed=5),
        "tiny": hills(20, rms_degrees=4.0, seed=9),
    }[kind]
    ground = terrain(heights)
    model = model_of("minibalance")
    field, conditions = field_of(ground, model)
    far = 0.25 * len(heights) - 1.2
    start, goal = (1.2, 1.4), (far, far - 0.3)
    found = certify(field, conditions, start, goal, seconds=seconds)
    answer = plan_route(
        terrain=ground,
        model=model,
        start={"x": start[0], "y": start[1]},
        goal={"x": goal[0], "y": goal[1]},
    )
    assert answer.status == "ok", answer.reason
    routes = [answer.routes[0], *(b.route for b in answer.baselines.values())]
    paths = [np.column_stack([r.arrays["x"], r.arrays["y"]]) for r in routes]
    paths.append(np.array([start, goal]))
    least = min(r.energy_j for r in routes)
    assert found.bound_j < least
    assert found.bound_j < energies(field, conditions, paths, 60, seed=3).min()
    z, _ = sample_surface(field, np.array([start, goal]))
    quick = lower_bound(conditions, math.dist(start, goal), z[1] - z[0], float(field.limit.max()))
    assert found.bound_j >= quick


def test_a_coarse_grid_bounds_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several cells in one triangle: a lower bound again, and no better than the fine one."""
    field, conditions = field_of(terrain(hills(56, rms_degrees=4.0)), model_of("minibalance"))
    start, goal = (1.2, 1.4), (12.5, 12.0)
    fine = certify(field, conditions, start, goal, seconds=4.9)
    few = {True: 500, False: 500}
    monkeypatch.setattr("planner.search.certificate.certified_bound.MOST_NODES", few)
    coarse = certify(field, conditions, start, goal, seconds=4.9)
    path = np.array([start, goal])
    assert coarse.bound_j < energies(field, conditions, [path], 40, seed=2).min()
    assert coarse.bound_j < 1.05 * fine.bound_j


def test_what_the_bound_cannot_follow_gets_the_floor() -> None:
    """Wind, printed models and effects with unknown formulas fall back to the quick bound."""
    vehicle = load_vehicle("minibalance")
    ground = terrain(np.zeros((24, 24)))
    worn = PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, "wheel_preload"])
    for place, (effect, *_) in enumerate(worn.slots):
        if effect.slug == "wheel_preload":
            worn = worn.with_parameter(place, 2.0)
            break
    models = [PowerModel.from_vehicle(vehicle, kind="printed/B"), worn]
    for model in models:
        field, conditions = field_of(ground, model)
        found = certify(field, conditions, (1.5, 1.5), (4.0, 4.0), seconds=2.0)
        assert found.how == "floor"
        quick = lower_bound(conditions, math.hypot(2.5, 2.5), 0.0, float(field.limit.max()))
        assert found.bound_j == pytest.approx(quick)


def test_cancelling_stops_it() -> None:
    field, conditions = field_of(terrain(np.zeros((24, 24))), model_of("minibalance"))
    with pytest.raises(Cancelled):
        certify(field, conditions, (1.5, 1.5), (4.0, 4.0), token=CancellationToken(lambda: True))
