"""Ground near the slope limit: routes by poses, straight up where the body cannot turn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.power.limits import broken_in_results
from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.power.vehicles import load_vehicle
from planner.progress import silent
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.field import polyline_cost
from planner.search.grid import cost_from, cost_to_go
from planner.search.limit_places import Infeasible
from planner.search.requests import PlanRequest
from planner.search.resolution import MARGIN, SPIN_UP
from planner.search.run import Run
from planner.search.se2 import PoseLimits, PosePath
from planner.search.se2.hybrid_search import spin_limit
from planner.search.situation import situation_of
from planner.search.solve import grid_planner
from planner.search.solve.pipeline import Attempt, finished
from planner.search.solve.recovery import steep_ground, torque_limits
from planner.search.solve.recovery.caution import PENALISED_PLACES
from planner.search.solve.recovery.steep_ground import smoothed_but_for, without
from planner.search.solve.sketch import ANSWER, Closely, Driven
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain
from tests.benchmarks.hard_maps import rolling
from tests.search.maps import hills, terrain

LOADED = {"mass": 25.0}
EMPTY_KG = 12.0


def run_on(relief: Terrain, start, goal, mass: float = 0.0) -> Run:
    ends = {
        name: dict(zip("xy", at, strict=True)) for name, at in (("start", start), ("goal", goal))
    }
    request = PlanRequest.from_json({"map": "here", "payload": {"mass": mass}, **ends})
    return Run(request, situation_of(request, terrain=relief), silent, CancellationToken())


def loaded_on_hills() -> tuple[Terrain, Run]:
    """Hills with a mean slope of 8°, and a request whose path of least cost is refused."""
    relief = Terrain.from_arrays(rolling((160, 160), 0.25, 8.0, 43), cell=(0.25, 0.25), name="here")
    return relief, run_on(relief, (25.6, 1.83), (2.72, 32.63), **LOADED)


def test_recovery_beside_a_route_by_poses_ends_with_the_budget(monkeypatch):
    """That route is the answer then: nothing else is driven once the time is up."""
    relief, run = loaded_on_hills()
    hurried = PlanRequest(**{**dict(run.request), "time_budget_s": 1e-3})
    driven = []

    def counted(limited, sketches, objective, *more):
        driven.append(objective)
        return finished(limited, sketches, objective, *more)

    monkeypatch.setattr(grid_planner, "finished", counted)
    assert plan_route(hurried, terrain=relief).routes
    assert driven.count("energy") == 1  # the path of least cost, which is refused


def test_beside_a_route_by_poses_no_gentler_slopes_are_tried(monkeypatch):
    """Only paths past places of those before, where none of them can be driven."""
    _, run = loaded_on_hills()
    margins = []

    def refused(run, sketches, *more):
        margins.append(sketches[0].field.margin)
        stuck = Infeasible(9.0, 9.0, "wheels slide")
        return Attempt(sketches[0].field, legs=[], infeasible=stuck)

    monkeypatch.setattr(grid_planner, "finished", refused)
    assert grid_planner.on_grid(run, run.field("energy"), "energy").route is not None
    assert margins == [MARGIN] * (1 + PENALISED_PLACES)


def test_a_loaded_robot_takes_little_more_than_its_metres_cost():
    """The path of least cost turns where it is too steep for that; another one close by does not.

    Its metres are a floor for what any route dissipates. Detours round all such places take a third
    more.
    """
    relief, run = loaded_on_hills()
    start, goal = run.places
    field = run.field("energy")
    to_go = cost_to_go(field, run.situation.lattice("energy", field), goal, token=run.token)
    [route, *_] = plan_route(run.request, terrain=relief).routes
    climbed = (EMPTY_KG + LOADED["mass"]) * STANDARD_GRAVITY * route.rise_m
    assert 0.98 < (route.energy_j - climbed) / cost_from(field, to_go, start) < 1.1


def test_a_route_is_found_where_poses_first_found_cannot_be_driven():
    """Heavy on steep hills: the poses that break a limit are shut until others keep them all."""
    relief = Terrain.from_arrays(rolling((160, 160), 0.25, 8.0, 56), cell=(0.25, 0.25), name="here")
    asked = run_on(relief, (17.02, 3.17), (23.21, 36.05), mass=28.0).request
    [route, *_] = plan_route(asked, terrain=relief).routes
    assert max(use.share for use in route.limits) <= 1.0
    climbed = (EMPTY_KG + 28.0) * STANDARD_GRAVITY * route.rise_m
    assert route.energy_j > climbed


def weak_on_relief() -> tuple[Terrain, PowerModel]:
    """Real relief at 1:400, and a robot whose motors climb about 60 % of its slopes."""
    whole = open_map("jacksboro")
    heights = 0.0025 * whole.heights[156:253, 220:317]
    vehicle = load_vehicle("minibalance")
    weak = replace(vehicle.limits, peak_torque=0.01443, continuous_torque=0.01166)
    cell = (0.0025 * whole.cell[0], 0.0025 * whole.cell[1])
    relief = Terrain.from_arrays(heights - heights.min(), cell=cell, name="here")
    return relief, PowerModel.from_vehicle(replace(vehicle, limits=weak))


def test_moves_that_hold_between_nodes_lead_where_others_are_refused():
    """Between two nodes that hold, most paths of poses are too steep there."""
    relief, model = weak_on_relief()
    ends = {"start": {"x": 2.893, "y": 4.28}, "goal": {"x": 13.301, "y": 4.196}}
    [route, *_] = plan_route(terrain=relief, model=model, **ends).routes
    assert max(use.share for use in route.limits) <= 1.001


def test_a_path_of_poses_can_be_driven_between_its_nodes():
    """Unless too steep moves are asked for, some yaw holds at every place of it."""
    relief, model = weak_on_relief()
    ends = {"start": {"x": 2.893, "y": 4.28}, "goal": {"x": 13.301, "y": 4.196}}
    request = PlanRequest.from_json({"map": "here", **ends})
    situation = situation_of(request, terrain=relief, model=model)
    run = Run(request, situation, silent, CancellationToken())
    field = run.field("energy")

    def cost(**limits: float) -> float:
        [path] = steep_ground.leg_poses(run, field, "energy", PoseLimits(**limits))
        return float(polyline_cost(field, path.polyline, field.step))

    assert cost() < math.inf
    assert cost(too_steep=1.0) == math.inf


@pytest.mark.parametrize("limit", ["torque rms", "torque peak"])
def test_paths_of_poses_that_are_too_warm_ask_for_the_continuous_torque(monkeypatch, limit):
    """Whatever stops the path of least cost: less torque at any moment is less warmth."""
    run = run_on(terrain(hills(64, rms_degrees=6.0)), (2.0, 2.0), (11.0, 8.0))
    stuck, allowed = Infeasible(6.0, 5.0, "the body cannot turn"), []

    def refused(run, sketches, objective, effort, closely):
        allowed.append(float(run.conditions.limits[3]))
        closely.known[(b"poses",)] = Infeasible(7.0, 5.0, "motors", limit=limit)
        return Attempt(sketches[0].field, legs=[], infeasible=stuck)

    for module in (grid_planner, torque_limits):
        monkeypatch.setattr(module, "finished", refused)
    monkeypatch.setattr(grid_planner, "straight_up", lambda *args: None)
    assert grid_planner.on_grid(run, run.field("energy"), "energy").route is None
    limits = run.conditions.model.vehicle.limits
    for_good = {limits.continuous_torque} if limit == "torque rms" else set()
    assert set(allowed) == {limits.peak_torque} | for_good


def test_no_search_follows_that_goes_no_further_than_one_in_vain(monkeypatch):
    """With poses shut since or fewer moves, it would find none again."""
    run = run_on(terrain(hills(64, rms_degrees=6.0)), (2.0, 2.0), (11.0, 8.0))
    searched = []
    monkeypatch.setattr(
        steep_ground, "leg_poses", lambda run, field, aim, limits, free: searched.append(limits)
    )
    field, closely = run.field("energy"), Closely("energy")
    first = steep_ground.FIRST
    found = steep_ground.straight_up(run, field, "energy", ANSWER, closely, first)
    assert found is None
    assert searched == [first[0].limits, first[-1].limits]


@pytest.mark.parametrize(
    ("seed", "mass", "start", "goal"),
    [
        (62, 25.0, (23.84950625716868, 29.04149890056922), (30.27615191267396, 11.794574847944977)),
        (101, 28.0, (16.56, 7.5), (3.4, 33.06)),
    ],
)
def test_no_limit_is_broken_where_drag_changes_within_a_moment(seed, mass, start, goal):
    """From one chord of a bend to the next a wheel turns back; at a stop, drag fades."""
    hilly = rolling((160, 160), 0.25, 8.0, seed)
    relief = Terrain.from_arrays(hilly, cell=(0.25, 0.25), name="here")
    [route, *_] = plan_route(run_on(relief, start, goal, mass=mass).request, terrain=relief).routes
    assert max(use.share for use in route.limits) <= 1.001


def test_poses_that_break_a_limit_are_shut_and_no_others():
    run = run_on(terrain(hills(64, rms_degrees=6.0)), (2.0, 2.0), (11.0, 8.0))
    field = run.field("energy")
    path = PosePath(np.linspace((2.0, 2.0), (11.0, 8.0), 60), np.full(60, 0.5), 1.0)
    mask = without(field.mask, field, [path], Infeasible(*path.points[30], "wheels slide"))
    changed = np.argwhere(mask != field.mask)
    apart = np.hypot(*(field.nodes_at(path.points[30]) - changed).T)
    assert len(changed) > 0
    assert apart.max() < 3.0
    [j, i] = changed[0]
    assert bin(int(field.mask[j, i] & ~mask[j, i])).count("1") == 3


@pytest.mark.parametrize(("missed", "searches"), [(0.02, 1), (0.005, 0)])
def test_poses_are_searched_where_a_much_cheaper_path_than_the_best_is_refused(
    monkeypatch, missed, searches
):
    """By 1 % and more; without poses, the best path that is driven is answered."""
    relief = terrain(hills(64, rms_degrees=6.0))
    asked = run_on(relief, (2.0, 2.0), (11.0, 8.0)).request
    searched = []

    def cheaper_refused(*args):
        stuck = Infeasible(6.0, 5.0, "wheels slide")
        return replace(finished(*args), missed=missed, infeasible=stuck)

    monkeypatch.setattr(grid_planner, "finished", cheaper_refused)
    monkeypatch.setattr(grid_planner, "straight_up", lambda *args: searched.append(args))
    assert plan_route(asked, terrain=relief).routes
    assert len(searched) == searches


def ramp(degrees: float) -> Terrain:
    """Level ground, a ramp of 5 m to the east that begins at x = 4 m, and level ground again."""
    along = np.clip(0.1 * np.arange(140) - 4.0, 0.0, 5.0)
    return terrain(np.tile(math.tan(math.radians(degrees)) * along, (60, 1)), cell=0.1)


@pytest.mark.parametrize("mass", [0.0, 20.0])
def test_above_its_limit_some_yaw_does_not_turn_on_the_spot(mass):
    """By the power model itself, with all yaw angles; a heavier robot turns on gentler slopes."""
    conditions = run_on(ramp(5.0), (3.0, 3.0), (11.0, 3.0), mass).situation.conditions
    [limit] = spin_limit(conditions)

    def broken(slope: float) -> bool:
        rows = np.repeat(conditions.class_rows, 180, axis=0)
        rows[:, INDEX["wz"]] = conditions.limits[6]
        rows[:, INDEX["yaw_acceleration"]] = SPIN_UP * conditions.limits[6]
        for row, yaw in zip(rows, np.radians(np.arange(0.0, 360.0, 2.0)), strict=True):
            set_motion(row, slope, 0.0, yaw, 0.0, 0.0)
        results = conditions.model.power_and_limits(rows)
        return any(broken_in_results(one, conditions.limits) >= 0 for one in results)

    assert not broken(0.97 * limit)
    assert broken(1.08 * limit + 0.02)
    if mass:
        assert limit < spin_limit(run_on(ramp(5.0), (3, 3), (11, 3)).situation.conditions)[0]


def test_a_place_that_poses_themselves_do_not_pass_is_given_up_soon(monkeypatch):
    """The path as it was found is held round it, then twice as far; more of it is no remedy."""
    run = run_on(terrain(hills(64, rms_degrees=6.0)), (2.0, 2.0), (11.0, 8.0))
    path = np.linspace((2.0, 2.0), (11.0, 8.0), 60)
    poses = [PosePath(path, np.zeros(len(path)), 1.0)]
    stuck, driven = Infeasible(*path[30], "wheels slide"), []

    def refused(run, field, legs, objective):
        driven.append(legs)
        return Driven(legs, stuck)

    monkeypatch.setattr(steep_ground, "driven_roughly", refused)
    field = run.field("energy")
    closely = Closely("energy")
    found = steep_ground.smoothed_where_it_moves(run, field, poses, "energy", closely, 2.0)
    assert found.motion is stuck
    assert len(driven) == 4


def test_held_stretches_stay_and_the_rest_costs_no_more():
    run = run_on(terrain(hills(64, rms_degrees=6.0)), (2.0, 2.0), (11.0, 8.0))
    field = run.field("energy")
    steps = np.tile([[0.5, 0.0], [0.25, 0.5]], (12, 1))
    path = np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)]) + 2.0
    held = np.zeros(len(path), bool)
    held[len(path) // 3 : len(path) // 2] = True
    all_kept = smoothed_but_for(run, field, path, np.ones(len(path), bool), 0.0, 4.0)
    np.testing.assert_array_equal(all_kept, path)
    partly = smoothed_but_for(run, field, path, held, 0.0, 4.0)
    apart = np.hypot(*(partly[:, None] - path[held]).T).min(axis=1)
    assert apart.max() == 0.0
    free = smoothed_but_for(run, field, path, np.zeros(len(path), bool), 0.0, 4.0)
    costs = [polyline_cost(field, one, field.step) for one in (free, partly, path)]
    assert costs[0] <= costs[1] * (1.0 + 1e-9) <= costs[2] * (1.0 + 1e-9)
    assert costs[0] < costs[2]
