"""What the robot can do at all: traction, torque, tipping and voltage by slope and heading.

Closed forms of docs/physics.md: a roller pushes along its axle only, so that with ideal sharing

    tan γ_max = μ / (√2·(|cos ψ| + |sin ψ|))        ψ: uphill seen from the body's x axis
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.power.account import ACCOUNT, ACCOUNT_LENGTH, LIMITS, PerWheel
from planner.power.kernels import BLOCK
from planner.power.limits import (
    LIMIT_NAMES,
    broken_in_block,
    broken_in_results,
    broken_limit,
    gear_torques,
    limit_values,
    rms_torques,
)
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.states import Array, changed, model_with, plane_gravity


@pytest.fixture(scope="module")
def model() -> PowerModel:
    return model_with()


def steepest(possible: Callable[[float], bool]) -> float:
    """Largest slope in degrees at which something is possible, by bisection."""
    low, high = 0.0, 60.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if possible(middle) else (low, middle)
    return low


def on_slope(degrees: float, uphill: float, **more: float) -> Array:
    return rows_from(**plane_gravity(np.radians(degrees), uphill), **more)


def grip_limit(model: PowerModel, uphill: float, factor: float = 1.0) -> float:
    """Degrees at which standing still uses up all traction."""
    return steepest(
        lambda degrees: (
            model.account(on_slope(degrees, uphill, traction_factor=factor))["traction_left"][0]
            >= 0.0
        )
    )


@pytest.mark.parametrize(
    ("mu", "forward", "diagonal"),
    [
        (0.3, 12.0, 8.5),
        (0.4, 15.8, 11.3),
        (0.5, 19.5, 14.0),
        (0.6, 23.0, 16.7),
        (0.7, 26.3, 19.3),
        (0.8, 29.5, 21.8),
    ],
)
def test_traction_by_heading(model: PowerModel, mu: float, forward: float, diagonal: float) -> None:
    assert grip_limit(model, 0.0, mu / 0.6) == pytest.approx(forward, abs=0.1)
    assert grip_limit(model, np.pi / 2, mu / 0.6) == pytest.approx(forward, abs=0.1)
    assert grip_limit(model, np.pi / 4, mu / 0.6) == pytest.approx(diagonal, abs=0.1)


@pytest.mark.parametrize("degrees", [0, 15, 30, 45, 60, 75, 90, 130, 200, -50])
def test_traction_closed_form(model: PowerModel, degrees: float) -> None:
    uphill = np.radians(degrees)
    closed = 0.6 / (np.sqrt(2.0) * (abs(np.cos(uphill)) + abs(np.sin(uphill))))
    assert grip_limit(model, uphill) == pytest.approx(np.degrees(np.arctan(closed)), abs=0.1)


def test_a_mecanum_robot_holds_less_than_an_ordinary_one(model: PowerModel) -> None:
    # Four plain wheels hold tan γ = μ: 31.0°.
    assert grip_limit(model, 0.0) < np.degrees(np.arctan(0.6)) - 7.0


def test_traction_left_is_a_share_of_the_limit(model: PowerModel) -> None:
    # On the flat at rest nothing is used; on half the limiting tangent, half.
    account = model.account(on_slope(0.0, 0.0))
    assert account["traction_left"][0] == pytest.approx(1.0, abs=1e-9)
    half = np.degrees(np.arctan(0.5 * 0.6 / np.sqrt(2.0)))
    assert model.account(on_slope(half, 0.0))["traction_left"][0] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("payload", "degrees"), [(0.0, 16.4), (10.0, 7.9), (30.0, 3.2)])
def test_continuous_torque(model: PowerModel, payload: float, degrees: float) -> None:
    # T_cont·n·η at four wheels is 37.3 N; the load transfer on a slope does not change the mean,
    # so that the height of the mass is put to zero to leave the wheels equal.
    flat = replace(model, vehicle=replace(model.vehicle, com_height=0.0))
    limit = flat.vehicle.limits.continuous_torque
    found = steepest(
        lambda angle: (
            flat.account(on_slope(angle, 0.0, vx=0.5, payload=payload))["motor_torque"][0] <= limit
        )
    )
    assert found == pytest.approx(degrees, abs=0.12)


def test_a_wheel_lifts_where_the_mass_passes_the_axle(model: PowerModel) -> None:
    # Level ground: loads vanish where x_c/a = 1; on a slope earlier by h·tan γ.
    flat = model.account(rows_from(com_x=[-0.213, -0.215], com_y=0.0))["least_load"]
    assert flat[0] > 0.0 > flat[1]
    tangent = (0.214 - 0.15) / 0.12
    angle = np.degrees(np.arctan(tangent))
    for degrees, lifted in ((angle - 0.1, False), (angle + 0.1, True)):
        account = model.account(on_slope(degrees, 0.0, com_x=-0.15, com_y=0.0))
        assert (account["least_load"][0] < 0.0) == lifted


def test_twenty_percent_of_the_load_moves_at_twenty_degrees(model: PowerModel) -> None:
    _, wheels = model.evaluate(on_slope(20.0, 0.0))
    rear, front = wheels[2:, 0].sum(), wheels[:2, 0].sum()
    assert (rear - front) / (rear + front) == pytest.approx(0.204, abs=0.001)


@pytest.mark.parametrize(("heading", "speed"), [(0.0, 1.66), (np.pi / 2, 1.60), (np.pi / 4, 1.13)])
def test_voltage_limits_the_speed_most_on_the_diagonal(
    model: PowerModel, heading: float, speed: float
) -> None:
    # (0.95·24 V - R·I)/(k_t·n/r), and a wheel runs √2·v on the diagonal. docs/physics.md rounds the
    # first two to 1.6 m/s; forward the current is 0.24 A, sideways 0.42 A.
    low, high = 0.1, 3.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        rows = rows_from(vx=middle * np.cos(heading), vy=middle * np.sin(heading))
        enough = model.account(rows)["voltage"][0] <= model.vehicle.limits.voltage
        low, high = (middle, high) if enough else (low, middle)
    assert low == pytest.approx(speed, rel=0.01)


def test_parking_on_a_slope_costs_current_beyond_friction(model: PowerModel) -> None:
    # Gear and motor friction hold up to some degrees; then the bus shows it: 6.25, 6.9, 7.4, 8.5 W.
    watts = model.watts(np.vstack([on_slope(degrees, 0.0) for degrees in (0.0, 5.0, 10.0, 15.0)]))
    assert watts == pytest.approx([6.25, 6.87, 7.35, 8.48], rel=0.01)
    # On 2° the friction of the motors holds the robot, and no current flows.
    assert model.account(on_slope(2.0, 0.0))["current"][0] == pytest.approx(0.0, abs=1e-9)


def test_limits_of_an_unknown_centre_are_those_of_its_worst_side() -> None:
    # 5 cm to the front or to the rear, nobody knows: the worse of the two known cases.
    unknown = changed(model_with(), com_offset__offset_x_squared=0.05**2)
    known = model_with()
    slope = {"vx": 0.5, "com_y": 0.0}
    both = [known.account(on_slope(10.0, 0.0, com_x=x, **slope)) for x in (0.05, -0.05)]
    found = unknown.account(on_slope(10.0, 0.0, **slope))
    for name, worst in (("least_load", min), ("traction_left", min), ("current", max)):
        assert found[name][0] == pytest.approx(worst(account[name][0] for account in both))
    mean = 0.5 * sum(account["supply"][0] for account in both)
    assert found["supply"][0] == pytest.approx(mean, rel=1e-12)


def test_limits_of_every_vehicle_are_met_on_level_ground() -> None:
    for name in ("minibalance", "robotino"):
        vehicle = load_vehicle(name)
        robot = PowerModel.from_vehicle(vehicle)
        for heading in np.linspace(0.0, np.pi, 7):
            speed = 0.9 * vehicle.limits.speed
            account = robot.account(
                rows_from(vx=speed * np.cos(heading), vy=speed * np.sin(heading))
            )
            assert account["voltage"][0] <= vehicle.limits.voltage
            assert account["current"][0] <= vehicle.limits.current
            assert account["motor_torque"][0] <= vehicle.limits.continuous_torque
            assert account["traction_left"][0] > 0.5


# Which limit an account breaks: planner.power.limits.

SOUND = {
    "least_load": 10.0,
    "current": 1.0,
    "voltage": 10.0,
    "motor_torque": 0.1,
    "traction_left": 0.5,
}
LIMITED = np.array([1.0, 5.0, 22.8, 0.2])
"""Speed, current, voltage, peak torque."""
BREAKS = {
    "wheel load": {"least_load": 0.0},
    "traction": {"traction_left": -0.01},
    "current": {"current": 5.01},
    "voltage": {"voltage": 22.9},
    "torque peak": {"motor_torque": 0.21},
}


def both_ways(values: dict[str, float]) -> str | None:
    """The limit that is broken; an account and a block of results must agree."""
    account = np.zeros(ACCOUNT_LENGTH)
    results = np.zeros(1 + len(LIMITS))
    for name, value in values.items():
        account[ACCOUNT.index(name)] = value
        results[1 + list(LIMITS).index(name)] = value
    found = np.full((len(results), BLOCK), np.nan)
    found[:, 2] = results
    number = broken_limit(account, LIMITED)
    assert number == broken_in_results(results, LIMITED)
    assert number == broken_in_block(found.ravel(), 2, LIMITED)
    return None if number < 0 else LIMIT_NAMES[number]


def test_a_limit_is_broken_beyond_it_and_named() -> None:
    assert both_ways(SOUND) is None
    for name, broken in BREAKS.items():
        assert both_ways({**SOUND, **broken}) == name


def test_what_would_tip_or_slide_is_told_before_what_would_overload() -> None:
    values = dict(SOUND)
    for name in reversed(LIMIT_NAMES):
        values |= BREAKS[name]
        assert both_ways(values) == name


def test_gear_torques_are_those_of_every_motor(model: PowerModel) -> None:
    """Driving along a contour, two motors push and two hold back; the worst is the limit's."""
    rows = on_slope(10.0, np.pi / 2, vx=0.5)
    torques = gear_torques(model, rows)
    _, wheels = model.evaluate(rows)
    known = wheels[:, PerWheel.WHEEL_TORQUE] * wheels[:, PerWheel.WHEEL_SPEED]
    driving, geared = known > 0.0, np.abs(wheels[:, PerWheel.WHEEL_TORQUE]) / 26.85
    np.testing.assert_allclose(torques[0, driving], geared[driving] / 0.80, rtol=1e-4)
    np.testing.assert_allclose(torques[0, ~driving], geared[~driving] * (2 - 1 / 0.80), rtol=1e-4)
    assert 0 < driving.sum() < 4
    assert torques.max() == pytest.approx(model.account(rows)["motor_torque"][0], rel=1e-12)


