"""Where the robot may stand, what it passes, and what it is told when it cannot."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from planner import plan_route
from planner.errors import Cancelled, InputError, RequestError, VehicleError
from planner.power.vehicles import load_vehicle
from planner.terrain.obstacles import rectangle_free
from tests.search.maps import drawn, terrain

ROOM = """
##############################
#............................#
#............................#
#............................#
#............................#
#............................#
#............................#
#............................#
#............................#
##############################
"""


def wall_with_gap(cells: int, *, cell: float = 0.1):
    """24 x 12 m with a wall across the middle and a gap of so many cells."""
    obstacles = np.zeros((120, 240), bool)
    obstacles[:, 119:122] = True
    obstacles[56 : 56 + cells, 119:122] = False
    return terrain(np.zeros((120, 240)), cell=cell, obstacles=obstacles)


def every_pose_is_free(answer, ground) -> bool:
    """The body with its clearance, but for a millimetre, is free at poses and between them."""
    a = answer.routes[0].arrays
    for k in range(len(a["x"]) - 1):
        for w in np.linspace(0.0, 1.0, 4):
            x, y, yaw = (a[n][k] + w * (a[n][k + 1] - a[n][k]) for n in ("x", "y", "yaw"))
            if not rectangle_free(
                ground.obstacles,
                *ground.origin,
                *ground.cell,
                x,
                y,
                yaw,
                0.43 + 0.049,
                0.26 + 0.049,
            ):
                return False
    return True


def test_narrow_passage_is_passed_lengthwise():
    """0.7 m: wider than the body (0.52 m) and narrower than it is long (0.86 m)."""
    ground = wall_with_gap(7)
    answer = plan_route(
        terrain=ground,
        start={"x": 4.0, "y": 4.0, "yaw": math.pi / 2},
        goal={"x": 20.0, "y": 8.0, "yaw": math.pi / 2},
        iterations=500,
    )
    assert answer.status == "ok", answer.reason
    a = answer.routes[0].arrays
    inside = np.abs(a["x"] - 12.0) < 0.3
    assert np.abs(np.sin(a["yaw"][inside])).max() < math.sin(math.radians(15.0))
    assert every_pose_is_free(answer, ground)


def test_passage_that_is_too_narrow_blocks():
    """0.5 m is narrower than the body; the reason names passage, place and what is missing."""
    answer = plan_route(
        terrain=wall_with_gap(5), start={"x": 4.0, "y": 5.8}, goal={"x": 20.0, "y": 5.8}
    )
    assert answer.status == "no_route"
    assert answer.routes == ()
    assert "narrow, 0.50 m at x 1" in answer.reason
    assert "needs 0.62 m, 12 cm more" in answer.reason
    assert answer.cause["limit"] == "clearance"
    assert answer.cause["value"] == pytest.approx(0.5, abs=0.005)
    assert answer.cause["allowed"] == pytest.approx(0.62)


def test_of_several_gaps_the_widest_is_named():
    """It lies far from the straight line."""
    ground = wall_with_gap(3)
    ground.obstacles[12:17, 119:122] = False
    answer = plan_route(terrain=ground, start={"x": 4.0, "y": 5.8}, goal={"x": 20.0, "y": 5.8})
    assert answer.cause["y"] == pytest.approx(1.4, abs=0.3)
    assert answer.cause["value"] == pytest.approx(0.5, abs=0.005)


def test_a_via_place_and_an_area_to_avoid_are_named_by_number():
    """Both count from zero, as in the request."""
    answer = plan_route(
        terrain=wall_with_gap(9),
        start={"x": 4.0, "y": 5.8},
        goal={"x": 4.0, "y": 8.0},
        via=[{"x": 3.0, "y": 3.0}, {"x": 20.0, "y": 5.0}],
        avoid=[
            {"x": 2.0, "y": 10.0, "radius": 0.3},
            {"polygon": [[11.5, 0], [12.5, 0], [12.5, 12], [11.5, 12]]},
        ],
    )
    assert answer.status == "no_route"
    assert answer.reason.startswith("via[1] cannot be reached")
    assert "avoid[1]" in answer.reason


def test_the_gentlest_crossing_of_a_ridge_is_named_with_what_would_do():
    """With less weight, or another gear, as the sentence says, the ridge is crossed."""
    x = 0.25 * np.arange(100)
    heights = np.tile(math.tan(math.radians(11.0)) * np.clip(x - 9, 0, 3), (80, 1))
    heights[50:56] *= 0.95
    asked = {"start": {"x": 3, "y": 6}, "goal": {"x": 20, "y": 6}}
    answer = plan_route(terrain=terrain(heights), payload={"mass": 25}, **asked)
    assert answer.status == "no_route"
    assert 12.0 < answer.cause["y"] < 14.5
    assert answer.cause["limit"] == "torque peak"
    share = answer.cause["value"] / answer.cause["allowed"]
    assert share > 1.0
    found = re.search(r"([\d.]+) kg instead of 37, or a gear of ([\d.]+) would do", answer.reason)
    mass, gear = map(float, found.groups())
    assert mass == pytest.approx(37.0 / share, abs=0.11)
    assert gear == pytest.approx(26.85 * share, abs=0.11)
    # The figure is for even driving; bends before the ridge take a little more.
    lighter = plan_route(terrain=terrain(heights), payload={"mass": 0.88 * mass - 12.0}, **asked)
    assert lighter.status == "ok", lighter.reason


def test_corners_round_obstacles_are_free():
    """No pose of a route round walls touches anything."""
    ground = drawn(
        """
        ########################
        #......................#
        #......................#
        #......#...............#
        #......#...............#
        #......#.......#.......#
        #......#.......#.......#
        #......#.......#.......#
        #......#.......#.......#
        #..............#.......#
        #..............#.......#
        #..............#.......#
        ########################
        """,
        cell=0.5,
    )
    answer = plan_route(
        terrain=ground, start={"x": 1.5, "y": 1.5}, goal={"x": 10.0, "y": 1.5}, iterations=500
    )
    assert answer.status == "ok", answer.reason
    assert every_pose_is_free(answer, ground)


def test_holes_are_not_ground():
    """Unknown cells across the whole map: no way, and the hole is named."""
    known = np.ones((60, 60), bool)
    known[:, 29:31] = False
    answer = plan_route(
        terrain=terrain(np.zeros((60, 60)), known=known),
        start={"x": 3, "y": 7},
        goal={"x": 12, "y": 7},
    )
    assert answer.status == "no_route"
    assert "hole" in answer.reason


def test_a_ledge_is_not_a_ramp():
    """A step of 0.1 m between two cells blocks; spread over a metre it is a ramp of 5.7°."""
    x = 0.1 * np.arange(120)
    step = np.tile(np.where(x > 6.0, 0.1, 0.0), (60, 1))
    ramp = np.tile(np.clip(x - 5.5, 0.0, 1.0) * 0.1, (60, 1))
    ends = {"start": {"x": 2.0, "y": 3.0}, "goal": {"x": 10.0, "y": 3.0}}
    blocked = plan_route(
        terrain=terrain(step, cell=0.05), start={"x": 1, "y": 1.5}, goal={"x": 5, "y": 1.5}
    )
    assert blocked.status == "no_route"
    assert "ledge" in blocked.reason
    assert plan_route(terrain=terrain(ramp, cell=0.1), **ends).status == "ok"


def test_a_slope_beyond_the_limit_is_named_with_both_angles():
    """A ridge of 26° right across: the reason says 26° and the limit."""
    x = 0.25 * np.arange(100)
    heights = np.tile(math.tan(math.radians(26.0)) * np.clip(x - 9, 0, 3), (80, 1))
    answer = plan_route(terrain=terrain(heights), start={"x": 3, "y": 10}, goal={"x": 20, "y": 10})
    assert answer.status == "no_route"
    assert "slope of 26" in answer.reason or "slope of 25.9" in answer.reason
    assert answer.cause["limit"] in ("traction", "torque peak")
    assert "limit" in answer.reason


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({"x": -3.0, "y": 2.0}, ("start", "outside the map", "-3")),
        ({"x": 14.4, "y": 2.0}, ("start", "obstacle", "nearest")),
        ({"x": 0.6, "y": 2.0, "yaw": 0.0}, ("start", "touches", "clearance")),
    ],
)
def test_a_start_that_cannot_be_is_refused(place, words):
    """One sentence with field, value and what would be accepted."""
    with pytest.raises(RequestError) as refused:
        plan_route(terrain=drawn(ROOM, cell=0.5), start=place, goal={"x": 8.0, "y": 2.0})
    for word in words:
        assert word in str(refused.value)
    assert "accepted" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_place_that_is_offered_has_room_for_the_yaw():
    """Beside the wall there is room across only: 0.86 m by 0.52 m, and cells of 0.5 m."""
    asked = {"terrain": drawn(ROOM, cell=0.5), "goal": {"x": 8.0, "y": 2.0}}
    with pytest.raises(RequestError, match="touches an obstacle at x 0") as refused:
        plan_route(**asked, start={"x": 0.6, "y": 2.0, "yaw": 0.0})
    offered = re.search(r"for this yaw, the nearest at x (\S+), y (\S+)", refused.value.accepted)
    x, y = (float(word) for word in offered.groups())
    assert plan_route(**asked, start={"x": x, "y": y, "yaw": 0.0}).status == "ok"


def test_at_the_border_the_edge_of_the_map_is_touched():
    with pytest.raises(RequestError, match="touches the edge of the map with this yaw"):
        plan_route(
            terrain=terrain(np.zeros((40, 40))),
            start={"x": 0.2, "y": 4.0, "yaw": 0.0},
            goal={"x": 7, "y": 7},
        )


def test_a_slope_that_cannot_be_held_is_refused():
    """30° is beyond traction: the start is refused with slope and limit."""
    x = 0.25 * np.arange(60)
    heights = np.tile(math.tan(math.radians(30.0)) * x, (60, 1))
    with pytest.raises(RequestError, match=r"start: the slope of 30\.0° .* cannot be held"):
        plan_route(terrain=terrain(heights), start={"x": 7, "y": 7}, goal={"x": 9, "y": 7})


def test_a_refusal_says_what_is_odd_in_the_vehicle():
    """With an inverted gear no slope is held, and the slope is not what to look at."""
    x = 0.25 * np.arange(60)
    heights = np.tile(math.tan(math.radians(5.0)) * x, (60, 1))
    inverted = replace(load_vehicle("minibalance"), gear_ratio=1.0 / 26.85)
    with pytest.raises(RequestError, match=r"be held.*file: drive\.gear_ratio.*is it 26\.85"):
        plan_route(terrain=terrain(heights), vehicle=inverted, start=(7, 7), goal=(9, 7))


def test_hole_under_the_start_is_refused():
    """A hole is named as one."""
    known = np.ones((40, 40), bool)
    known[10:14, 10:14] = False
    with pytest.raises(RequestError, match="start: on a hole"):
        plan_route(
            terrain=terrain(np.zeros((40, 40)), known=known),
            start={"x": 3.0, "y": 3.0},
            goal={"x": 8, "y": 8},
        )


def test_unknown_vehicle_lists_the_known_ones():
    """The sentence names the wrong vehicle and those that there are."""
    with pytest.raises(VehicleError, match=r"hovercraft.*minibalance"):
        plan_route(
            terrain=drawn(ROOM, cell=0.5),
            vehicle="hovercraft",
            start={"x": 2, "y": 2},
            goal={"x": 8, "y": 2},
        )


def test_start_that_is_the_goal_costs_nothing_but_turning():
    """Standing still costs nothing; turning on the spot costs what the model says."""
    ground = drawn(ROOM, cell=0.5)
    here = {"x": 5.0, "y": 2.0}
    still = plan_route(terrain=ground, start=here, goal=here)
    assert still.status == "ok"
    assert still.routes[0].energy_j == pytest.approx(0.0, abs=1e-9)
    turned = plan_route(
        terrain=ground,
        start={**here, "yaw": 0.0},
        goal={**here, "yaw": math.pi / 2},
    )
    # 15.7 W at 1 rad/s for 90°, with ramps of half a second on either side.
    assert 20.0 < turned.routes[0].energy_j < 35.0


def test_via_points_are_passed_in_order():
    """The route comes by both via points, with the yaw asked for at the second."""
    ground = terrain(np.zeros((60, 60)))
    answer = plan_route(
        terrain=ground,
        start={"x": 2, "y": 2},
        goal={"x": 12, "y": 2},
        via=[{"x": 4, "y": 9}, {"x": 10, "y": 9, "yaw": 1.0}],
    )
    a = answer.routes[0].arrays
    first = int(np.argmin(np.hypot(a["x"] - 4, a["y"] - 9)))
    second = int(np.argmin(np.hypot(a["x"] - 10, a["y"] - 9)))
    assert first < second
    assert np.hypot(a["x"][first] - 4, a["y"][first] - 9) < 1e-6
    assert math.remainder(a["yaw"][second] - 1.0, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_alternatives_differ():
    """Two ways round a block: the second one runs on the other side and costs no less."""
    obstacles = np.zeros((80, 80), bool)
    obstacles[25:52, 30:50] = True
    answer = plan_route(
        terrain=terrain(np.zeros((80, 80)), obstacles=obstacles),
        start={"x": 3, "y": 10},
        goal={"x": 17, "y": 10},
        alternatives=2,
    )
    assert len(answer.routes) == 2, answer.notes
    north = [route.arrays["y"][len(route.arrays["y"]) // 2] > 10 for route in answer.routes]
    assert north[0] != north[1]
    assert answer.routes[0].energy_j <= answer.routes[1].energy_j


def test_battery_says_whether_the_energy_fits():
    """With a nearly empty battery the route does not fit, and the shares say so."""
    ends = {"start": {"x": 2, "y": 2}, "goal": {"x": 12, "y": 2}}
    ground = drawn(ROOM, cell=0.5)
    full = plan_route(terrain=ground, **ends).routes[0]
    empty = plan_route(terrain=ground, **ends, conditions={"battery_charge": 1e-4}).routes[0]
    assert full.battery.fits
    assert not empty.battery.fits
    assert full.battery.share == pytest.approx(full.energy_j / 432_000.0)


def test_cancelling_stops():
    """A caller that says stop gets Cancelled."""
    with pytest.raises(Cancelled):
        plan_route(
            terrain=drawn(ROOM, cell=0.5),
            start={"x": 2, "y": 2},
            goal={"x": 12, "y": 2},
            cancelled=lambda: True,
        )


def test_headwind_costs_and_calm_does_not():
    """With air drag active, wind from ahead costs more than wind from behind."""
    from planner.power.model import PowerModel
    from planner.power.vehicles import load_vehicle

    vehicle = load_vehicle("minibalance")
    model = PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, "air_drag"])
    ends = {"start": {"x": 2, "y": 2}, "goal": {"x": 12, "y": 2}}
    energy = {
        wind: plan_route(
            terrain=drawn(ROOM, cell=0.5),
            model=model,
            **ends,
            conditions={"wind": {"x": wind, "y": 0.0}},
        )
        .routes[0]
        .energy_j
        for wind in (-5.0, 0.0, 5.0)
    }
    assert energy[-5.0] > energy[0.0] > energy[5.0]


@pytest.mark.parametrize("field", ["start", "goal"])
def test_nan_is_refused(field):
    """NaN is named by its field."""
    places = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 8.0, "y": 2.0}}
    places[field] = {"x": math.nan, "y": 2.0}
    with pytest.raises(InputError, match=rf"{field}\.x"):
        plan_route(terrain=drawn(ROOM, cell=0.5), **places)


def test_turning_on_the_spot_needs_room():
    """In a corridor of 0.7 m a body of 0.86 m cannot turn round."""
    obstacles = np.ones((60, 120), bool)
    obstacles[26:33, 2:118] = False
    ground = terrain(np.zeros((60, 120)), cell=0.1, obstacles=obstacles)
    here = {"x": 6.0, "y": 2.9}
    answer = plan_route(
        terrain=ground,
        start={**here, "yaw": 0.0},
        goal={**here, "yaw": math.pi},
    )
    assert answer.status == "no_route"
    assert "touches" in answer.reason


@pytest.mark.parametrize("distance", [0.005, 0.02, 0.05, 0.1])
def test_a_goal_close_by_is_reached(distance):
    """A goal nearer than any ramp is still driven to, and costs more the farther it is."""
    answer = plan_route(
        terrain=terrain(np.zeros((40, 40))),
        start={"x": 5.0, "y": 5.0},
        goal={"x": 5.0 + distance, "y": 5.0},
    )
    assert answer.status == "ok"
    assert answer.routes[0].length_m == pytest.approx(distance)


def test_real_relief_has_routes_or_reasons_that_hold():
    """Random pairs on the Jacksboro relief: a route, or a place that is too steep by the map."""
    from planner.terrain.catalogue import open_map

    relief = open_map("jacksboro-1to100")
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(8):
        ends = [{"x": rng.uniform(40, 260), "y": rng.uniform(40, 280)} for _ in range(2)]
        try:
            answer = plan_route(terrain=relief, start=ends[0], goal=ends[1])
        except RequestError:  # a start on a slope that cannot be held
            continue
        found += answer.status == "ok"
        if answer.status == "no_route":
            assert "slope" in answer.reason, answer.reason
    assert found >= 1


def test_a_turn_that_a_slope_refuses_names_the_limit_and_what_would_do():
    """Heights in whole decimetres: the loaded robot climbs some of the steps, and turns on few."""
    y, x = 0.25 * np.indices((30, 40))
    rough = gaussian_filter(np.random.default_rng(3).standard_normal((30, 40)), 6)
    ground = terrain(np.round((0.05 * x + 0.03 * y + 0.6 * rough) / 0.1) * 0.1)
    ends = {"start": {"x": 1.5, "y": 1.5}, "goal": {"x": 8.0, "y": 6.0}}
    answer = plan_route(terrain=ground, **ends, payload={"mass": 20.0})
    assert answer.status == "no_route"
    assert re.search(
        r"cannot turn .*, on a slope of 1\d\.\d° \(torque peak 1\.\d\d times", answer.reason
    )
    assert answer.cause["limit"] == "torque peak"
    assert answer.cause["value"] > answer.cause["allowed"] == pytest.approx(0.066)
    lighter = float(re.search(r"([\d.]+) kg instead of 32", answer.reason).group(1))
    again = plan_route(terrain=ground, **ends, payload={"mass": lighter - 12.0})
    assert again.status == "ok"
