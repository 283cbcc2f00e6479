"""Attempts to break the certified bound: routes, grids, and limits where it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.search.certificate import ALL, STEADY, certify, legs_bound
from tests.power.states import changed
from tests.search.certificate.robots import field_of, model_of
from tests.search.maps import hills, terrain
from tests.search.random_motions import energies


def test_level_ground_is_bounded_by_the_cost_of_steady_driving() -> None:
    """On a plane the best route is known: straight, at full speed, from rest to rest."""
    ground = terrain(np.zeros((40, 150)))
    field, conditions = field_of(ground, model_of("minibalance"))
    steady = 32.0 * float(field.best.min(axis=(0, 1))[0])
    found = certify(field, conditions, [(2.5, 5.0), (34.5, 5.0)], seconds=3.0)
    assert found.how == STEADY
    # What both ends add is a few joules.
    assert 0.97 * steady < found.bound_j < steady + 17.0


@pytest.mark.parametrize("seconds", [0.5, 2.0])
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
    found = certify(field, conditions, [start, goal], seconds=seconds)
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
    assert found.bound_j > legs_bound(field, conditions, [start, goal])


def test_a_coarse_grid_bounds_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several cells in one triangle: a lower bound again, and no better than the fine one."""
    field, conditions = field_of(terrain(hills(56, rms_degrees=4.0)), model_of("minibalance"))
    places = [(1.2, 1.4), (12.5, 12.0)]
    fine = certify(field, conditions, places, seconds=4.9)
    monkeypatch.setattr("planner.search.certificate.certified_bound.MOST_MESH_NODES", 500)
    coarse = certify(field, conditions, places, seconds=4.9)
    assert coarse.bound_j < energies(field, conditions, [np.array(places)], 40, seed=2).min()
    assert coarse.bound_j < 1.05 * fine.bound_j


def test_legs_add_up() -> None:
    """Through a place far off the way the bound counts the detour; on the way it stays below."""
    field, conditions = field_of(terrain(hills(56, rms_degrees=4.0)), model_of("minibalance"))
    start, aside, goal = (2.0, 2.0), (2.0, 11.0), (11.0, 2.0)
    direct = certify(field, conditions, [start, goal], seconds=2.0).bound_j
    round_it = certify(field, conditions, [start, aside, goal], seconds=2.0).bound_j
    quick = legs_bound(field, conditions, [start, aside, goal])
    assert quick > 1.5 * legs_bound(field, conditions, [start, goal])
    assert round_it > max(quick, 1.5 * direct)
    legs = [np.array(leg) for leg in ((start, aside), (aside, goal))]
    assert round_it < sum(energies(field, conditions, [leg], 15, seed=4).min() for leg in legs)


def test_what_the_bound_cannot_follow_gets_the_quick_one() -> None:
    """Models whose metres cost nothing have no potential; with wind none is worked out."""
    ground = terrain(np.zeros((24, 24)))
    free = model_of("minibalance")
    for slug, name in (("electronics", "power"), ("wheel_rolling", "rolling")):
        free = changed(free, **{f"{slug}__{name}": 0.0})
    field, conditions = field_of(ground, model_of("minibalance"))
    windy = replace(conditions, wind=np.array([2.0, 1.0]))
    for there in (field_of(ground, free), (field, windy)):
        places = [(1.5, 1.5), (4.0, 4.0)]
        found = certify(*there, places, seconds=2.0)
        if found.how == ALL:
            assert found.bound_j == legs_bound(*there, places)
    assert found.how == ALL


@pytest.mark.parametrize("share", ["motor_share", "source_share"])
def test_nothing_is_below_zero_where_nothing_is_given_back(share: str) -> None:
    """Down a long slope; with refusing motors the electronics are drawn as well."""
    heights = -0.12 * 0.25 * np.arange(60)[None, :] + np.zeros((40, 1))
    model = changed(model_of("minibalance"), **{f"regeneration_limit__{share}": 0.0})
    field, conditions = field_of(terrain(heights), model)
    bound = legs_bound(field, conditions, [(2.0, 5.0), (13.0, 5.0)])
    power = 7.0 if share == "motor_share" else 0.0
    assert bound >= power * 11.0 / 1.2 * 0.5


def test_cancelling_stops_it() -> None:
    field, conditions = field_of(terrain(np.zeros((24, 24))), model_of("minibalance"))
    token = CancellationToken(lambda: True)
    with pytest.raises(Cancelled):
        certify(field, conditions, [(1.5, 1.5), (4.0, 4.0)], token=token)
