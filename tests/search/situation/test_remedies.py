"""What would keep a limit on a slope: doing as the clause says does keep it."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.conditions import operating_conditions
from planner.search.limit_places import Infeasible
from planner.search.requests import PlanRequest
from planner.search.situation.remedies import limit_on_slope, remedy
from tests.search.maps import hills, terrain

ENDS = {"map": "here", "start": {"x": 3, "y": 3}, "goal": {"x": 9, "y": 9}}


def conditions_of(payload: float = 0.0, **vehicle):
    model = PowerModel.from_vehicle(replace(load_vehicle("minibalance"), **vehicle))
    request = PlanRequest.from_json({**ENDS, "payload": {"mass": payload}})
    return operating_conditions(request, model, terrain(hills(24)))


def test_a_lighter_robot_or_another_gear_keeps_the_torque():
    slope = math.tan(math.radians(11.0))
    heavy = conditions_of(25.0)
    cause = limit_on_slope(heavy, 0, slope, 1.0, 2.0)
    assert (cause.limit, cause.x, cause.y) == ("torque peak", 1.0, 2.0)
    assert cause.value > cause.allowed == pytest.approx(0.066)
    found = re.search(r"([\d.]+) kg instead of 37, or a gear of ([\d.]+) ", remedy(heavy, cause))
    mass, gear = map(float, found.groups())
    for better in (conditions_of(mass - 12.0), conditions_of(25.0, gear_ratio=gear)):
        kept = limit_on_slope(better, 0, slope, 1.0, 2.0)
        # The load moves less to the rear wheels, too.
        assert kept.value <= 1.01 * kept.allowed


def test_more_grip_keeps_the_traction():
    slope = math.tan(math.radians(26.0))
    light = conditions_of(gear_ratio=60.0)
    cause = limit_on_slope(light, 0, slope, 1.0, 2.0)
    assert cause.limit == "traction"
    traction = float(re.search(r"a traction of ([\d.]+) would do", remedy(light, cause))[1])
    better = conditions_of(gear_ratio=60.0, traction=traction)
    assert limit_on_slope(better, 0, slope, 1.0, 2.0).value <= 1.0


def test_nothing_is_said_where_nothing_is_measured():
    assert remedy(conditions_of(), Infeasible(1.0, 2.0, "the body touches something", True)) == ""
