"""plan_route as a user calls it: files, vehicles that lack something, notes."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner import (
    energy_graph,
    energy_matrix,
    energy_time_front,
    plan_route,
    reachable_area,
)
from planner.errors import RequestError, VehicleError
from planner.power.model import PowerModel
from planner.power.saved import Covered, EnergyError
from planner.power.vehicles import load_vehicle
from planner.terrain.heightmap import Terrain

CART = """
[body]
mass = 12.0
length = 0.75
width = 0.55
[wheels]
layout = "mecanum"
half_wheelbase = 0.28
half_track = 0.22
radius = 0.0762
[drive]
"""
MOTOR = "gear_ratio = 27.0\ntorque_constant = 0.03\nresistance = 0.9\n"
ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 23.0, "y": 4.0}}


@pytest.fixture(scope="module")
def level() -> Terrain:
    """26 m by 8 m of level ground."""
    return Terrain.from_arrays(np.zeros((16, 52)), cell=(0.5, 0.5))


def test_a_vehicle_without_a_motor_is_not_planned_with_another_robots(
    tmp_path: Path, level: Terrain
) -> None:
    cart = tmp_path / "cart.toml"
    cart.write_text(CART, encoding="utf-8")
    with pytest.raises(VehicleError, match=r"gear_ratio, .*torque_constant and .*resistance are"):
        plan_route(terrain=level, vehicle=str(cart), **ASKED)
    cart.write_text(CART + MOTOR, encoding="utf-8")
    route = plan_route(terrain=level, vehicle=str(cart), **ASKED).routes[0]
    # 20 m at 12 kg with a drag of a few per cent of the weight is some hundred J, not 76 kJ.
    assert 200.0 < route.energy_j < 2000.0


def test_notes_give_the_values_of_defaults(tmp_path: Path, level: Terrain) -> None:
    cart = tmp_path / "cart.toml"
    cart.write_text(CART + MOTOR, encoding="utf-8")
    answer = plan_route(terrain=level, vehicle=str(cart), **ASKED)
    (note,) = [note for note in answer.notes if note.startswith("defaults taken: ")]
    assert note in answer.to_json()["notes"]
    for words in ("limits.speed = 1 m/s", "contact.traction = 0.6", "battery.capacity = no limit"):
        assert words in note
    assert "drive.gear_ratio" not in note


POINTS = [
    {"properties": {"id": k}, "geometry": {"type": "Point", "coordinates": [3.0 + k, 4.0]}}
    for k in range(2)
]
EDGE = {"properties": {"id": 2, "startid": 0, "endid": 1}, "geometry": {"type": "LineString"}}


@pytest.mark.parametrize(
    "question",
    [
        lambda **robot: plan_route(**ASKED, **robot),
        lambda **robot: energy_time_front(**ASKED, points=2, **robot),
        lambda **robot: energy_matrix(starts=[(3, 4), (4, 4)], **robot),
        lambda **robot: reachable_area(start=(3, 4), energy_j=20, **robot),
        lambda **robot: energy_graph(graph={"features": [*POINTS, EDGE]}, **robot),
    ],
    ids=["route", "front", "matrix", "reach", "graph"],
)
def test_every_answer_says_what_it_assumed(
    tmp_path: Path, level: Terrain, question: Callable[..., Any]
) -> None:
    """A voltage that only the motor's data sheet states stands in a sentence of its own."""
    cart = tmp_path / "cart.toml"
    cart.write_text(CART + 'motor = "pololu-37d-12v"\ngear_ratio = 30\n', "utf-8")
    answer = question(map=level, vehicle=str(cart), conditions={"ambient_temp": 10})
    (note,) = [note for note in answer.notes if "no battery.voltage" in note]
    assert "12 V assumed" in note
    assert "pololu-37d-12v" in note
    assert any("limits.speed = 1 m/s" in note for note in answer.notes)
    assert any("conditions.ambient_temp changes nothing" in note for note in answer.notes)
    document = answer.to_json()
    assert document.get("joulepath", document)["notes"] == list(answer.notes)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass = 12.0", "mass = 12000", "body.mass: 12000 kg on"),
        ("gear_ratio = 27.0", "gear_ratio = 0.037", "heat the windings"),
    ],
)
def test_an_answer_says_what_is_odd_in_the_vehicle(
    tmp_path: Path, level: Terrain, old: str, new: str, said: str
) -> None:
    """Grams for kilograms, or a gear ratio the other way round: megajoules without a word."""
    cart = tmp_path / "cart.toml"
    right = CART + MOTOR
    assert old in right
    cart.write_text(right, "utf-8")
    answers = [plan_route(terrain=level, vehicle=str(cart), **ASKED)]
    cart.write_text(right.replace(old, new), "utf-8")
    answers.append(plan_route(terrain=level, vehicle=str(cart), **ASKED))
    odd = [[note for note in answer.notes if note.startswith("odd in")] for answer in answers]
    assert not odd[0]
    assert any(said in note for note in odd[1])
    assert answers[1].routes[0].energy_j > 100.0 * answers[0].routes[0].energy_j


