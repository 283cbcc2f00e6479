"""How the virtual robot moves, against physics: balances, limits, symmetries, published figures.

Figures marked "physics page" are those of docs/physics.md, "Numbers that the model is tested
against", which come from a separate implementation.
"""

import ast
import math
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.telemetry.virtual import VirtualRobot
from planner.telemetry.virtual.dynamics import BOOK, MEANS
from planner.telemetry.virtual.motors import HOUSING_TO_AIR, WINDING_TO_HOUSING
from planner.telemetry.virtual.profiles import attitude, steady

SLOPE_5, SLOPE_10 = math.radians(5.0), math.radians(10.0)
DIAGONAL = math.sqrt(0.5)
AIR = {"air_drag": {"drag_area": 0.18}}


def settled(robot, **motion):
    """Mean power in W over the last seconds of each run of a constant motion."""
    means, _ = robot.simulate(steady(duration=8.0, **motion))
    return means[:, -40:, MEANS.index("power")].mean(axis=1)


# Physics page: bus W at 0.2, 0.5 and 0.8 m/s.
TABLE = {
    "forward": ((1, 0), {}, (10.0, 13.9, 18.1)),
    "diagonal": ((DIAGONAL, DIAGONAL), {}, (11.2, 16.1, 21.3)),
    "sideways": ((0, 1), {}, (13.6, 20.4, 27.4)),
    "+5 forward": ((1, 0), {"pitch": -SLOPE_5}, (15.2, 23.0, 31.0)),
    "+5 sideways": ((0, 1), {"roll": SLOPE_5}, (20.1, 30.8, 41.6)),
    "+10 forward": ((1, 0), {"pitch": -SLOPE_10}, (22.1, 33.8, 45.7)),
    "+10 sideways": ((0, 1), {"roll": SLOPE_10}, (28.3, 42.8, 57.5)),
    "-5 forward": ((1, 0), {"pitch": SLOPE_5}, (7.4, 8.3, 9.4)),
    "-10 forward": ((1, 0), {"pitch": SLOPE_10}, (6.0, 4.6, 3.4)),
}


@pytest.mark.parametrize("case", TABLE)
def test_steady_power_meets_the_physics_page(case):
    (x, y), slope, expected = TABLE[case]
    robot = VirtualRobot("minibalance", effects="active", hidden=AIR)
    speeds = np.array([0.2, 0.5, 0.8])
    # 2 %, or the last digit of the table.
    np.testing.assert_allclose(
        settled(robot, vx=x * speeds, vy=y * speeds, **slope), expected, rtol=0.02, atol=0.05
    )


def test_contours_and_turns_meet_the_physics_page():
    robot = VirtualRobot("minibalance", effects="active", hidden=AIR)
    assert settled(robot, vx=0.5, roll=SLOPE_10)[0] == pytest.approx(19.2, rel=0.02)
    assert settled(robot, vy=0.5, pitch=SLOPE_10)[0] == pytest.approx(25.0, rel=0.02)
    assert settled(robot, wz=1.0)[0] == pytest.approx(15.7, rel=0.02)


@pytest.mark.parametrize(
    ("limit", "x", "y"), [(1.66, 1.0, 0.0), (1.60, 0.0, 1.0), (1.13, DIAGONAL, DIAGONAL)]
)
def test_voltage_limits_the_speed(limit, x, y):
    # Physics page, Limits: 22.8 V are 1.66 m/s forward, 1.60 sideways, 1.13 diagonally.
    robot = VirtualRobot("minibalance", effects="active")
    means, _ = robot.simulate(steady(vx=3.0 * x, vy=3.0 * y, duration=20.0))
    reached = np.hypot(means[0, -20:, 0], means[0, -20:, 1]).mean()
    assert reached == pytest.approx(limit, rel=0.015)


@pytest.mark.parametrize("vehicle", ["minibalance", "robotino"])
def test_energy_balances(vehicle):
    hidden = {
        slug: {}
        for slug in ("motor_heating", "stiction", "wheel_slip", "air_drag", "regeneration_limit")
    }
    hidden |= {"com_offset": {"gain": 1.5}, "battery_sag": {"internal_resistance": 0.3}}
    hidden |= {"wheel_imbalance": {}, "cold_grease": {}, "driver_loss": {}, "yaw_scrub": {}}
    for case in ({}, {slug: v for slug, v in hidden.items() if slug != "wheel_slip"}, hidden):
        robot = VirtualRobot(vehicle, hidden=case, seed=2)
        _, book = robot.simulate(robot.profile("rich", runs=3, rows=60))
        energy = dict(zip(BOOK, book.T, strict=True))
        spent = sum(energy[place] for place in BOOK[1:14])
        # A wheel that slips has a rotor whose change of slip is not booked: 1e-4 there.
        np.testing.assert_allclose(
            spent, energy["supply"], rtol=1e-4 if "wheel_slip" in case else 1e-9
        )
        heat = energy["copper"] + energy["friction"]
        np.testing.assert_allclose(energy["stored"] + energy["given_off"], heat, rtol=1e-9)
        for place in ("rolling", "rollers", "mesh", "friction", "copper"):
            assert (energy[place] > 0.0).all()


