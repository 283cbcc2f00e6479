"""Cells of tens of metres: a slope lasts longer there than motors may give their peak torque."""

from __future__ import annotations

import numpy as np
import pytest

from planner import plan_route
from planner.search.requests import PlanRequest
from planner.search.situation import situation_of
from planner.terrain.heightmap import Terrain

CELL = 80.0
ENDS = {"start": {"x": 400.0, "y": 300.0}, "goal": {"x": 2700.0, "y": 300.0}}


def ridge(degrees: float, fading: bool) -> Terrain:
    """A ridge from south to north with even sides; it may fade out towards the north."""
    rows, columns = np.mgrid[0:24, 0:40]
    height = np.tan(np.radians(degrees)) * CELL * np.clip(6.0 - np.abs(columns - 20.0), 0.0, None)
    share = np.clip((19.0 - rows) / 8.0, 0.0, 1.0) if fading else np.ones(rows.shape)
    return Terrain.from_arrays(height * share, cell=(CELL, CELL), name="ridge")


@pytest.mark.parametrize("cell", [0.1, 10.0, 17.0, 19.0, CELL])
def test_slopes_last_where_a_cell_takes_longer_than_the_peak_may(cell):
    """The built-in vehicle drives 1.2 m/s; its torque counts over 60 s, and twice it for 15 s."""
    flat = Terrain.from_arrays(np.zeros((9, 9)), cell=(cell, cell), name="flat")
    ends = {"start": {"x": cell, "y": cell}, "goal": {"x": 6.0 * cell, "y": cell}}
    request = PlanRequest.from_json({"map": "flat", **ends})
    conditions = situation_of(request, terrain=flat).conditions
    assert conditions.lasting == (cell > 18.0)
    limits = conditions.model.vehicle.limits
    steady = limits.continuous_torque if conditions.lasting else limits.peak_torque
    assert conditions.steady.limits[3] == steady
    # Turns and changes of speed may take the peak.
    assert conditions.limits[3] == limits.peak_torque


def test_the_way_leads_round_what_motors_climb_only_for_a_while():
    route = plan_route(terrain=ridge(24.0, fading=True), **ENDS).routes[0]
    used = {use.limit: use.share for use in route.limits}
    assert 0.0 < used["torque rms"] <= 1.0
    # The ridge reaches its full height up to y = 880 m.
    assert route.arrays["y"].max() > 1000.0


def test_without_a_way_round_the_reason_names_the_mean_torque():
    answer = plan_route(terrain=ridge(26.0, fading=False), **ENDS)
    assert answer.status == "no_route"
    said = answer.to_json()
    assert said["cause"]["limit"] == "torque rms"
    assert said["cause"]["value"] > said["cause"]["allowed"]
    assert "torque rms" in said["reason"]


def test_a_short_slope_may_take_more_than_motors_give_for_good():
    """One cell of 20 m is up in a quarter of the time that torque counts over."""
    step = np.where(np.arange(40) < 20, 0.0, 20.0 * np.tan(np.radians(17.0)))
    terrace = Terrain.from_arrays(np.tile(step, (24, 1)), cell=(20.0, 20.0), name="terrace")
    ends = {"start": {"x": 200.0, "y": 240.0}, "goal": {"x": 600.0, "y": 240.0}}
    answer = plan_route(terrain=terrace, **ends)
    used = {use.limit: use.share for use in answer.routes[0].limits}
    conditions = situation_of(
        PlanRequest.from_json({"map": "terrace", **ends}), terrain=terrace
    ).conditions
    limits = conditions.model.vehicle.limits
    assert used["torque peak"] > limits.continuous_torque / limits.peak_torque
    assert used["torque rms"] <= 1.0
    assert answer.planner.chosen == "grid"


WEAK = """
[body]
mass = 14.5
length = 0.52
width = 0.45
[wheels]
layout = "mecanum"
half_wheelbase = 0.17
half_track = 0.195
radius = 0.0635
[drive]
motor = "pololu-37d-12v"
gear_ratio = 70
[limits]
continuous_torque = 0.004
thermal_time = 8
[battery]
voltage = 12.8
"""


def test_the_reason_is_that_of_the_direct_path_and_not_of_one_round_it(tmp_path):
    """All of a ramp is as steep: ways round the place where motors get too warm only add turns."""
    (tmp_path / "weak.toml").write_text(WEAK)
    ramp = np.tile(np.tan(np.radians(8.0)) * 0.25 * np.arange(24.0), (8, 1))
    answer = plan_route(
        terrain=Terrain.from_arrays(ramp, cell=(0.25, 0.25), name="ramp"),
        vehicle=str(tmp_path / "weak.toml"),
        start={"x": 0.75, "y": 1.0},
        goal={"x": 5.0, "y": 1.0},
    )
    assert answer.status == "no_route"
    assert answer.cause["limit"] == "torque rms"
    assert "gear of" in answer.reason
