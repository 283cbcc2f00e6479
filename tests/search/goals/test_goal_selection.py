"""Goals that are regions: where the robot arrives, against planning to single places inside."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import energy_time_front, plan_route
from planner.errors import RequestError
from planner.search import plan
from planner.search.goals import goal_selection
from planner.search.goals.goal_region import Region
from planner.search.limit_places import Infeasible
from planner.search.requests import RegionRequest
from planner.search.solve import Found, summary_of
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills

START = {"x": 3.0, "y": 3.0}
CIRCLE = {"x": 14.0, "y": 14.0, "radius": 3.0}
POLYGON = {"polygon": [[9.0, 10.0], [17.0, 8.0], [18.0, 17.0], [13.0, 12.0], [8.0, 18.0]]}


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m."""
    return Terrain.from_arrays(1.5 * hills(), cell=(0.5, 0.5))


@pytest.fixture(scope="module")
def level() -> Terrain:
    """20 m by 20 m of level ground."""
    return Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5))


def region_of(goal: dict) -> Region:
    """The region of a goal as a request has it."""
    return Region.of(RegionRequest.model_validate(goal))


def inside(goal: dict, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random points (count, 2) inside a goal."""
    region = region_of(goal)
    x0, y0, x1, y1 = region.extent
    points = rng.uniform((x0, y0), (x1, y1), (50 * count, 2))
    return points[region.inside(points)][:count]


@pytest.mark.parametrize("goal", [CIRCLE, POLYGON], ids=["circle", "polygon"])
def test_no_place_inside_is_cheaper(relief, goal):
    answer = plan_route(terrain=relief, start=START, goal=goal)
    route = answer.routes[0]
    end = np.array([[route.arrays["x"][-1], route.arrays["y"][-1]]])
    assert region_of(goal).inside(end).all()
    assert answer.goal == {
        "x": end[0, 0],
        "y": end[0, 1],
        "yaw": pytest.approx(route.arrays["yaw"][-1]),
    }
    assert answer.to_json()["goal"] == answer.goal
    for x, y in inside(goal, np.random.default_rng(5), 10):
        place = {"x": float(x), "y": float(y)}
        single = plan_route(terrain=relief, start=START, goal=place)
        assert route.energy_j <= 1.005 * single.routes[0].energy_j


def test_level_ground_is_entered_where_it_is_nearest(level):
    answer = plan_route(terrain=level, start=START, goal=CIRCLE)
    away = np.array([CIRCLE["x"] - START["x"], CIRCLE["y"] - START["y"]])
    nearest = np.array([CIRCLE["x"], CIRCLE["y"]]) - 3.0 * away / math.hypot(*away)
    arrived = np.array([answer.goal["x"], answer.goal["y"]])
    assert math.hypot(*(arrived - nearest)) < 0.2
    assert answer.routes[0].length_m == pytest.approx(math.hypot(*away) - 3.0, rel=2e-3)


def test_on_a_slope_the_lower_side_is_entered():
    """Height that is not climbed is energy; turning the slope round mirrors the arrival."""
    rise = np.tile(0.1 * 0.5 * np.arange(41)[:, None], (1, 41))
    arrived = []
    for heights in (rise, rise[::-1]):
        plane = Terrain.from_arrays(heights, cell=(0.5, 0.5))
        goal = {"x": 14.0, "y": 10.0, "radius": 4.0}
        answer = plan_route(terrain=plane, start={"x": 3.0, "y": 10.0}, goal=goal)
        arrived.append((answer.goal["x"], answer.goal["y"]))
        entry = {"x": 10.0, "y": 10.0}
        nearest = plan_route(terrain=plane, start={"x": 3.0, "y": 10.0}, goal=entry)
        assert answer.routes[0].energy_j < 0.99 * nearest.routes[0].energy_j
    (x, y), (mirrored_x, mirrored_y) = arrived
    assert y < 9.0
    assert (mirrored_x, mirrored_y) == pytest.approx((x, 20.0 - y), abs=0.2)


def test_the_yaw_is_that_which_was_asked_for(level):
    answer = plan_route(terrain=level, start=START, goal={**CIRCLE, "yaw": 1.0})
    assert math.remainder(answer.goal["yaw"] - 1.0, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_of_several_places_the_cheapest_is_chosen(relief):
    places = [{"x": 17.0, "y": 17.0}, {"x": 12.0, "y": 4.0, "yaw": 0.5}, {"x": 4.0, "y": 16.0}]
    answer = plan_route(terrain=relief, start=START, goal={"any": places})
    singles = [
        plan_route(terrain=relief, start=START, goal=place).routes[0].energy_j for place in places
    ]
    number = answer.goal["number"]
    assert singles[number] == pytest.approx(min(singles), rel=0.005)
    assert (answer.goal["x"], answer.goal["y"]) == (places[number]["x"], places[number]["y"])
    assert answer.routes[0].energy_j == pytest.approx(singles[number], rel=1e-9)


@pytest.mark.parametrize("objective", ["time", "length"])
def test_other_objectives_choose_by_what_they_want_little_of(relief, objective):
    goals = [{"x": 17.0, "y": 17.0}, {"x": 6.0, "y": 9.0}]
    answer = plan_route(terrain=relief, start=START, goal={"any": goals}, objective=objective)
    assert answer.goal["number"] == 1


def test_obstacles_inside_are_kept_clear_of(level):
    """Half of the circle is closed: the other half is entered."""
    bar = {"polygon": [[9.0, 9.0], [15.0, 9.0], [15.0, 15.0], [9.0, 15.0]]}
    answer = plan_route(terrain=level, start=START, goal=CIRCLE, avoid=[bar])
    route = answer.routes[0]
    assert math.hypot(answer.goal["x"] - 14.0, answer.goal["y"] - 14.0) <= 3.0
    covered = (np.abs(route.arrays["x"] - 12.0) < 3.0) & (np.abs(route.arrays["y"] - 12.0) < 3.0)
    assert not covered.any()


def test_a_region_that_cannot_be_reached_is_no_route(level):
    bar = {"polygon": [[-1.0, 9.0], [21.0, 9.0], [21.0, 10.0], [-1.0, 10.0]]}
    answer = plan_route(terrain=level, start=START, goal=CIRCLE, avoid=[bar])
    assert answer.status == "no_route"
    assert "there is the area avoid[0] of the request" in answer.reason
    assert answer.goal is None


def test_a_front_may_end_elsewhere_for_another_price(relief):
    front = energy_time_front(terrain=relief, start=START, goal=CIRCLE, points=3)
    ends = [[p.route.arrays["x"][-1], p.route.arrays["y"][-1]] for p in front.points]
    assert region_of(CIRCLE).inside(np.array(ends)).all()
    single = plan_route(terrain=relief, start=START, goal=CIRCLE).routes[0]
    assert front.points[-1].route.energy_j < 1.003 * single.energy_j


def test_a_half_plane_is_a_goal(level):
    # A circle of 1,000 km: all that lies west of about x = 5.
    goal = {"x": 5.0 - 1e6, "y": 10.0, "radius": 1e6}
    answer = plan_route(terrain=level, start={"x": 12.0, "y": 10.0}, goal=goal)
    assert answer.routes[0].length_m == pytest.approx(7.0, abs=0.01)


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ({"x": 1.0}, r"goal\.y: is missing"),
        ({"x": 1.0, "radius": 1.0}, "neither a circle"),
        ({"x": 1.0, "y": 1.0, "radius": -1.0}, r"goal\.radius: is too small"),
        ({"x": 1.0, "y": 1.0, "radius": 1e308}, r"goal\.radius: is too large .*up to 1e9"),
        ({"x": 1e308, "y": 1.0, "radius": 1.0}, r"goal\.x: is too large .*-1e9 to 1e9"),
        ({"polygon": [[0, 0], [1e308, 0], [0, 1e308]]}, r"goal\.polygon\[1\]\[0\]: is too large"),
        ({"any": []}, r"goal\.any: has too few"),
        ({"any": [{"x": 1.0}]}, r"goal\.any\[0\]\.y: is missing"),
        ({"any": [{"x": 1.0, "y": 1.0}], "yaw": 1.0}, "beside any"),
        ({"x": 500.0, "y": 1.0, "radius": 1.0}, "goal: lies off the map"),
        ({"polygon": [[1, 1], [5, 5], [5, 1], [1, 5]]}, r"goal\.polygon: crosses itself"),
        ({"polygon": [[1, 1], [5, 5], [9, 9]]}, r"goal\.polygon: has no extent"),
        ({"any": [{"x": 500.0, "y": 1.0}]}, r"goal\.any\[0\]: outside the map"),
        ({"any": [{"x": 500.0, "y": 1.0}, {"x": -9.0, "y": 1.0}]}, "none of these places"),
        ({"x": 15.0, "y": 5.0, "radius": 1.0}, "nowhere inside is there room"),
    ],
)
def test_what_is_no_goal_is_refused(level, goal, words):
    closed = [{"x": 15.0, "y": 5.0, "radius": 2.5}]
    with pytest.raises(RequestError, match=words):
        plan_route(terrain=level, start=START, goal=goal, avoid=closed)


@pytest.mark.parametrize("seen", [True, False])
def test_a_place_that_cannot_be_driven_to_hides_no_other(relief, monkeypatch, seen):
    """Neither if the motion along its path is refused already, nor if only the whole search is."""
    near, far = {"x": 8.0, "y": 8.0}, {"x": 16.0, "y": 15.0}
    single = plan_route(terrain=relief, start=START, goal=far)
    whole, along = plan.answer, goal_selection.drive
    stuck = Infeasible(8.0, 8.0, "wheels slide")

    def refused(run):
        goal = run.request.goal
        blank = Found(summary_of(run), reason=stuck.what, cause=stuck)
        return blank if (goal.x, goal.y) == (8.0, 8.0) else whole(run)

    def not_driven(field, conditions, legs, yaws, **named):
        there = tuple(legs[-1][-1]) == (8.0, 8.0)
        return stuck if there and not seen else along(field, conditions, legs, yaws, **named)

    monkeypatch.setattr(plan, "answer", refused)
    monkeypatch.setattr(goal_selection, "drive", not_driven)
    answer = plan_route(terrain=relief, start=START, goal={"any": [near, far]})
    assert answer.status == "ok"
    assert answer.goal["number"] == 1
    assert answer.routes[0].energy_j == single.routes[0].energy_j
    assert plan_route(terrain=relief, start=START, goal={"any": [near]}).cause == stuck.to_json()
