"""The energy of a route, held against an integrator that knows nothing of the planner."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.terrain.heightmap import Terrain
from tests.power.reference import Robot
from tests.search.integrator import energy
from tests.search.maps import drawn, hills, terrain

REQUESTS = [
    ("hills", {"x": 2.0, "y": 2.0}, {"x": 21.0, "y": 20.0}),
    ("hills", {"x": 21.0, "y": 3.0, "yaw": 1.0}, {"x": 3.0, "y": 18.0, "yaw": -2.0}),
    ("room", {"x": 1.5, "y": 1.5, "yaw": 1.6}, {"x": 8.5, "y": 4.5, "yaw": 0.0}),
    ("flat", {"x": 2.0, "y": 2.0, "yaw": 2.0}, {"x": 9.0, "y": 7.0, "yaw": -2.5}),
]


def make(name: str) -> Terrain:
    """The terrains of REQUESTS."""
    if name == "hills":
        return terrain(hills())
    if name == "flat":
        return terrain(np.zeros((40, 50)))
    return drawn(
        """
        ####################
        #..................#
        #..................#
        #.......#..........#
        #.......#..........#
        #.......#..........#
        #.......#..........#
        #.......#..........#
        #.......#..........#
        #..................#
        #..................#
        ####################
        """,
        cell=0.5,
    )


@pytest.mark.parametrize(("name", "start", "goal"), REQUESTS)
def test_energy_agrees_with_an_independent_integrator(name, start, goal):
    """Every route's energy within 0.5 % of one computed from its poses by the second model."""
    ground = make(name)
    answer = plan_route(terrain=ground, start=start, goal=goal, iterations=800)
    route = answer.to_json()["routes"][0]
    expected = energy(
        route["poses"],
        ground.riding_surface(0.5 * (0.214 + 0.247)),
        ground.origin,
        ground.cell,
        Robot(),
    )
    assert route["energy_j"] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(
    "via",
    [
        [{"x": 15.0, "y": 6.0}],
        [{"x": 15.0, "y": 6.0}, {"x": 6.0, "y": 15.0, "yaw": 0.7}],
        [{"x": 18.0, "y": 18.0}, {"x": 6.0, "y": 6.0}],
    ],
)
def test_energy_over_via_points(via):
    """Sharp turns at via points are driven as the poses say: the same 0.5 %."""
    ground = terrain(hills())
    answer = plan_route(terrain=ground, start={"x": 3, "y": 3}, goal={"x": 19, "y": 19}, via=via)
    route = answer.to_json()["routes"][0]
    surface = ground.riding_surface(0.5 * (0.214 + 0.247))
    expected = energy(route["poses"], surface, ground.origin, ground.cell, Robot())
    assert route["energy_j"] == pytest.approx(expected, rel=5e-3)


def test_account_closes_and_poses_are_close():
    """Effects add up to the energy, poses to the length; steps obey the contract's spacing."""
    answer = plan_route(
        terrain=terrain(hills()), start={"x": 2, "y": 2}, goal={"x": 20, "y": 18}, iterations=800
    )
    route = answer.to_json()["routes"][0]
    assert sum(route["breakdown_j"].values()) == pytest.approx(route["energy_j"], rel=1e-9)
    poses = route["poses"]
    steps = [
        math.dist((a["x"], a["y"], a["z"]), (b["x"], b["y"], b["z"]))
        for a, b in zip(poses[:-1], poses[1:], strict=True)
    ]
    assert sum(steps) == pytest.approx(route["length_m"], rel=1e-9)
    assert max(steps) <= 0.25 * 1.05
    assert all(a["t"] < b["t"] for a, b in zip(poses[:-1], poses[1:], strict=True))
    assert poses[0]["speed"] == poses[-1]["speed"] == 0.0
    # Gravity takes what climbing gives: exactly the weight times the height.
    climb = 12.0 * 9.80665 * (poses[-1]["z"] - poses[0]["z"])
    assert route["breakdown_j"]["gravity"] == pytest.approx(climb, abs=0.002 * route["energy_j"])
    # From rest to rest nothing is left in motion.
    assert abs(route["breakdown_j"]["inertia"]) <= 0.003 * route["energy_j"]


def test_speed_changes_and_turns_keep_to_the_limits():
    """Acceleration within 1 m/s² and yaw rate within 1 rad/s between all poses."""
    answer = plan_route(
        terrain=make("room"),
        start={"x": 1.5, "y": 1.5, "yaw": 1.6},
        goal={"x": 8.5, "y": 4.5, "yaw": -1.0},
        iterations=800,
    )
    a = answer.routes[0].arrays
    duration = np.diff(a["t"])
    assert np.abs(np.diff(a["speed"]) / duration).max() <= 1.0 + 1e-6
    assert np.abs(np.diff(a["yaw"]) / duration).max() <= 1.0 + 1e-6
    assert a["speed"].max() <= 1.2 + 1e-9
