"""What time that is left finds: other valleys, other knots, knots moved by what a motion costs."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve.anytime import other_paths, with_waypoints_optimised
from planner.search.solve.grid_planner import near_path_of, on_grid
from planner.search.solve.pipeline import drive_legs
from planner.search.solve.sketch import with_costs
from planner.search.trajectory.limit_checks import broken_limits
from planner.terrain.heightmap import Terrain
from tests.search.maps import hills

ENDS = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 21.0, "y": 19.0}}


@pytest.fixture(scope="module")
def asked():
    """A question on hills of 24 m, and what the grid comes to."""
    relief = Terrain.from_arrays(hills(96, rms_degrees=7.0, seed=8), cell=(0.25, 0.25))
    request = PlanRequest.from_json({"map": "hills", **ENDS, "time_budget_s": 30.0})
    with CancellationToken() as token:
        run = Run(request, situation_of(request, terrain=relief), silent, token)
        yield run, on_grid(run, run.field("energy"), "energy")


def bent(run, attempt):
    """The grid's refined way with every inner knot pushed 0.8 m aside, and its motion."""
    [(path, _)] = attempt.legs
    path = np.vstack([path[0], 0.5 * (path[:-1] + path[1:]), path[-1]])
    path[1:-1] += 0.8 * np.array([-1.0, 1.0]) / np.sqrt(2.0)
    field = run.field("energy", attempt.field.margin)
    legs = with_costs(field, [path])
    return field, legs, drive_legs(run, field, legs, "energy")


def test_waypoint_descent_only_ever_makes_the_motion_cheaper(asked):
    run, attempt = asked
    field, legs, route = bent(run, attempt)
    found = list(with_waypoints_optimised(run, field, [(route, legs)], lambda: 30.0))
    energies = [candidate.route.energy_j for candidate in found]
    assert energies
    assert np.all(np.diff([route.energy_j, *energies]) < 0.0)
    polished = found[-1].route
    assert not broken_limits(field, run.conditions, polished.motion)
    for end, k in (("start", 0), ("goal", -1)):
        at = polished.arrays["x"][k], polished.arrays["y"][k]
        assert at == pytest.approx((ENDS[end]["x"], ENDS[end]["y"]), abs=1e-6)


def test_no_waypoint_moves_once_the_time_is_up(asked):
    run, attempt = asked
    field, legs, route = bent(run, attempt)
    assert not list(with_waypoints_optimised(run, field, [(route, legs)], lambda: 0.0))


def test_perturbed_costs_lead_elsewhere_and_are_not_what_a_route_is_priced_with(asked):
    run, attempt = asked
    random = np.random.default_rng(3)
    shape = attempt.field.heights.shape
    same = near_path_of(run, attempt.field, np.ones(shape), "energy")
    assert same.route.energy_j == pytest.approx(attempt.route.energy_j, rel=1e-9)
    # Twice the price everywhere is the same way, at its true energy.
    double = near_path_of(run, attempt.field, np.full(shape, 2.0), "energy")
    assert double.route.energy_j == pytest.approx(attempt.route.energy_j, rel=5e-3)
    wild = np.exp(0.5 * random.standard_normal(shape))
    other = near_path_of(run, attempt.field, wild, "energy")
    assert not np.array_equal(other.paths[0], attempt.paths[0])
    own = drive_legs(run, attempt.field, other.legs, "energy")
    assert other.route.energy_j == pytest.approx(own.energy_j, rel=1e-3)


def test_other_paths_repeat_for_a_seed(asked):
    run, attempt = asked

    def first_two():
        ways = other_paths(run, attempt)
        return [next(ways)[1].paths[0] for _ in range(2)]

    one, other = first_two(), first_two()
    for mine, theirs in zip(one, other, strict=True):
        np.testing.assert_array_equal(mine, theirs)
