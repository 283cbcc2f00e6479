"""The virtual robot against physics: balances, limits, symmetries and published figures.

Figures marked "physics page" are those of docs/physics.md, "Numbers that the model is tested
against", which come from a separate implementation.
"""

import ast
import csv
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from planner.errors import InputError
from planner.telemetry.virtual.dynamics import BOOK, MEANS
from planner.telemetry.virtual.hidden import EFFECTS, scaled
from planner.telemetry.virtual.motors import HOUSING_TO_AIR, WINDING_TO_HOUSING
from planner.telemetry.virtual.profiles import attitude
from planner.telemetry.virtual_robot import (
    QUIET,
    Noise,
    Sensors,
    VirtualRobot,
    footprint_gradient,
    planned_route,
    profile,
    steady,
)

SLOPE_5, SLOPE_10 = math.radians(5.0), math.radians(10.0)
DIAGONAL = math.sqrt(0.5)
AIR = {"air_drag": {"drag_area": 0.18}}


def settled(robot, **motion):
    """Mean power in W over the last seconds of each run of a constant motion."""
    means, _ = robot.simulate(steady(duration=8.0, **motion))
    return means[:, -40:, MEANS.index("power")].mean(axis=1)


def extra(slug, strength, **motion):
    """W that an effect adds in a constant motion."""
    hidden = VirtualRobot("minibalance", hidden={slug: strength})
    return float((settled(hidden, **motion) - settled(VirtualRobot("minibalance"), **motion))[0])


@pytest.fixture(scope="module")
def rich():
    """A small rich profile: four runs of 30 s."""
    return VirtualRobot("minibalance", seed=4).profile("rich", runs=4, rows=60)


@pytest.fixture(scope="module")
def plain(rich):
    return VirtualRobot("minibalance").simulate(rich)[0]


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
    end = 20000.0
    means, book = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=end, row=1.0))
    _, earlier = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=end - 100.0, row=1.0))
    copper, friction = (
        float(book[0, k] - earlier[0, k]) / 100.0 / 4.0
        for k in (BOOK.index("copper"), BOOK.index("friction"))
    )
    rise = copper * WINDING_TO_HOUSING + (copper + friction) * HOUSING_TO_AIR
    assert means[0, -1, MEANS.index("motor_temp")] - 25.0 == pytest.approx(rise, rel=1e-3)


# Physics page, "What effects are worth": W at 0.5 m/s, stated strength and motion.
FORWARD, UPHILL = {"vx": 0.5}, {"vx": 0.5, "pitch": -SLOPE_10}
WORTH = [
    ("viscous_drag", {"viscous_torque": 2.3e-6}, FORWARD, 0.36),
    ("current_ripple", {"ripple_squared": 0.25}, UPHILL, 2.0),
    ("wheel_preload", {"preload_squared": 25.0}, FORWARD, 5.1),
    ("surface_rolling", {"excess": {"hard": 0.08 / 0.035 - 1.0}}, FORWARD, 4.4),
    ("vibration", {"shaking_force": 0.5}, FORWARD, 0.4),
    ("yaw_scrub", {"scrub_moment": 3.5}, {"wz": 1.0}, 6.6),
    ("light_load_gear_drag", {"drag_torque": 0.02}, FORWARD, 0.45),
    ("sinkage", {"compaction": 0.05}, FORWARD, 5.0),
]


@pytest.mark.parametrize(("slug", "strength", "motion", "watts"), WORTH)
def test_effects_cost_what_the_physics_page_says(slug, strength, motion, watts):
    # Figures of one or two digits.
    assert extra(slug, strength, **motion) == pytest.approx(watts, rel=0.16)


def test_heat_costs_what_the_physics_page_says():
    # Windings at 85 degrees and magnets at 65: motors 26.4 W on +10 degrees need 13.6 % more.
    hot = {"copper_coefficient": 0.00393, "magnet_coefficient": -0.0020, "magnet_share": 2.0 / 3.0}
    added = extra("motor_heating", hot, **UPHILL, settings={"motor_temp": 85.0})
    assert added == pytest.approx(3.6, rel=0.05)
    assert extra("motor_heating", hot, **UPHILL, settings={"motor_temp": 25.0}) == 0.0


