"""Effects that a virtual robot hides: each costs what it should, where it should, and nothing else.

Figures marked "physics page" are those of docs/physics.md, "What effects are worth", which come
from a separate implementation.
"""

import math

import numpy as np
import pytest

from planner.errors import InputError
from planner.telemetry.virtual import QUIET, VirtualRobot
from planner.telemetry.virtual.dynamics import BOOK, MEANS
from planner.telemetry.virtual.hidden import EFFECTS, scaled
from planner.telemetry.virtual.profiles import steady
from planner.telemetry.virtual.routes import planned_route

SLOPE_10 = math.radians(10.0)


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


def test_presliding_rollers_rub_less_where_their_wheels_turn():
    # Diagonally two wheels stand and two turn at 0.6 m/s; all rollers do 0.3·√2 m/s.
    share, duration = 0.2, 10.0
    robot = VirtualRobot("minibalance", hidden={"roller_presliding": {"presliding": share}})
    _, book = robot.simulate(steady(vx=0.3, vy=0.3, duration=duration))
    spin, load = 0.3 * math.sqrt(2.0), 3.0 * 9.80665
    ratio = share * 0.6 / spin
    turning = 1.0 - ratio * (1.0 - math.exp(-1.0 / ratio))
    watts = 0.045 * load * spin * (2.0 + 2.0 * turning)
    assert book[0, BOOK.index("rollers")] / duration == pytest.approx(watts, rel=0.01)


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
    ("roller_presliding", {"vx": 0.5}),
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


def test_motors_of_one_temperature_or_of_their_own():
    # Driving forward across a slope two motors pull and two brake: unequal currents, unequal heat.
    across = steady(vx=0.4, roll=SLOPE_10, duration=600.0)
    strength = {"motor_heating": {}}
    each, one = (
        VirtualRobot("minibalance", hidden=strength, even_heat=even).simulate(across)[0]
        for even in (False, True)
    )
    power, warmth = MEANS.index("power"), MEANS.index("motor_temp")
    # The mean motor warms alike, but where the hot motors are those that pull, the same mean
    # temperature costs more.
    assert each[0, -1, warmth] == pytest.approx(one[0, -1, warmth], abs=1.0)
    assert each[0, -1, power] > one[0, -1, power] + 0.02
