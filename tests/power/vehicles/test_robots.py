"""Five real robots from what their makers state, and what the sanity table makes of them.

The files are written with docs/vehicle-file.md alone. Their sources are repositories and pages of
the makers; "as known" marks a figure of a brochure that was not at hand.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from planner.power.sanity import ASSUMED, Motion, VehicleReport, check_vehicle
from planner.power.vehicles.vehicle_file import load_vehicle

FOLDER = Path(__file__).parent / "data_sheets"
ROBOTS = sorted(path.stem for path in FOLDER.glob("*.toml"))
each_robot = pytest.mark.parametrize("name", ROBOTS)
REPORTS: dict[str, VehicleReport] = {}


def report(name: str) -> VehicleReport:
    """The report of a robot; made once."""
    if name not in REPORTS:
        REPORTS[name] = check_vehicle(load_vehicle(str(FOLDER / f"{name}.toml")))
    return REPORTS[name]


def level(name: str) -> Motion:
    """Its motion on level ground."""
    return report(name).motions[0]


def test_robots_of_all_sizes() -> None:
    vehicles = [load_vehicle(str(FOLDER / f"{name}.toml")) for name in ROBOTS]
    assert len(vehicles) == 5
    assert {vehicle.layout.wheel_count for vehicle in vehicles} == {3, 4}
    masses = [vehicle.mass for vehicle in vehicles]
    assert 3.0 <= min(masses) < 6.0
    assert 50.0 < max(masses) <= 60.0


@each_robot
def test_a_data_sheet_is_a_short_file_with_sources(name: str) -> None:
    text = (FOLDER / f"{name}.toml").read_text("utf-8")
    assert len(text.splitlines()) <= 30
    vehicle = load_vehicle(str(FOLDER / f"{name}.toml"))
    assert vehicle.provenance.without_source == ()
    own = [s for s in vehicle.provenance.sources.values() if not s.startswith("motor ")]
    assumed = [source for source in own if source.startswith(ASSUMED)]
    assert 3 * len(assumed) <= len(own), assumed


@each_robot
def test_nothing_is_odd_and_every_motion_is_possible(name: str) -> None:
    found = report(name)
    assert found.odd == ()
    flat, up, down, sideways = found.motions
    assert up.power_w > flat.power_w > down.power_w
    assert sideways.power_w > flat.power_w
    assert up.reachable_m_s <= flat.reachable_m_s <= down.reachable_m_s


@pytest.mark.parametrize(
    ("name", "stated"),
    [
        ("rosbot-xl", 0.8),  # m/s, husarion/rosbot_ros, limit of the controller
        ("youbot-base", 0.8),  # m/s, brochure, as known
        ("robotino-v2", 0.94),  # m/s at the motors' rated 3600 1/min, not at full voltage
    ],
)
def test_the_stated_speed_is_reached_and_is_no_tenth_of_what_is(name: str, stated: float) -> None:
    assert stated <= level(name).reachable_m_s < 1.6 * stated


def test_xlerobot_stays_below_the_speed_of_its_servo() -> None:
    # 45 1/min without load at 12 V; 95 % of the voltage and the drag of 12 kg take the rest.
    without_load = 45.0 / 60.0 * math.tau * 0.0508
    # Driving along x, the rims of the two wheels at 120° run at cos 30° of the speed.
    rim = level("xlerobot").reachable_m_s * math.cos(math.radians(30.0))
    assert 0.8 * without_load < rim < 0.95 * without_load
    # Its makers state 10 h and more in normal operation, in which it seldom drives.
    assert (level("xlerobot").hours or 0.0) > 10.0


def test_panther_uses_what_its_makers_state() -> None:
    # 120 W and about 7 h in normal operation.
    assert level("panther-mecanum").power_w == pytest.approx(120.0, rel=0.3)
    assert level("panther-mecanum").hours == pytest.approx(7.0, rel=0.3)
    # 3600 1/min need 41.5 V, which a full battery has; the file states the nominal 36 V.
    stated = 3600.0 / 60.0 * math.tau / 30.08 * 0.1016
    share = 0.95 * 36.0 / (0.11 * 3600.0 / 60.0 * math.tau)
    assert level("panther-mecanum").reachable_m_s == pytest.approx(share * stated, rel=0.02)