def test_slip_dissipates_force_times_creep():
    strength = {"wheel_slip": {"creep": 0.1}}
    robot = VirtualRobot("minibalance", hidden=strength)
    duration = 10.0
    _, book = robot.simulate(steady(vx=0.5, pitch=-SLOPE_10, duration=duration))
    # Each axle bears √2/4 of the weight along the slope; loads shift by h·tan(10°)/a either way.
    force = math.sqrt(2.0) / 4.0 * 12.0 * 9.80665 * math.sin(SLOPE_10)
    load = 3.0 * 9.80665 * math.cos(SLOPE_10)
    shift = 0.12 * math.tan(SLOPE_10) / 0.214
    watts = 2.0 * 0.1 * force**2 / load * 0.5 * (1.0 / (1.0 - shift) + 1.0 / (1.0 + shift))
    assert book[0, BOOK.index("slip")] / duration == pytest.approx(watts, rel=0.01)


# Motions in which an effect has nothing to act on.
STILL: dict[str, float] = {}
SILENT = [
    ("wheel_imbalance", STILL),
    ("viscous_drag", STILL),
    ("vibration", STILL),
    ("air_drag", STILL),
    ("surface_rolling", STILL),
    ("yaw_scrub", {"vx": 0.5}),
    ("yaw_speed", {"vx": 0.5}),
    ("slope_transition", UPHILL),
    ("com_offset", UPHILL),
    ("regeneration_limit", UPHILL),
    ("slope_threshold", {"vx": 0.5, "pitch": -0.04}),
    ("resonance", {"vx": 1.1}),
    ("wheel_slip", STILL),
    ("motor_heating", STILL),
]


@pytest.mark.parametrize(("slug", "motion"), SILENT)
def test_an_effect_acts_only_through_its_mechanism(slug, motion):
    assert extra(slug, {}, **motion) == pytest.approx(0.0, abs=1e-6)


# And motions in which it does: slug, motion, settings, W by hand at the bus.
SPEAKING = [
    ("sensor_rate", {"settings": {"sensor_rate": 40.0}}, 0.02 * 40.0),
    ("converter_efficiency", {}, 5.3 * (1.0 / 0.88 - 1.0)),
    ("yaw_speed", {"vx": 0.4, "wz": 0.5}, 5.0 * 0.4 * 0.5),
    ("slope_threshold", {"vx": 0.5, "pitch": -0.09}, 40.0 * (0.09 - 0.05)),
    ("heading_ripple", {"vy": 0.4}, math.cos(3.0 * math.pi / 2.0)),
    ("heading_ripple", {"vx": -0.4}, math.cos(3.0 * math.pi)),
    ("resonance", {"vx": 0.5}, 1.0),
    ("start_decay", {}, 2.0 * 25.0 / 4.0 * (math.exp(-4.0 / 25.0) - math.exp(-8.0 / 25.0))),
]


@pytest.mark.parametrize(("slug", "motion", "watts"), SPEAKING)
def test_effects_on_the_bus_by_hand(slug, motion, watts):
    assert extra(slug, {}, **motion) == pytest.approx(watts, abs=2e-3)


def test_braking_power_is_refused():
    downhill = {"vx": 0.8, "pitch": SLOPE_10}
    # Physics page: motors -4.1 W at 0.8 m/s on -10 degrees, all four alike (no viscous drag here,
    # no bridges: more comes back).
    motors = settled(VirtualRobot("minibalance"), **downhill)[0] - 5.3
    assert motors < -4.1
    kept = extra("regeneration_limit", {"motor_share": 0.25, "source_share": 1.0}, **downhill)
    assert kept == pytest.approx(-0.75 * motors, rel=1e-6)


