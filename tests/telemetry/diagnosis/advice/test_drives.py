"""Recommended drives keep to the vehicle's limits, end where they began and fit a stated area."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.errors import InputError
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX
from planner.telemetry.diagnosis.advice.drives import (
    commands,
    drives_of,
    fitted_into,
    poses_of,
    rows_of_round,
    sampled,
    settings_of,
)

RUN = {"payload": 0.0, "motor_temp": None}
VEHICLES = ("minibalance", "robotino")


def every(name: str) -> list[dict]:
    vehicle = load_vehicle(name)
    return [settings_of(drive, vehicle, [RUN], 2) for drive in drives_of(vehicle)]


def extent(settings: dict) -> np.ndarray:
    """Length and width in m that the body's circle sweeps."""
    path = poses_of(sampled(settings, 0.02))[:, :2]
    return np.ptp(path, axis=0) + math.hypot(*settings["robot"])


@pytest.mark.parametrize("name", VEHICLES)
def test_commands_keep_to_speed_yaw_rate_and_acceleration(name: str) -> None:
    vehicle = load_vehicle(name)
    reach = 0.5 * math.hypot(vehicle.length, vehicle.width)
    for settings in every(name):
        t, vx, vy, wz = commands(settings).T
        speed = np.hypot(vx, vy)
        assert np.all(speed + reach * np.abs(wz) <= vehicle.limits.speed * 1.001)
        assert np.all(np.abs(wz) <= vehicle.limits.yaw_rate)
        rate = np.hypot(np.diff(vx), np.diff(vy)) / np.maximum(np.diff(t), 1e-9)
        assert np.all(rate[np.diff(t) > 1e-9] <= vehicle.limits.acceleration * 1.001)
        assert np.all(np.diff(t) >= 0.0)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_drive_ends_where_it_began_inside_its_area(name: str) -> None:
    for settings in every(name):
        end = poses_of(sampled(settings, 0.02))[-1]
        assert np.hypot(end[0], end[1]) < 0.1
        assert math.remainder(end[2], 2.0 * math.pi) == pytest.approx(0.0, abs=0.02)
        assert np.all(extent(settings) <= np.array(settings["area"]) + 0.02)


def test_a_smaller_area_shortens_the_legs_and_keeps_the_minutes_of_steady_motion() -> None:
    for settings in every("minibalance"):
        body = math.hypot(*settings["robot"])
        small = tuple(0.8 * (size - body) + body for size in extent(settings))
        fitted = fitted_into(settings, small)
        assert np.all(extent(fitted) <= np.array(small) + 0.02)
        steady = [
            each["rounds"] * sum(leg["hold"] for leg in each["legs"]) for each in (settings, fitted)
        ]
        assert steady[1] >= 0.99 * steady[0]
        large = tuple(size + 0.1 for size in settings["area"])
        assert fitted_into(settings, large)["legs"] == settings["legs"]


def test_an_area_that_is_too_small_is_refused_with_what_the_drive_needs() -> None:
    settings = every("minibalance")[0]
    with pytest.raises(InputError, match=r"area.*1\.2 x 1\.1 m.*accepted: about"):
        fitted_into(settings, (1.2, 1.1))


def test_rows_of_a_round_are_its_commands() -> None:
    vehicle = load_vehicle("minibalance")
    for drive in drives_of(vehicle):
        settings = settings_of(drive, vehicle, [RUN], 1)
        rows, seconds = rows_of_round(settings, RUN, {"ambient_temp": 21.0})
        driven = commands(settings)
        assert seconds.sum() == pytest.approx(driven[-1, 0])
        for column, name in enumerate(("vx", "vy", "wz"), start=1):
            # Distances by the trapezoids of the commands.
            gone = np.abs(0.5 * (driven[1:, column] + driven[:-1, column])) @ np.diff(driven[:, 0])
            assert np.abs(rows[:, INDEX[name]]) @ seconds == pytest.approx(gone, abs=1e-6)
        tilt = np.hypot(rows[:, INDEX["gravity_x"]], rows[:, INDEX["gravity_y"]])
        assert tilt == pytest.approx(9.80665 * math.sin(drive.slope), abs=1e-3)
        assert np.all(rows[:, INDEX["ambient_temp"]] == 21.0)
