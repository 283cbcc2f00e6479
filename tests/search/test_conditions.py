"""What payload, wind and temperature of a request mean for the model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner import energy_matrix, energy_time_front, plan_route, reachable_area
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions, model_key, operating_conditions
from planner.search.requests import SituationRequest
from planner.search.resolution import DIRECTIONS
from planner.terrain.heightmap import Terrain

MODEL = PowerModel.from_vehicle(load_vehicle("minibalance"))


def asked(model: PowerModel = MODEL, **fields: Any) -> OperatingConditions:
    """The circumstances of a request on level ground."""
    terrain = Terrain.from_arrays(np.zeros((10, 10)), cell=(0.5, 0.5))
    request = SituationRequest.from_json({"map": "here", **fields})
    return operating_conditions(request, model, terrain)


def test_a_payload_shifts_the_centre_of_mass():
    """Levers: moments about the robot's geometric centre add up."""
    conditions = asked(payload={"mass": 6.0, "x": 0.2, "y": -0.1, "height": 0.5})
    own = MODEL.vehicle.mass
    assert conditions.mass == pytest.approx(own + 6.0)
    (row,) = conditions.class_rows
    assert row[INDEX["payload"]] == 6.0
    assert row[INDEX["com_x"]] * conditions.mass == pytest.approx(6.0 * 0.2)
    assert row[INDEX["com_y"]] * conditions.mass == pytest.approx(6.0 * -0.1)
    moment = own * MODEL.vehicle.com_height + 6.0 * 0.5
    assert conditions.model.vehicle.com_height * conditions.mass == pytest.approx(moment)


def test_without_a_height_the_payload_lies_at_the_robots_own():
    conditions = asked(payload={"mass": 6.0})
    assert conditions.model.vehicle.com_height == MODEL.vehicle.com_height
    assert asked().mass == MODEL.vehicle.mass


def test_conditions_are_in_every_row():
    conditions = asked(
        conditions={"motor_temp": 70.0, "ambient_temp": 5.0, "battery_voltage": 20.0}
    )
    for name, value in (("motor_temp", 70.0), ("ambient_temp", 5.0), ("battery_voltage", 20.0)):
        assert (conditions.class_rows[:, INDEX[name]] == value).all()


def test_wind_from_ahead_takes_most_and_from_behind_least():
    dragged = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"])
    assert (asked(dragged).wind_by_direction() == 0.0).all()
    extra = asked(dragged, conditions={"wind": {"x": 8.0}}).wind_by_direction()
    assert extra.shape == (DIRECTIONS,)
    against = DIRECTIONS // 2
    assert extra[against] > 0.0
    assert extra[against] == extra.max()
    assert extra[0] < extra[against]
    # A wind along the map's x axis is the same to the left of it and to the right.
    assert extra[1:] == pytest.approx(extra[:0:-1], abs=1e-9 * extra.max())
    # It turns with the wind.
    turned = asked(dragged, conditions={"wind": {"y": 8.0}}).wind_by_direction()
    assert turned == pytest.approx(
        np.roll(extra, DIRECTIONS // 4), rel=0.05, abs=0.02 * extra.max()
    )


def test_other_models_and_conditions_have_other_keys():
    keys = {
        asked().key,
        asked(payload={"mass": 1.0}).key,
        asked(payload={"mass": 1.0, "y": 0.1}).key,
        asked(conditions={"wind": {"x": 1.0}}).key,
        asked(conditions={"motor_temp": 50.0}).key,
    }
    assert len(keys) == 5
    assert asked().key == asked().key
    other = PowerModel.from_vehicle(load_vehicle("minibalance"), kind="printed/A")
    assert model_key(other) != model_key(MODEL)


def test_what_is_odd_in_the_map_is_in_every_answer():
    floor = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5), odd=("walls of paper",))
    start, goal, said = (3, 3), (8, 3), "odd in the map's file: walls of paper"
    assert said in plan_route(map=floor, start=start, goal=goal).notes
    assert said in energy_time_front(map=floor, start=start, goal=goal, points=2).notes
    assert said in energy_matrix(map=floor, starts=[start, goal]).notes
    assert said in reachable_area(map=floor, start=start, energy_j=50).notes
