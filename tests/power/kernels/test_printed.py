"""The source paper's power as printed: its numbers, and the faults that it is kept to show."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.kernels.printed import printed_direction, printed_forces, printed_watts
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.states import Array, plane_gravity, random_columns

KINDS = ("printed/A", "printed/B")


def printed(kind: str) -> PowerModel:
    return PowerModel.from_vehicle(load_vehicle("minibalance"), kind=kind)


def heading(degrees: float) -> Array:
    angle = np.radians(degrees)
    return rows_from(vx=0.5 * np.cos(angle), vy=0.5 * np.sin(angle))


@pytest.mark.parametrize(
    ("kind", "forward", "diagonal", "sideways"),
    # docs/physics.md: on the flat at 0.5 m/s, against 6.6, 8.8 and 13.0 W of the sound model.
    [("printed/A", 7.93, 6.13, 3.23), ("printed/B", 3.23, 6.13, 7.93)],
)
def test_motor_watts_on_the_flat(
    kind: str, forward: float, diagonal: float, sideways: float
) -> None:
    model = printed(kind)
    for degrees, watts in ((0, forward), (45, diagonal), (90, sideways)):
        assert model.account(heading(degrees))["terminal"][0] == pytest.approx(watts, abs=0.006)


def test_parts_by_hand() -> None:
    # F = 0.035·12 kg·g = 4.119 N at 0.5 m/s; N = 117.7 N.
    force, load = 0.035 * 12.0 * 9.80665, 12.0 * 9.80665
    copper, mechanical, friction = printed_watts(
        force, 0.5, 1.0, 1.0, load * 0.5, load, 0.035, 0.045
    )
    assert copper == pytest.approx(0.0022 * force**2)
    assert mechanical == pytest.approx(0.0022 * force**2 + 1.53 * 0.5 * force)
    assert friction == pytest.approx((0.035 + 0.045) * load * 0.5)


def test_readings_turn_the_angle() -> None:
    assert printed_direction(0.3, 0.4, False) == pytest.approx((0.6, 0.8))
    assert printed_direction(0.3, 0.4, True) == pytest.approx((0.8, 0.6))
    assert printed_direction(0.0, 0.0, False) == (1.0, 0.0)


def test_gravity_in_reading_a_acts_sideways_only() -> None:
    # Straight up a slope of 10° reading A sees no weight at all; reading B sees m·g·sin γ.
    slope = plane_gravity(np.radians(10.0), 0.0)
    along, normal = slope["gravity_x"], slope["gravity_normal"]
    weight = 12.0 * 9.80665 * np.sin(np.radians(10.0))
    for reading_b, expected in ((False, 0.0), (True, weight)):
        _, sine = printed_direction(0.5, 0.0, reading_b)
        climbing, _ = printed_forces(12.0, along, 0.0, normal, 0.5, 0.0, sine, 0.035)
        assert climbing == pytest.approx(expected, abs=1e-12)


def test_friction_that_gives_power_back() -> None:
    # Reading A driving backward: the printed cosine turns friction into a source.
    model = printed("printed/A")
    shares = model.watts_by_effect(heading(180.0))
    assert shares["roller_drag"][0] == pytest.approx(-4.71, abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_shares_add_up(kind: str) -> None:
    rows = rows_from(**random_columns(200, seed=13))
    model = printed(kind)
    total = sum(model.watts_by_effect(rows).values())
    assert total == pytest.approx(model.watts(rows), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_limits_are_those_of_the_sound_model(kind: str) -> None:
    rows = rows_from(**random_columns(50, seed=14))
    sound = PowerModel.from_vehicle(load_vehicle("minibalance")).account(rows)
    account = printed(kind).account(rows)
    for name in ("least_load", "current", "voltage", "motor_torque", "traction_left"):
        assert account[name] == pytest.approx(sound[name], rel=1e-12)
    assert account["electronics"] == pytest.approx(sound["electronics"], rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives(kind: str) -> None:
    rows = rows_from(**random_columns(50, seed=15))
    model = printed(kind)
    slopes = model.jacobian(rows)
    place = next(k for k, slot in enumerate(model.slots) if slot[1] == "rolling")
    step = 1e-6
    value = model.parameters[place]
    up, down = (model.with_parameter(place, value + s).watts(rows) for s in (step, -step))
    assert slopes[:, place] == pytest.approx((up - down) / (2.0 * step), rel=1e-6, abs=1e-6)


def test_unknown_kind() -> None:
    with pytest.raises(ModelError, match=r"no such model.*printed/A"):
        printed("printed/C")