def test_limits_far_beyond_the_drive_change_no_route(tmp_path: Path, level: Terrain) -> None:
    """Degrees in place of radians, or a motor that is weaker than was thought."""
    cart = tmp_path / "cart.toml"
    weak = CART + MOTOR + "[battery]\nvoltage = 9.0\n"
    cart.write_text(weak, "utf-8")
    usual = plan_route(terrain=level, vehicle=str(cart), **ASKED).routes[0].energy_j
    cart.write_text(f"{weak}[limits]\nspeed = 50.0\nyaw_rate = 90.0\n", "utf-8")
    answer = plan_route(terrain=level, vehicle=str(cart), **ASKED)
    assert answer.routes[0].energy_j == pytest.approx(usual, rel=0.02)
    said = [note for note in answer.notes if "far beyond the drive" in note]
    assert ["limits.speed" in said[0], "limits.yaw_rate" in said[1]] == [True, True]
    shares = {use.limit: use.share for use in answer.routes[0].limits}
    fastest = max(pose.speed for pose in answer.routes[0].poses)
    assert shares["speed"] == pytest.approx(fastest / 50.0, rel=0.01)


def test_the_path_of_a_request_is_planned(tmp_path: Path, level: Terrain) -> None:
    path = tmp_path / "request.json"
    path.write_text(json.dumps({**ASKED, "map": "not-read"}), encoding="utf-8")
    from_file = plan_route(str(path), terrain=level)
    assert from_file.routes[0].energy_j == plan_route(terrain=level, **ASKED).routes[0].energy_j
    with pytest.raises(RequestError, match=r"none\.json: cannot be read"):
        plan_route(tmp_path / "none.json")


def test_a_robot_that_is_too_heavy_is_not_told_of_slopes(level: Terrain) -> None:
    answer = plan_route(terrain=level, **ASKED, payload={"mass": 500.0})
    assert answer.status == "no_route"
    assert answer.reason is not None
    assert "512 kg with its payload, cannot drive even on level ground" in answer.reason
    assert "slope" not in answer.reason
    weak = replace(load_vehicle("minibalance"), gear_ratio=0.2)
    answer = plan_route(terrain=level, **ASKED, vehicle=weak)
    assert answer.reason is not None
    assert "12 kg, cannot drive even on level ground" in answer.reason


def test_a_yaw_in_degrees_is_met_with_a_hint(level: Terrain) -> None:
    asked = {**ASKED, "start": {**ASKED["start"], "yaw": 90.0}}
    notes = plan_route(terrain=level, **asked, iterations=1).notes
    assert [note for note in notes if "start.yaw" in note and "90° are 1.571 rad" in note]
    asked["start"]["yaw"] = 1.571
    assert not any("yaw" in note for note in plan_route(terrain=level, **asked, iterations=1).notes)


ENDS = {"start": [13.0, 5.0], "goal": [1.0, 5.0]}


