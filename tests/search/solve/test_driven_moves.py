"""Waypoints moved at random and driven: only ever cheaper, within all limits, and at fixed ends."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.requests import PlanRequest
from planner.search.results import Route
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve import driven_moves
from planner.search.solve.driven_moves import with_moves_driven
from planner.search.solve.pipeline import Candidate, drive_legs
from planner.search.solve.sketch import with_costs
from planner.search.trajectory.limit_checks import broken_limits
from tests.search.maps import terrain

ACROSS = {"start": {"x": 2.0, "y": 5.0}, "goal": {"x": 8.0, "y": 5.0}}
LIMITS_OFF = 1e-3
"""Share by which a limit may be exceeded between two samples."""


def searched(relief, path, pairs, **further):
    """A path's route, and the cheaper ones that so many pairs of moves come to."""
    request = PlanRequest.from_json({"map": "test", **ACROSS, **further})
    with CancellationToken() as token:
        run = Run(request, situation_of(request, terrain=relief), silent, token)
        field = run.field("energy")
        legs = with_costs(field, [path])
        route = drive_legs(run, field, legs, "energy")
        assert isinstance(route, Route)
        counts = iter(range(pairs))
        begin = Candidate(route, "given", legs)
        going = lambda: next(counts, None) is not None  # noqa: E731
        return run, field, route, list(with_moves_driven(run, field, begin, going))


def test_a_bend_that_nothing_asks_for_is_straightened():
    level = terrain(np.zeros((40, 40)))
    straight = np.array([[2.0, 5.0], [8.0, 5.0]])
    bent = np.array([[2.0, 5.0], [5.0, 6.0], [8.0, 5.0]])
    _, _, least, better = searched(level, straight, 10)
    assert not better, "nothing is cheaper than straight on"
    _, _, begun, better = searched(level, bent, 60)
    assert begun.energy_j > 1.03 * least.energy_j
    # Where a sample of the speed lies, it may be a little cheaper than in one piece.
    assert 0.999 * least.energy_j < better[-1].route.energy_j < 1.01 * least.energy_j


@pytest.fixture(scope="module")
def round_a_wall():
    """A wide turn round the end of a wall, and the cheaper routes found from it."""
    solid = np.zeros((80, 80), bool)
    solid[:60, 38:42] = True
    ground = terrain(np.zeros(solid.shape), obstacles=solid)
    ends = {"start": {"x": 4.0, "y": 8.0}, "goal": {"x": 16.0, "y": 8.0}}
    path = np.array([[4.0, 8.0], [8.0, 16.5], [12.0, 16.5], [16.0, 8.0]])
    return searched(ground, path, 40, **ends)


def test_routes_only_ever_get_cheaper_between_the_same_ends(round_a_wall):
    _, _, begun, better = round_a_wall
    energies = [begun.energy_j, *(one.route.energy_j for one in better)]
    assert len(energies) > 3
    assert (np.diff(energies) < 0.0).all()
    for one in better:
        [(path, _)] = one.legs
        np.testing.assert_array_equal(path[[0, -1]], [[4.0, 8.0], [16.0, 8.0]])


def test_every_one_of_them_holds_all_limits(round_a_wall):
    run, field, _, better = round_a_wall
    for one in better:
        assert not broken_limits(field, run.conditions, one.route.motion, finely=True)
        assert all(use.share <= 1.0 + LIMITS_OFF for use in one.route.limits)


def test_what_one_waypoint_less_comes_to_is_driven_once(monkeypatch):
    """There is no opposite of it, and nothing to repeat."""
    driven = []

    def noted(run, field, legs, objective):
        driven.append(legs[0][0])
        return drive_legs(run, field, legs, objective)

    monkeypatch.setattr(driven_moves, "drive_legs", noted)
    monkeypatch.setattr(driven_moves, "LIKELY", {"left out": 1.0})
    bent = np.array([[2.0, 5.0], [5.0, 6.0], [8.0, 5.0]])
    *_, better = searched(terrain(np.zeros((40, 40))), bent, 1)
    assert len(driven) == len(better) == 1
    np.testing.assert_array_equal(driven[0], bent[[0, -1]])


def test_the_same_seed_draws_the_same_moves():
    bent = np.array([[2.0, 5.0], [5.0, 6.0], [8.0, 5.0]])
    level = terrain(np.zeros((40, 40)))
    energies = [
        [one.route.energy_j for one in searched(level, bent, 15, seed=seed)[3]]
        for seed in (1, 1, 2)
    ]
    assert energies[0] == energies[1] != energies[2]
