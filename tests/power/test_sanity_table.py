"""The model of minibalance against the sanity numbers of docs/physics.md.

Those numbers come from a separate implementation with sharp friction signs, which also counted air
drag over 0.18 m². They are printed to 0.1 W, so that half a digit is allowed beside the 1 %.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.account import PerWheel
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.states import Array, changed, column, model_with, plane_gravity

FORWARD, DIAGONAL, SIDEWAYS = 0.0, np.pi / 4, np.pi / 2
SPEEDS = (0.2, 0.5, 0.8)

# slope in degrees along the travel, heading, (bus W, motor W) at 0.2, 0.5, 0.8 m/s
TABLE = [
    (0, FORWARD, ((10.0, 3.0), (13.9, 6.6), (18.1, 10.5))),
    (0, DIAGONAL, ((11.2, 4.2), (16.1, 8.8), (21.3, 13.7))),
    (0, SIDEWAYS, ((13.6, 6.6), (20.4, 13.0), (27.4, 19.8))),
    (5, FORWARD, ((15.2, 8.1), (23.0, 15.7), (31.0, 23.4))),
    (5, SIDEWAYS, ((20.1, 13.0), (30.8, 23.4), (41.6, 34.0))),
    (10, FORWARD, ((22.1, 15.0), (33.8, 26.4), (45.7, 38.0))),
    (10, SIDEWAYS, ((28.3, 21.2), (42.8, 35.4), (57.5, 49.8))),
    (-5, FORWARD, ((7.4, 0.3), (8.3, 1.0), (9.4, 1.9))),
    (-10, FORWARD, ((6.0, -1.0), (4.6, -2.7), (3.4, -4.1))),
    # diagonal slopes, printed to 0.01 W in the same run
    (5, DIAGONAL, ((16.84, 9.78), (25.66, 18.32), (34.73, 27.12))),
    (10, DIAGONAL, ((24.23, 17.13), (36.88, 29.51), (49.79, 42.14))),
    (-10, DIAGONAL, ((6.20, -0.83), (5.18, -2.12), (4.40, -3.18))),
]


def straight(slope: float, heading: float, speed: float, **more: float) -> Array:
    """Row of driving along the gradient of a slope in degrees."""
    return rows_from(
        vx=speed * np.cos(heading),
        vy=speed * np.sin(heading),
        **plane_gravity(np.radians(slope), heading),
        **more,
    )


def motors(model: PowerModel, rows: Array) -> float:
    """W at the terminals of all motors."""
    return float(model.account(rows)["terminal"][0])


@pytest.fixture(scope="module")
def minibalance() -> PowerModel:
    """The vehicle as it stands in its file."""
    return PowerModel.from_vehicle(load_vehicle("minibalance"))


@pytest.fixture(scope="module")
def exact() -> PowerModel:
    """The same with everything that the table's origin counted."""
    return model_with("air_drag", "load_dependent_rolling", "motor_heating", "wheel_preload")


@pytest.fixture(scope="module")
def origin(exact: PowerModel) -> PowerModel:
    """The table's origin: still air, loads and temperature without influence."""
    return changed(
        exact,
        load_dependent_rolling__exponent=0.0,
        wheel_preload__preload_squared=0.0,
        motor_heating__magnet_share=40.0 / 60.0,
    )


@pytest.mark.parametrize(("slope", "heading", "watts"), TABLE)
def test_table(
    minibalance: PowerModel,
    origin: PowerModel,
    slope: float,
    heading: float,
    watts: tuple[tuple[float, float], ...],
) -> None:
    for speed, (bus, terminal) in zip(SPEEDS, watts, strict=True):
        rows = straight(slope, heading, speed)
        assert abs(minibalance.watts(rows)[0] - bus) <= 0.01 * bus + 0.05
        # With the air drag of the origin nothing is left but rounding and the smooth signs.
        assert abs(origin.watts(rows)[0] - bus) <= 0.06
        assert abs(motors(origin, rows) - terminal) <= 0.06


@pytest.mark.parametrize(
    ("slope", "heading", "percent"),
    [
        (0, FORWARD, 5.4),
        (0, SIDEWAYS, 8.9),
        (5, FORWARD, 10.0),
        (5, SIDEWAYS, 12.8),
        (10, FORWARD, 13.6),
        (10, SIDEWAYS, 15.9),
    ],
)
def test_warm_motor(origin: PowerModel, slope: float, heading: float, percent: float) -> None:
    # Winding at 85 °C, magnets at 65 °C, against 25 °C.
    cold = motors(origin, straight(slope, heading, 0.5))
    warm = motors(origin, straight(slope, heading, 0.5, motor_temp=85.0))
    assert 100.0 * (warm / cold - 1.0) == pytest.approx(percent, abs=0.1)


@pytest.mark.parametrize(
    ("slope", "com_x", "com_y", "exponent", "terminal"),
    [
        (0, -0.1, 0.0, 0.0, 6.65),
        (0, -0.1, 0.0, 0.3, 6.82),
        (0, -0.1, 0.0, 1.0, 7.47),
        (10, 0.0, 0.1, 0.0, 26.7),
        (10, 0.0, 0.1, 1.0, 27.7),
    ],
)
def test_shifted_centre_of_mass(
    origin: PowerModel, slope: float, com_x: float, com_y: float, exponent: float, terminal: float
) -> None:
    model = changed(origin, load_dependent_rolling__exponent=exponent)
    rows = straight(slope, FORWARD, 0.5, com_x=com_x, com_y=com_y)
    assert motors(model, rows) == pytest.approx(terminal, rel=0.005)


