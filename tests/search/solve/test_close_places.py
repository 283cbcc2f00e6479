"""Places that coincide, or lie so close that a robot hardly moves between them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from planner import plan_route
from planner.power.vehicles import load_vehicle
from tests.search.maps import hills, terrain

START, GOAL, VIA = {"x": 4.0, "y": 4.0}, {"x": 18.0, "y": 16.0}, {"x": 12.0, "y": 6.0}


@pytest.fixture(scope="module")
def relief():
    """Hills of 24 m."""
    return terrain(hills(96, rms_degrees=5.0))


def route_of(relief, **fields):
    answer = plan_route(terrain=relief, **fields)
    assert answer.status == "ok", answer.reason
    document = answer.to_json()
    json.dumps(document["routes"], allow_nan=False)
    return answer.routes[0]


@pytest.mark.parametrize(
    ("via", "plain"),
    [
        ([START], []),
        ([GOAL], []),
        ([START, START, GOAL], []),
        ([VIA, VIA], [VIA]),
        ([START, VIA, VIA, VIA, GOAL], [VIA]),
    ],
)
def test_a_place_named_twice_costs_nothing(relief, via, plain):
    twice = route_of(relief, start=START, via=via, goal=GOAL)
    once = route_of(relief, start=START, via=plain, goal=GOAL)
    assert twice.energy_j == pytest.approx(once.energy_j, rel=1e-9)
    assert twice.length_m == pytest.approx(once.length_m, rel=1e-9)


def standing_yaws(route, place):
    """Yaw at the poses at a place at which the robot stands."""
    a = route.arrays
    at = np.hypot(a["x"] - place["x"], a["y"] - place["y"]) < 1e-6
    return a["yaw"][at & (a["speed"] < 1e-9)]


@pytest.mark.parametrize("where", ["start", "via", "goal"])
def test_other_yaws_at_the_same_place_are_turned_through_on_the_spot(relief, where):
    place = {"start": START, "via": VIA, "goal": GOAL}[where]
    turns = [{**place, "yaw": yaw} for yaw in (0.0, 1.5, 0.5)]
    asked = {
        "start": {"start": turns[0], "via": turns[1:], "goal": GOAL},
        "via": {"start": START, "via": turns, "goal": GOAL},
        "goal": {"start": START, "via": turns[:2], "goal": turns[2]},
    }[where]
    route = route_of(relief, **asked)
    stood = standing_yaws(route, place)
    seen = [
        int(np.abs(np.remainder(stood - y + np.pi, 2 * np.pi) - np.pi).argmin()) for y in (0.0, 1.5)
    ]
    for yaw, k in zip((0.0, 1.5), seen, strict=True):
        assert math.remainder(stood[k] - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert seen[0] < seen[1]
    assert math.remainder(stood[-1] - 0.5, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    a = route.arrays
    assert np.all(np.diff(a["t"]) >= 0.0)
    assert np.abs(np.diff(a["yaw"])).max() < 1.0  # no jump
    assert a["energy_j"][-1] == pytest.approx(sum(route.breakdown_j.values()))


def test_all_places_one(relief):
    nothing = route_of(relief, start=START, via=[START], goal=START)
    assert nothing.energy_j == 0.0
    there_and_back = route_of(
        relief,
        start={**START, "yaw": 0.0},
        via=[{**START, "yaw": 1.0}],
        goal={**START, "yaw": 0.0},
    )
    one_turn = route_of(relief, start={**START, "yaw": 0.0}, goal={**START, "yaw": 1.0})
    assert there_and_back.length_m == 0.0
    assert there_and_back.duration_s == pytest.approx(2.0 * one_turn.duration_s)


@pytest.mark.parametrize("yaws", [(None, None), (0.0, 0.53)])
def test_goals_fractions_of_a_millimetre_to_a_decimetre_away(relief, yaws):
    """No more acceleration than the limit, no energy from nothing, and more of it further away."""
    most = load_vehicle("minibalance").limits.acceleration
    before = 0.0
    for away in (1e-9, 1e-5, 1e-4, 1e-3, 3e-3, 5e-3, 2e-2, 0.1):
        ends = [dict(START), {"x": START["x"] + 0.6 * away, "y": START["y"] + 0.8 * away}]
        for end, yaw in zip(ends, yaws, strict=True):
            end["yaw"] = yaw
        route = route_of(relief, start=ends[0], goal=ends[1])
        if away > 1e-6:
            assert route.length_m == pytest.approx(away, rel=0.05)
            # Half of the way to speed up and half to slow down again.
            assert route.duration_s >= 2.0 * math.sqrt(route.length_m / most) * (1.0 - 1e-3)
        assert math.hypot(route.arrays["x"][-1] - ends[1]["x"], 0.0) < 1e-6
        assert route.lower_bound_j <= route.energy_j
        assert 0.0 <= route.gap <= 1.0 + 1e-9
        # Yaw and speeds are found one after the other, which leaves a tenth of a per cent.
        assert 0.998 * before <= route.energy_j < 60.0
        before = route.energy_j
        low, high = route.energy_interval_j
        assert low <= route.energy_j <= high


@pytest.mark.parametrize("vehicle", ["minibalance", "robotino"])
def test_a_via_a_millimetre_beside_the_path(relief, vehicle):
    """To the side, so that the robot stops there and turns: the whole way costs little more."""
    beside = {"x": START["x"] - 6e-4, "y": START["y"] + 8e-4, "yaw": 1.0}
    route = route_of(relief, vehicle=vehicle, start=START, via=[beside], goal=GOAL)
    plain = route_of(relief, vehicle=vehicle, start={**START, "yaw": 1.0}, goal=GOAL)
    assert plain.lower_bound_j <= route.energy_j < 1.1 * plain.energy_j + 20.0
