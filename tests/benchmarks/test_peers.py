"""The benchmark's other planners are given the cost that ours has, and every path one price."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from planner import plan_route
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import segment_cost
from planner.search.ompl.costs import pose_cost, turning_rates
from planner.search.resolution import YAWS
from tests.benchmarks.peers import dijkstra, eikonal
from tests.benchmarks.peers.best_known import best_known, distinct
from tests.benchmarks.peers.case import Case, case_of, node_costs
from tests.benchmarks.peers.limits import broken_limits
from tests.benchmarks.peers.poses import score_as_they_are
from tests.benchmarks.peers.report import bars, least, row_of, time_to
from tests.search.maps import hills, terrain

ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 19.0}}


def on_plane(degrees: float, cells: int = 40) -> Case:
    rise = math.tan(math.radians(degrees)) * 0.25
    plane = np.tile(rise * np.arange(cells), (cells, 1))
    asked = {"start": {"x": 2.0, "y": 5.0}, "goal": {"x": 8.0, "y": 5.0}}
    return case_of("test", asked, terrain(plane))


@pytest.fixture(scope="module")
def relief() -> Case:
    return case_of("test", ASKED, terrain(hills()))


@pytest.mark.parametrize("heading", [0.0, 0.7, math.pi / 2, math.pi, 5.0])
def test_the_best_yaw_costs_what_the_plane_says(heading: float) -> None:
    """Eliminating yaw is the minimum over it, on a plane exactly."""
    case = on_plane(6.0)
    prices = turning_rates(case.situation.conditions, "energy")
    a = np.array([5.0, 5.0])
    b = a + 2.0 * np.array([math.cos(heading), math.sin(heading)])
    over_yaw = [
        pose_cost(case.field, prices, (*a, yaw), (*b, yaw))
        for yaw in heading + 2.0 * math.pi * np.arange(YAWS) / YAWS
    ]
    assert min(over_yaw) == pytest.approx(segment_cost(case.field, *a, *b, 0.125), rel=5e-3)


def test_turning_costs_by_the_angle_and_the_same_both_ways() -> None:
    case = on_plane(0.0)
    prices = turning_rates(case.situation.conditions, "energy")

    def turned(angle: float) -> float:
        return float(pose_cost(case.field, prices, (5.0, 5.0, 0.0), (5.0, 5.0, angle)))

    assert turned(1.0) == pytest.approx(turned(-1.0))
    assert turned(2.0) == pytest.approx(2.0 * turned(1.0))
    # The shorter way round.
    assert turned(2.0 * math.pi - 1.0) == pytest.approx(turned(1.0))
    # On the move the electronics are paid by the metres.
    assert 0.0 < prices[1] < prices[0]


def test_a_driven_route_costs_the_same_in_three_dimensions(relief: Case) -> None:
    """Pose by pose the tables add up to what the power model dissipates, ramps aside."""
    route = plan_route(terrain=relief.situation.ground.terrain, **ASKED).routes[0]
    poses = np.column_stack([route.arrays[name] for name in ("x", "y", "yaw")])
    prices = turning_rates(relief.situation.conditions, "energy")
    steps = zip(poses[:-1], poses[1:], strict=True)
    tables = sum(pose_cost(relief.field, prices, tuple(a), tuple(b)) for a, b in steps)
    climb = route.arrays["z"][-1] - route.arrays["z"][0]
    dissipated = route.energy_j - relief.situation.conditions.mass * STANDARD_GRAVITY * climb
    assert tables == pytest.approx(dissipated, rel=0.06)
    assert score_as_they_are(relief, poses) == pytest.approx(route.energy_j, rel=0.01)


def test_level_ground_has_circles_and_slopes_have_ellipses_along_them() -> None:
    level = eikonal.prepare(on_plane(0.0))
    inner = level.ratio[8:-8, 8:-8]  # the map's edge is a wall
    assert inner == pytest.approx(np.ones_like(inner), abs=0.02)
    costs = node_costs(on_plane(8.0).field)[20, 20]
    both = 0.5 * (costs + np.roll(costs, len(costs) // 2))
    slope = eikonal.prepare(on_plane(8.0))
    angles = 2.0 * np.pi * np.arange(len(costs)) / len(costs) - slope.axis[20, 20]
    said = slope.along[20, 20] * np.hypot(np.cos(angles), slope.ratio[20, 20] * np.sin(angles))
    assert said == pytest.approx(both, rel=0.05)
    # The map is the same after a mirror across the slope, so the axis lies along or across it.
    assert math.sin(2.0 * slope.axis[20, 20]) == pytest.approx(0.0, abs=0.05)


def test_dijkstra_goes_straight_where_nothing_is_gained_by_a_bend() -> None:
    case = on_plane(0.0)
    _, path = dijkstra.shortest(case, dijkstra.prepare(case))
    assert path is not None
    assert np.ptp(path[:, 1]) < 1e-9
    assert case.score(path) == pytest.approx(case.score(path[[0, -1]]), rel=3e-3)


def test_the_best_known_is_never_above_a_path_refined(relief: Case) -> None:
    _, path = dijkstra.shortest(relief, dijkstra.prepare(relief))
    assert path is not None
    refined = relief.refined(path, {4.0: (1.0,)})
    best = best_known(relief, distinct(relief, [path, path + 1e-3], 5), seconds=0.5)
    assert refined is not None
    assert best is not None
    assert best.energy_j <= refined.energy_j
    assert len(distinct(relief, [path, path + 1e-3], 5)) == 1


def test_driving_too_fast_breaks_limits(relief: Case) -> None:
    """The same way in half the time: twice the speed, four times the acceleration."""
    route = plan_route(terrain=relief.situation.ground.terrain, **ASKED).routes[0]
    assert broken_limits(relief, route) == {}
    arrays = dict(route.arrays)
    arrays |= {"t": 0.5 * arrays["t"], "speed": 2.0 * arrays["speed"]}
    broken = broken_limits(relief, replace(route, arrays=MappingProxyType(arrays)))
    assert {"speed", "acceleration"} <= set(broken)


def found(method: str, seconds: float, **energies: float | None) -> dict[str, object]:
    return {
        "method": method,
        "seconds": seconds,
        "energies": {kind.replace("_", " "): energy for kind, energy in energies.items()},
    }


def test_excess_is_over_the_cheapest_of_all_and_bars_follow() -> None:
    row = row_of(
        "cone",
        ASKED,
        [
            found("ours", 0.1, as_it_is=100.05) | {"broken": {}},
            found("MCP_Geometric", 0.01, as_it_is=110.0, straightened=None, refined=100.0),
            found("BIT*, energy", 1.0, own_yaw=120.0, as_it_is=102.0),
            found("BIT*, energy", 2.0, own_yaw=105.0, as_it_is=100.9),
        ],
    ) | {"poses_s": 20.0}
    assert row["best_by"] == "MCP_Geometric, refined"
    assert least(row["methods"]["MCP_Geometric"], ["straightened"]) is None
    assert time_to(row["methods"]["BIT*, energy"], ["as it is"]) == 2.0
    assert math.isinf(time_to(row["methods"]["BIT*, energy"], ["own yaw"]))
    told = bars([row])
    assert told["gap to the best known"]["holds"]
    assert not told["gap to the best known, given ten seconds"]["holds"], "nobody measured it"
    assert told["MCP_Geometric over ours"]["median_percent"] == pytest.approx(9.945, abs=1e-3)
    faster = told["time to within 1 %, BIT* over ours"]
    assert faster["our yaw"]["median_ratio"] == pytest.approx(20.0)
    # Never near: it counts with all the time that it had.
    assert faster["own yaw"]["median_ratio"] == pytest.approx(200.0)
    assert faster["own yaw"]["bit_star_never_near"] == 1