def test_a_dearer_baseline_has_a_positive_share_also_where_energy_comes_back():
    y, x = np.mgrid[0:40, 0:60] * 0.25
    bump = 0.5 * np.exp(-((x - 7.0) ** 2 + (y - 5.0) ** 2) / 3.0)
    slope = Terrain.from_arrays(np.tan(np.radians(10.0)) * x + bump, cell=(0.25, 0.25))
    # Without an effect that limits it, all energy of braking comes back.
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=())
    answer = plan_route(terrain=slope, model=model, **ENDS)
    best = answer.routes[0].energy_j
    assert best < 0.0
    assert any("no regeneration_limit" in note for note in answer.notes)
    level = plan_route(terrain=Terrain.from_arrays(0.0 * x, cell=(0.25, 0.25)), model=model, **ENDS)
    assert not any("regeneration_limit" in note for note in level.notes)
    dearer = {name: one for name, one in answer.baselines.items() if one.energy_j > best + 0.1}
    assert dearer
    for one in dearer.values():
        assert one.extra_share == pytest.approx((one.energy_j - best) / -best)


def test_a_load_beside_the_wheels_is_refused_as_a_load(level: Terrain) -> None:
    asked = {"terrain": level, **ASKED, "payload": {"mass": 8.0, "x": 2.0}}
    with pytest.raises(RequestError, match=r"payload: .* cannot stand even on level ground"):
        plan_route(**asked)


def test_the_place_of_a_load_is_never_ignored_in_silence(tmp_path: Path, level: Terrain) -> None:
    """Without com_offset it changes no watts, but a robot may tip over all the same."""
    cart = tmp_path / "cart.toml"
    cart.write_text(CART + MOTOR, encoding="utf-8")
    asked = {"terrain": level, "vehicle": str(cart), **ASKED}
    said = "payload.x and payload.y change nothing"
    for place, notes in ({}, 0), ({"x": 0.05}, 1):
        answer = plan_route(**asked, payload={"mass": 8.0, **place})
        assert sum(said in note for note in answer.notes) == notes
    with pytest.raises(RequestError, match=r"payload: .* cannot stand even on level ground"):
        plan_route(**asked, payload={"mass": 8.0, "x": 2.0})


def test_a_route_beyond_the_log_of_its_model_says_so(level: Terrain) -> None:
    quiet = EnergyError((1.0,), (0.1,), 0.1, 0.0, 0.0, 1.0, 8.0, 8)
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))

    def said(covered: Covered | None, payload_kg: float = 0.0) -> str:
        known = replace(model, energy_error=replace(quiet, covered=covered))
        answer = plan_route(map=level, model=known, payload={"mass": payload_kg}, **ASKED)
        assert max(answer.routes[0].arrays["speed"]) > 1.1
        return " ".join(note for note in answer.notes if "beyond the log" in note)

    assert said(None) == said(Covered(1.2, 0.0, 0.0)) == ""
    assert said(Covered(1.2, 0.0, 4.0), payload_kg=4.1) == ""
    slow = said(Covered(0.8, 0.0, 4.0), payload_kg=9.0)
    assert "faster than 0.8 m/s for " in slow
    assert "a payload above 4 kg; the energy interval does not cover that" in slow
    assert "steeper" not in slow


def test_slopes_beyond_the_log_of_the_model_are_said() -> None:
    known = replace(
        PowerModel.from_vehicle(load_vehicle("minibalance")),
        energy_error=EnergyError(
            (1.0,), (0.1,), 0.1, 0.0, 0.0, 1.0, 8.0, 8, Covered(1.2, math.radians(2.0), 0.0)
        ),
    )
    # Uphill at 30° on a plane of 5°, and along its contour.
    up = plan_route(map="tilted-plane", model=known, start=(6, 6), goal=(14.66, 11))
    assert any("steeper than 2° for 100 % of the time" in note for note in up.notes)
    along = plan_route(map="tilted-plane", model=known, start=(12, 6), goal=(7, 14.66))
    assert not any("steeper" in note for note in along.notes)


def test_a_budget_that_ends_before_the_first_search_is_said(level: Terrain) -> None:
    said = "the time budget ended before the search that needs none was done"
    for given, there in (({"time_budget_s": 1e-4}, True), ({}, False), ({"iterations": 1}, False)):
        answer = plan_route(map=level, **ASKED, **given)
        assert answer.status == "ok"
        assert any(said in note for note in answer.notes) is there