def test_battery_sag_is_what_the_current_loses_inside():
    sag = VirtualRobot("minibalance", hidden={"battery_sag": {"internal_resistance": 0.4}})
    log = sag.drive(steady(vx=0.7, pitch=-SLOPE_10), noise=QUIET)
    voltage, current = log.columns["battery_voltage"][-1], log.columns["battery_current"][-1]
    power = log.columns["power"][-1]
    assert power == pytest.approx(voltage * current + 0.4 * current**2, rel=1e-6)
    # A full battery of 25.2 V that has given little away.
    assert voltage + 0.4 * current == pytest.approx(25.2, rel=1e-3)


@pytest.mark.parametrize("slug", EFFECTS)
def test_null_changes_no_bit_and_a_strength_changes_the_log(slug, rich, plain):
    robot = VirtualRobot("minibalance", hidden={slug: {"size": 0.02}})
    values = {name: value for name, value in robot.hidden[slug].items() if name != "size"}
    null, _ = robot.simulate(rich, {slug: scaled(values, slug, 0.0)})
    np.testing.assert_array_equal(null, plain)
    strong, _ = robot.simulate(rich, {slug: values})
    power = MEANS.index("power")
    change = strong[:, :, power] - plain[:, :, power]
    assert np.sqrt(np.mean(change**2)) > 5e-4 * plain[:, :, power].mean()


@pytest.mark.parametrize(
    "hidden",
    [
        {"load_dependent_rolling": {"size": 0.03}},
        {"resonance": {"size": 0.05}},
        {"wheel_preload": {"size": 0.04}},
    ],
)
def test_size_is_the_rms_share_of_mean_power(hidden, rich, plain):
    log = VirtualRobot("minibalance", hidden=hidden).drive(rich, noise=QUIET)
    power = plain[:, :, MEANS.index("power")].reshape(4, 60, 5).mean(axis=2).ravel()
    change = log.columns["power"] - power
    ((slug, values),) = hidden.items()
    reached = np.sqrt(np.mean(change**2)) / power.mean()
    assert reached == pytest.approx(values["size"], rel=0.011)
    assert log.truth["sizes"][slug] == pytest.approx(reached, rel=1e-6)


def test_rows_are_means_that_end_at_their_time():
    robot = VirtualRobot("minibalance")
    drive = steady(vx=0.0, duration=6.0)
    edges = np.arange(drive.motion.shape[1]) * 0.1
    drive.motion[0, :, 0] = 0.1 + 0.1 * edges
    log = robot.drive(drive, noise=QUIET)
    np.testing.assert_allclose(log.columns["time"], np.arange(1, 13) * 0.5)
    # The mean of a ramp is its value half an interval before the row's time.
    np.testing.assert_allclose(
        log.columns["vx"], 0.1 + 0.1 * (log.columns["time"] - 0.25), atol=1e-4
    )
    np.testing.assert_allclose(log.columns["ax"], 0.1, atol=1e-3)
    # Energy of the rows is that of the run.
    assert log.columns["power"].sum() * 0.5 == pytest.approx(
        log.truth["energy"]["run00"]["supply"], rel=1e-9
    )


def test_acceleration_holds_the_centripetal_part():
    log = VirtualRobot("minibalance").drive(steady(vx=0.5, wz=0.8), noise=QUIET)
    np.testing.assert_allclose(log.columns["ay"], 0.4, rtol=1e-6)
    np.testing.assert_allclose(log.columns["ax"], 0.0, atol=1e-9)


def test_same_seed_same_log(rich):
    robot = VirtualRobot("minibalance", seed=9)
    first, second = robot.drive(rich), robot.drive(rich)
    for name, values in first.columns.items():
        np.testing.assert_array_equal(values, second.columns[name])
    other = robot.drive(rich, seed=10)
    assert not np.array_equal(first.columns["power"], other.columns["power"])
    np.testing.assert_array_equal(first.truth["clean_power"], other.truth["clean_power"])


