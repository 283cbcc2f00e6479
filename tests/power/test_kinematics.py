"""Wheel layouts: what motion does to wheels and rollers, and what their forces do to the body."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.kinematics import (
    AXIS_LEVER,
    DRAG,
    FORCE,
    LOAD,
    NULL,
    RIM,
    ROLLER,
    WheelLayout,
    X,
    Y,
    mecanum,
    omni,
)
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.states import Array, random_columns

A, B, R = 0.214, 0.247, 0.076


@pytest.fixture(scope="module")
def four() -> WheelLayout:
    """The source paper's robot."""
    return mecanum(half_wheelbase=A, half_track=B, radius=R)


def ring(count: int, *, first: float = 0.3, roller_angle: float = np.pi / 2) -> WheelLayout:
    """Omni wheels evenly on a circle."""
    angles = tuple(first + 2.0 * np.pi * k / count for k in range(count))
    return omni(base_radius=0.2, angles=angles, radius=0.05, roller_angle=roller_angle)


LAYOUTS = [
    mecanum(half_wheelbase=A, half_track=B, radius=R),
    mecanum(half_wheelbase=0.3, half_track=0.2, radius=0.1, roller_angle=np.radians(60)),
    ring(3),
    ring(4),
    ring(5),
    ring(3, roller_angle=np.radians(70)),
    omni(base_radius=0.15, angles=(0.0, 1.5, 3.5), radius=0.04),
]
each_layout = pytest.mark.parametrize("layout", LAYOUTS)


def test_mecanum_wheel_speeds_by_hand(four: WheelLayout) -> None:
    # r·ω = vx ∓ vy ∓ (a + b)·wz for front left, front right, rear left, rear right.
    vx, vy, wz = 0.4, 0.1, 0.5
    turn = (A + B) * wz
    expected = np.array([vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn]) / R
    assert four.wheel_speeds(vx, vy, wz) == pytest.approx(expected, rel=1e-12)


def test_contact_rollers_form_an_o(four: WheelLayout) -> None:
    # With the rollers the other way round the lever would be a - b: 3 cm instead of 46.
    lever = np.abs(four.table[:, RIM + 2])
    assert lever == pytest.approx(np.full(4, A + B), rel=1e-12)
    assert abs(A - B) < 0.1 * (A + B)


@pytest.mark.parametrize(
    ("motion", "expected"),
    [
        ((0.5, 0.0, 0.0), [0.0, 0.0, 0.0, 0.0]),
        ((0.0, 0.5, 0.0), [0.5 * np.sqrt(2.0)] * 4),
        ((0.5 / np.sqrt(2.0), 0.5 / np.sqrt(2.0), 0.0), [0.5] * 4),
        ((0.0, 0.0, 2.0), np.sqrt(2.0) * A * 2.0 * np.array([1, 1, -1, -1])),
    ],
)
def test_roller_speeds_are_the_heading_law(
    four: WheelLayout, motion: tuple[float, float, float], expected: Array
) -> None:
    # Forward nothing, sideways √2·v, diagonally v, on the spot √2·a·ω.
    assert four.table[:, ROLLER : ROLLER + 3] @ motion == pytest.approx(expected, abs=1e-12)


def body_velocity(layout: WheelLayout, wheel_speeds: Array) -> Array:
    """Least-squares (vx, vy, wz) of wheel speeds in rad/s."""
    rim = layout.table[:, RIM : RIM + 3]
    return np.linalg.lstsq(rim, layout.radius * wheel_speeds, rcond=None)[0]


@each_layout
def test_wheel_speeds_and_back(layout: WheelLayout) -> None:
    random = np.random.default_rng(9)
    for _ in range(20):
        motion = random.uniform(-1.0, 1.0, 3)
        assert body_velocity(layout, layout.wheel_speeds(*motion)) == pytest.approx(motion)


def test_forward_kinematics_is_least_squares(four: WheelLayout) -> None:
    # Speeds that do not fit together: vx = r/4·Σω, vy = r/4·Σs·ω, wz = r/(4·(a + b))·Σk·ω.
    speeds = np.array([10.0, 11.0, 9.0, 12.0])
    expected = [
        R / 4.0 * speeds.sum(),
        R / 4.0 * (np.array([-1, 1, 1, -1]) * speeds).sum(),
        R / (4.0 * (A + B)) * (np.array([-1, 1, -1, 1]) * speeds).sum(),
    ]
    assert body_velocity(four, speeds) == pytest.approx(expected, rel=1e-12)


@each_layout
def test_axle_forces_give_the_required_resultant(layout: WheelLayout) -> None:
    table = layout.table
    random = np.random.default_rng(10)
    # Roller drag pushes along p, and the axle is perpendicular to it: a = (p_y, -p_x).
    axle = np.stack([table[:, DRAG + 1], -table[:, DRAG]])
    moment = table[:, X] * axle[1] - table[:, Y] * axle[0]
    for _ in range(20):
        wanted = random.uniform(-10.0, 10.0, 3)
        forces = table[:, FORCE : FORCE + 3] @ wanted
        assert axle @ forces == pytest.approx(wanted[:2], abs=1e-9)
        assert moment @ forces == pytest.approx(wanted[2], abs=1e-9)
        # Least squares: nothing of the null mode is in it.
        assert forces @ table[:, NULL] == pytest.approx(0.0, abs=1e-9)