def test_loads_of_a_shifted_centre_of_mass(minibalance: PowerModel) -> None:
    _, wheels = minibalance.evaluate(straight(0, FORWARD, 0.5, com_x=-0.1, com_y=0.0))
    assert wheels[:, PerWheel.LOAD] == pytest.approx([15.7, 15.7, 43.2, 43.2], abs=0.05)


@pytest.mark.parametrize(
    ("heading", "bus", "terminal"), [(0.0, 19.2, 11.9), (np.pi / 2, 25.0, 17.6)]
)
def test_cross_slope(origin: PowerModel, heading: float, bus: float, terminal: float) -> None:
    # Along the contour of 10°: no climb, but two wheels pull and two are back-driven.
    rows = rows_from(
        vx=0.5 * np.cos(heading),
        vy=0.5 * np.sin(heading),
        **plane_gravity(np.radians(10.0), np.pi / 2 - heading),
    )
    assert origin.watts(rows)[0] == pytest.approx(bus, rel=0.01)
    assert motors(origin, rows) == pytest.approx(terminal, rel=0.01)


def test_contour_is_cheapest_at_45_degrees(origin: PowerModel) -> None:
    # J/m on a 10° side slope: 32.9 diagonal, 38.4 forward, 50.0 sideways. Diagonally the better of
    # the two sides is meant: on the other one the drag of their rollers adds to what the two wheels
    # hold that do not roll.
    cost = {}
    for heading in (FORWARD, DIAGONAL, SIDEWAYS):
        rows = rows_from(
            vx=0.5 * np.cos(heading),
            vy=0.5 * np.sin(heading),
            **plane_gravity(np.radians(10.0), heading - np.pi / 2),
        )
        cost[heading] = origin.watts(rows)[0] / 0.5
    assert cost[FORWARD] == pytest.approx(38.4, rel=0.01)
    assert cost[DIAGONAL] == pytest.approx(32.9, rel=0.01)
    assert cost[SIDEWAYS] == pytest.approx(50.0, rel=0.01)


@pytest.mark.parametrize("degrees", [0, 15, 30, 45, 60, 75, 90, -120])
def test_resistance_by_heading(minibalance: PowerModel, degrees: float) -> None:
    # μ_eff = c_w·max(|cos θ|, |sin θ|) + √2·c_r·|sin θ|, from 0.035 forward to 0.099 sideways.
    angle = np.radians(degrees)
    rows = rows_from(vx=0.5 * np.cos(angle), vy=0.5 * np.sin(angle))
    resistance = minibalance.account(rows)["shaft"][0] / (0.5 * 12.0 * 9.80665)
    law = 0.035 * max(abs(np.cos(angle)), abs(np.sin(angle)))
    law += np.sqrt(2.0) * 0.045 * abs(np.sin(angle))
    assert resistance == pytest.approx(law, rel=2e-3)


def test_turning(origin: PowerModel) -> None:
    in_place = origin.watts(rows_from(wz=1.0))[0]
    straight_on = origin.watts(rows_from(vx=0.5))[0]
    # ω and v given, so that the centripetal acceleration ω·v belongs to the state.
    turning = origin.watts(rows_from(vx=0.5, wz=1.0))[0]
    assert in_place == pytest.approx(15.66, rel=0.01)
    assert turning - straight_on == pytest.approx(2.38, rel=0.03)


def test_acceleration(origin: PowerModel) -> None:
    # Half way to 0.5 m/s at 1 m/s²: 12 kg behave as 15.19 kg, motors 12.59 W, bus 19.70 W.
    rows = rows_from(vx=0.25, ax=1.0)
    assert origin.watts(rows)[0] == pytest.approx(19.70, rel=0.01)
    assert motors(origin, rows) == pytest.approx(12.59, rel=0.01)
    assert origin.watts_by_effect(rows)["inertia"][0] == pytest.approx(15.19 * 0.25, rel=1e-3)


@pytest.mark.parametrize(("newton", "terminal"), [(0, 6.62), (2, 7.70), (5, 11.73), (10, 22.30)])
def test_wheels_that_fight(origin: PowerModel, newton: float, terminal: float) -> None:
    model = changed(origin, wheel_preload__preload_squared=newton**2)
    assert motors(model, rows_from(vx=0.5)) == pytest.approx(terminal, rel=0.01)


def test_braking_power_starts_where_it_should(origin: PowerModel) -> None:
    # Motors give back power below about -6.3°, at 0.5 m/s.
    assert motors(origin, straight(-6.0, FORWARD, 0.5)) > 0.0
    assert motors(origin, straight(-6.5, FORWARD, 0.5)) < 0.0


def test_still_air_and_wind(minibalance: PowerModel) -> None:
    # 0.8 m/s in still air 0.055 W at the wheels, into 5 m/s of wind 2.9 W.
    model = model_with("air_drag")
    shaft = model.account(rows_from(vx=[0.8, 0.8], wind_x=[0.0, -5.0]))["shaft"]
    bare = minibalance.account(rows_from(vx=0.8))["shaft"][0]
    assert shaft - bare == pytest.approx([0.055, 2.9], rel=0.01)


def test_rows_are_si_and_named() -> None:
    rows = rows_from(vx=[0.1, 0.2], payload=3.0)
    assert column(rows, "vx") == pytest.approx([0.1, 0.2])
    assert column(rows, "payload") == pytest.approx([3.0, 3.0])
    assert column(rows, "gravity_normal") == pytest.approx([9.80665, 9.80665])