def test_noise_is_as_large_and_as_slow_as_stated():
    robot = VirtualRobot("minibalance")
    flat = steady(vx=[0.2] * 20, duration=150.0)
    quiet = robot.drive(flat, noise=QUIET).columns["power"]

    def scatter(**noise):
        return (robot.drive(flat, noise=Noise(**noise)).columns["power"] - quiet).reshape(20, 300)

    white = scatter(level=0.03, autocorrelated=0.0)
    assert white.std() == pytest.approx(0.03 * quiet.mean(), rel=0.03)
    mixed = scatter(level=0.03, autocorrelated=0.5, correlation=0.8)
    assert mixed.std() == pytest.approx(0.03 * quiet.mean(), rel=0.06)
    neighbours = np.mean(mixed[:, 1:] * mixed[:, :-1]) / np.mean(mixed**2)
    assert neighbours == pytest.approx(0.5 * 0.8, abs=0.04)
    wild = scatter(level=0.03, outliers=0.01)
    share = np.mean(np.abs(wild) > 5.5 * 0.03 * quiet.mean())
    assert share == pytest.approx(0.01, abs=0.003)


def test_sensors_err_as_told(rich):
    robot = VirtualRobot("minibalance")
    right = robot.drive(rich, noise=QUIET).columns

    def wrong(**faults):
        return robot.drive(rich, noise=QUIET, sensors=Sensors(**faults)).columns

    np.testing.assert_allclose(wrong(slope_offset=0.03)["pitch"] - right["pitch"], 0.03)
    np.testing.assert_allclose(wrong(speed_scale=1.05)["vy"], 1.05 * right["vy"])
    np.testing.assert_allclose(
        wrong(power_scale=1.1, power_offset=2.0)["power"], 1.1 * right["power"] + 2.0
    )
    turned = wrong(heading_misalignment=0.1)
    angle = np.arctan2(turned["vy"], turned["vx"]) - np.arctan2(right["vy"], right["vx"])
    moving = np.hypot(right["vx"], right["vy"]) > 0.05
    np.testing.assert_allclose(np.angle(np.exp(1j * (angle - 0.1)))[moving], 0.0, atol=1e-12)
    # A lag of one whole row moves power down by one row within each run.
    late = wrong(delay=0.5)["power"].reshape(4, 60)
    np.testing.assert_allclose(late[:, 1:], right["power"].reshape(4, 60)[:, :-1], rtol=1e-9)
    fewer = wrong(dropouts=0.2, absent=("wind_x", "surface"))
    assert len(fewer["time"]) == pytest.approx(0.8 * 240, abs=20)
    assert "wind_x" not in fewer
    assert "surface" not in fewer