@each_layout
def test_power_of_the_contact_is_power_of_the_hub_and_of_the_roller(layout: WheelLayout) -> None:
    # A force on the contact does work on the ground point under the hub: F·c = f·(c·a) + g·(c·p),
    # split into the hub's share (F·e)·rω and the roller's g·u. True for any roller angle.
    table = layout.table
    random = np.random.default_rng(11)
    motion = random.uniform(-1.0, 1.0, 3)
    along, across = random.uniform(-5.0, 5.0, (2, layout.wheel_count))
    free = np.stack([table[:, DRAG], table[:, DRAG + 1]], axis=1)
    axle = np.stack([free[:, 1], -free[:, 0]], axis=1)
    force = along[:, None] * axle + across[:, None] * free
    ground = np.stack(
        [motion[0] - motion[2] * table[:, Y], motion[1] + motion[2] * table[:, X]], axis=1
    )
    rim = table[:, RIM : RIM + 3] @ motion
    roller = table[:, ROLLER : ROLLER + 3] @ motion
    hub = along * table[:, AXIS_LEVER] + across * table[:, AXIS_LEVER + 1]
    assert (force * ground).sum(axis=1) == pytest.approx(hub * rim + across * roller, abs=1e-9)


def test_null_mode_of_four_mecanum_wheels(four: WheelLayout) -> None:
    # Front against rear, one newton at each rim.
    rims = four.table[:, NULL] * four.table[:, AXIS_LEVER]
    assert rims == pytest.approx([1.0, 1.0, -1.0, -1.0], abs=1e-9)


@pytest.mark.parametrize("count", [3, 5])
def test_only_four_wheels_have_a_null_mode_here(count: int) -> None:
    assert np.all(ring(count).table[:, NULL] == 0.0)


@each_layout
def test_loads_carry_weight_and_moments(layout: WheelLayout) -> None:
    table = layout.table
    loads = table[:, LOAD : LOAD + 3] @ [1.0, 0.02, -0.03]
    assert loads.sum() == pytest.approx(1.0, rel=1e-12)
    # Their resultant stands under the point of pressure, for wheels centred on the middle or not.
    assert loads @ table[:, X] == pytest.approx(0.02, abs=1e-9)
    assert loads @ table[:, Y] == pytest.approx(-0.03, abs=1e-9)


def omni_model(vehicle: str = "robotino") -> PowerModel:
    return PowerModel.from_vehicle(load_vehicle(vehicle))


def test_symmetric_omni_robot_turned_by_120_degrees() -> None:
    model = omni_model()
    columns = random_columns(200, seed=12)
    cos, sin = np.cos(2.0 * np.pi / 3.0), np.sin(2.0 * np.pi / 3.0)
    turned = dict(columns)
    for x, y in (("vx", "vy"), ("ax", "ay"), ("gravity_x", "gravity_y"), ("com_x", "com_y")):
        turned[x] = cos * columns[x] - sin * columns[y]
        turned[y] = sin * columns[x] + cos * columns[y]
    assert model.watts(rows_from(**turned)) == pytest.approx(
        model.watts(rows_from(**columns)), rel=1e-9
    )
    # By 60° it is another robot.
    cos, sin = 0.5, np.sqrt(0.75)
    other = dict(columns)
    other["vx"] = cos * columns["vx"] - sin * columns["vy"]
    other["vy"] = sin * columns["vx"] + cos * columns["vy"]
    assert not np.allclose(model.watts(rows_from(**other)), model.watts(rows_from(**columns)))


def test_omni_wheel_speeds_by_hand() -> None:
    # Wheels at 60°, 180°, 300°: rim = -sin·vx + cos·vy + base radius·wz.
    layout = load_vehicle("robotino").layout
    angles = np.radians([60.0, 180.0, 300.0])
    vx, vy, wz = 0.3, -0.2, 0.7
    expected = (-np.sin(angles) * vx + np.cos(angles) * vy + 0.125 * wz) / 0.040
    assert layout.wheel_speeds(vx, vy, wz) == pytest.approx(expected, rel=1e-9)
    # The rollers roll along the spokes: cos·vx + sin·vy.
    expected = np.cos(angles) * vx + np.sin(angles) * vy
    assert np.abs(layout.table[:, ROLLER : ROLLER + 3] @ [vx, vy, wz]) == pytest.approx(
        np.abs(expected), rel=1e-9
    )


def test_too_few_wheels() -> None:
    with pytest.raises(ValueError, match="at least three"):
        omni(base_radius=0.1, angles=(0.0, 2.0), radius=0.05)


def test_stretched_wheels_are_wheels_at_other_places() -> None:
    four = mecanum(half_wheelbase=0.2, half_track=0.15, radius=0.05)
    longer = mecanum(half_wheelbase=0.24, half_track=0.12, radius=0.05)
    assert four.stretched(1.2, 0.8).table == pytest.approx(longer.table, abs=1e-12)
    angles = (0.3, 2.4, 4.5)
    three = omni(base_radius=0.2, angles=angles, radius=0.04)
    wider = omni(base_radius=0.25, angles=angles, radius=0.04)
    assert three.stretched(1.25, 1.25).table == pytest.approx(wider.table, abs=1e-12)
    assert four.stretched(1.0, 1.0).table == pytest.approx(four.table, abs=1e-12)