def test_height_and_speed_are_paid_for():
    robot = VirtualRobot("minibalance")
    _, book = robot.simulate(
        steady(vx=0.5, pitch=-SLOPE_5, duration=10.0, settings={"payload": 3.0})
    )
    # 15 kg, 5 m of path at 5 degrees.
    expected = 15.0 * 9.80665 * 5.0 * math.sin(SLOPE_5)
    assert book[0, BOOK.index("gravity")] == pytest.approx(expected, rel=1e-9)
    drive = steady(vx=0.0, duration=10.0)
    drive.motion[0, :, 0] = np.linspace(0.0, 0.8, drive.motion.shape[1])
    _, book = robot.simulate(drive)
    # Physics page: 12 kg move like 15.2 kg forward (four wheels and geared rotors turn with it).
    rotating = 4.0 * (0.0023 + 26.85**2 * 3.2e-6) / 0.076**2
    assert 12.0 + rotating == pytest.approx(15.2, abs=0.05)
    expected = 0.5 * (12.0 + rotating) * 0.8**2
    assert book[0, BOOK.index("kinetic")] == pytest.approx(expected, rel=0.002)


def test_climbing_forward_is_a_negative_pitch():
    robot = VirtualRobot("minibalance")
    up, level, down = settled(robot, vx=0.4, pitch=[-0.1, 0.0, 0.1])
    assert up > level > down
    # Left side higher is roll > 0: driving left then climbs.
    up, level, down = settled(robot, vy=0.4, roll=[0.1, 0.0, -0.1])
    assert up > level > down
    # A plane that rises along world x by 0.2: faced, with the hill to the right, and at 45 degrees.
    p, q = np.full(3, 0.2), np.zeros(3)
    roll, pitch = attitude(p, q, np.array([0.0, math.pi / 2, math.pi / 4]))
    np.testing.assert_allclose(pitch[:2], [-math.atan(0.2), 0.0], atol=1e-12)
    np.testing.assert_allclose(roll[:2], [0.0, -math.atan(0.2)], atol=1e-12)
    # The vertical part of the normal does not depend on how the robot is turned.
    np.testing.assert_allclose(np.cos(roll) * np.cos(pitch), 1.0 / math.hypot(1.0, 0.2))


def test_omni_robot_looks_alike_from_its_three_sides():
    robot = VirtualRobot("robotino")
    headings = np.radians([20.0, 140.0, 260.0])
    watts = settled(robot, vx=0.3 * np.cos(headings), vy=0.3 * np.sin(headings))
    np.testing.assert_allclose(watts, watts[0], rtol=1e-6)
    uneven = VirtualRobot("robotino", hidden={"wheel_imbalance": {"excess": [0.5, -0.2, -0.3]}})
    watts = settled(uneven, vx=0.3 * np.cos(headings), vy=0.3 * np.sin(headings))
    assert np.ptp(watts) > 0.02 * watts.mean()


def test_motors_warm_as_two_nodes_do():
    # The source has its magnets at the housing's temperature, a warm motor's rise times 0.73.
    robot = VirtualRobot("minibalance", hidden={"motor_heating": {"magnet_share": 0.73}})
    means, book = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=1800.0, row=1.0))
    winding = means[0, :, MEANS.index("motor_temp")]
    # Source of the physics page: 12 kg on +10 degrees, 32, 41 and 66 degrees after 1, 5, 30 min.
    assert winding[[599, 2999, 17999]] == pytest.approx([32.0, 41.0, 66.0], abs=1.5)
    # Once warm, all heat crosses both resistances.
    end = 9000.0
    means, book = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=end, row=1.0))
    _, earlier = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=end - 100.0, row=1.0))
    copper, friction = (
        float(book[0, k] - earlier[0, k]) / 100.0 / 4.0
        for k in (BOOK.index("copper"), BOOK.index("friction"))
    )
    rise = copper * WINDING_TO_HOUSING + (copper + friction) * HOUSING_TO_AIR
    assert means[0, -1, MEANS.index("motor_temp")] - 25.0 == pytest.approx(rise, rel=0.01)


def test_no_formula_is_shared_with_the_power_model():
    allowed = {"planner.power.vehicles"}
    # Names and sizes of effects, and the truth of those that the robot has no equation for.
    others = {
        "hidden.py": {"planner.power.catalogue", "planner.power.effect"},
        "by_formula.py": {"planner.power.model", "planner.power.rows", "planner.power.catalogue"},
    }
    paths = sorted((Path(planner.__file__).parent / "telemetry" / "virtual").glob("*.py"))
    assert len(paths) >= 9
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                if name.startswith("planner.power"):
                    assert name in allowed | others.get(path.name, set()), (path.name, name)