def rms_by_hand(torques: Array, seconds: Array, window: float, step: float = 1e-3) -> float:
    """The largest root mean square over any window, in plain steps of time."""
    counts = np.round(seconds / step).astype(int)
    squares = [value**2 for value, count in zip(torques, counts, strict=True) for _ in range(count)]
    width = round(window / step)
    squares = [0.0] * width + squares
    sums = np.append(0.0, np.cumsum(squares))
    return float(np.sqrt((sums[width:] - sums[:-width]).max() / width))


@pytest.mark.parametrize("window", [0.5, 2.0, 30.0])
def test_rms_torque_over_every_window_with_rest_before(window: float) -> None:
    random = np.random.default_rng(3)
    torques, seconds = random.uniform(0.0, 2.0, 60), 0.001 * random.integers(1, 400, 60)
    rms = rms_torques(torques, seconds, window)
    # Windows that end inside a row may hold a little more than those at its end.
    assert rms.max() == pytest.approx(rms_by_hand(torques, seconds, window), rel=1e-9)
    both = rms_torques(np.column_stack([torques, 2.0 * torques]), seconds, window)
    np.testing.assert_allclose(both[:, 0], rms, rtol=1e-12)
    np.testing.assert_allclose(both[:, 1], 2.0 * rms, rtol=1e-12)