def test_csv_and_parquet_hold_the_same(rich, tmp_path: Path):
    log = VirtualRobot("minibalance").drive(rich)
    log.write_csv(tmp_path / "log.csv")
    log.write_parquet(tmp_path / "log.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "log.parquet")
    with (tmp_path / "log.csv").open(encoding="utf-8") as file:
        names, *rows = list(csv.reader(file))
    assert names == table.column_names == list(log.columns)
    expected = "run,time,vx,vy,wz,power,roll,pitch,ax,ay,payload,com_x,com_y,motor_temp,"
    expected += "ambient_temp,battery_voltage,battery_current,surface,wind_x,wind_y,sensor_rate,"
    expected += "wheel_current_1,wheel_current_2,wheel_current_3,wheel_current_4"
    assert ",".join(names) == expected
    for column, name in enumerate(names):
        written = [row[column] for row in rows]
        if name not in ("run", "surface"):
            written = [float(value) for value in written]
        assert written == table[name].to_pylist() == log.columns[name].tolist()


def test_designs_tie_what_they_say(rich):
    vehicle = VirtualRobot("minibalance").vehicle
    full = profile("rich", vehicle, seed=1)
    assert full.motion.shape[0] == 24
    assert full.around.shape[1] == 300 * 5
    assert len(full.held_out) == 8
    tied = VirtualRobot("minibalance").drive(
        profile("speed_heats_motor", vehicle, runs=3), noise=QUIET
    )
    pace = np.hypot(tied.columns["vx"], tied.columns["vy"])
    assert np.corrcoef(pace, tied.columns["motor_temp"])[0, 1] > 0.999
    straight = profile("one_heading", vehicle, runs=3)
    assert (straight.motion[:, :, 1:3] == 0.0).all()
    assert (straight.motion[:, :, 0] >= 0.0).all()
    empty = profile("one_load", vehicle, runs=3)
    assert (empty.starts[:, :3] == 0.0).all()
    log = VirtualRobot("minibalance").drive(rich)
    train, held = log.split()
    assert set(held.columns["run"]) == {"run03"}
    assert len(train.columns["time"]) + len(held.columns["time"]) == 240


def route_of(points, speed):
    """Poses of a straight drive through (x, y, z, yaw), as a ROUTE.json has them."""
    poses, t = [], 0.0
    for k, (x, y, z, yaw) in enumerate(points):
        if k:
            t += math.dist((x, y, z), points[k - 1][:3]) / speed
        pose = {"x": x, "y": y, "z": z, "yaw": yaw, "t": t, "speed": speed, "energy_j": 0.0}
        poses.append(pose)
    return {"poses": poses}


def test_routes_are_driven():
    robot = VirtualRobot("minibalance", effects="active", hidden=AIR)
    # 30 s to the left at 0.5 m/s, facing north: the robot drives forward. Physics page: 13.9 W.
    flat = route_of([(0.0, 0.5 * k, 0.0, math.pi / 2) for k in range(31)], 0.5)
    energy, log = robot.drive_route(flat)
    assert energy == pytest.approx(13.9 * 30.0, rel=0.02)
    np.testing.assert_allclose(log.columns["vx"][2:-2], 0.5, atol=0.01)
    # The same way on a ramp of 10 degrees that rises to the north: 33.8 W; sideways 42.8 W.
    rise = math.tan(SLOPE_10)
    points = [(0.0, 0.4 * k, 0.4 * k * rise, math.pi / 2) for k in range(31)]
    energy, log = robot.drive_route({"routes": [route_of(points, 0.5)]})
    duration = 12.0 / math.cos(SLOPE_10) / 0.5
    assert energy == pytest.approx(33.8 * duration, rel=0.02)
    assert log.columns["pitch"][10] == pytest.approx(-SLOPE_10, abs=0.003)
    points = [(x, y, z, 0.0) for x, y, z, _ in points]
    plane = footprint_gradient(lambda x, y: 0.0 * x + rise * y, 0.2)
    energy, _ = robot.drive_route(route_of(points, 0.5), gradient=plane)
    assert energy == pytest.approx(42.8 * duration, rel=0.02)
    # Ground that rolls twice as badly: 12 kg at 0.5 m/s roll off 2.06 W more, and 4 of 5 parts of
    # what the gear takes in reach the wheel.
    rough, _ = robot.drive_route(flat, ground=lambda x, y: 2.0 + 0.0 * x)
    even, _ = robot.drive_route(flat)
    assert rough - even > 0.035 * 12.0 * 9.80665 * 15.0 / 0.8


def test_wrong_names_are_refused():
    with pytest.raises(InputError, match=r"no such effect.*'viscous_drag'"):
        VirtualRobot("minibalance", hidden={"viscus_drag": {}})
    with pytest.raises(InputError, match="no such parameter"):
        VirtualRobot("minibalance", hidden={"viscous_drag": {"torque": 1.0}})
    with pytest.raises(InputError, match="no such design"):
        VirtualRobot("minibalance").drive("everything")
    with pytest.raises(InputError, match="too few"):
        planned_route({"poses": []})
    with pytest.raises(InputError, match="does nothing"):
        VirtualRobot("minibalance", hidden={"yaw_scrub": {"size": 0.05}}).drive(steady(vx=0.5))


def test_no_formula_is_shared_with_the_power_model():
    root = Path(__file__).parents[2] / "planner" / "telemetry"
    allowed = {"planner.power.vehicle"}
    for path in [root / "virtual_robot.py", *sorted((root / "virtual").glob("*.py"))]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                if name.startswith("planner.power"):
                    assert name in allowed, (path.name, name)