def test_a_motor_that_holds_warms_up_until_the_climb_no_longer_counts() -> None:
    """2 s without load, 4 s of 3 N·m, a long hold at 2 N·m: with a window of 6 s, worst at 8 s."""
    rms = rms_torques(np.array([0.0, 3.0, 2.0]), np.array([2.0, 4.0, 60.0]), 6.0)
    assert rms[1] == pytest.approx(np.sqrt(4.0 * 3.0**2 / 6.0), rel=1e-12)
    assert rms[2] == pytest.approx(np.sqrt((4.0 * 3.0**2 + 2.0 * 2.0**2) / 6.0), rel=1e-12)


def test_a_short_torque_counts_by_its_share_of_the_time() -> None:
    # One second of 3 N·m in a window of nine: 3·√(1/9) = 1.
    assert rms_torques(np.array([3.0]), np.array([1.0]), 9.0)[0] == pytest.approx(1.0, rel=1e-12)
    assert len(rms_torques(np.zeros(0), np.zeros(0), 9.0)) == 0
    # For good, the mean is the torque itself.
    assert rms_torques(np.full(90, 3.0), np.ones(90), 9.0)[-1] == pytest.approx(3.0, rel=1e-12)


def test_limits_are_those_of_the_vehicle(model: PowerModel) -> None:
    known = model.vehicle.limits
    speed, current, voltage, torque, mass, _ = limit_values(model, 3.0)
    assert (speed, current, voltage, torque) == (
        known.speed, known.current, known.voltage, 2.0 * known.continuous_torque,
    )  # fmt: skip
    assert mass == model.vehicle.mass + 3.0
