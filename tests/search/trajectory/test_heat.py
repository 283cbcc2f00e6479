"""Rests in which motors cool: only where they are needed, as long as needed, and within limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.power.limits import gear_torques
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.requests import PlanRequest
from planner.search.results import Answer
from planner.search.situation import situation_of
from planner.search.trajectory import Motion
from planner.search.trajectory.heat import overheated, rested
from planner.search.trajectory.motion import motion_rows
from planner.terrain.heightmap import Terrain
from tests.benchmarks.peers.case import Case
from tests.benchmarks.peers.limits import broken_limits
from tests.search.maps import terrain

UP = {"start": {"x": 3.0, "y": 2.5}, "goal": {"x": 22.0, "y": 2.5}}
PITCH, TERRACE, DEGREES = 4.0, 1.5, 19.0
"""m of either steep pitch and of the terrace between, and how steep they are."""
THERMAL_TIME, TORQUE = 15.0, 0.022
"""s and N·m of continuous torque: enough for either pitch and not for both."""


def model(thermal_time: float, torque: float = TORQUE) -> PowerModel:
    """The built-in robot, whose torque counts over so many s."""
    vehicle = load_vehicle("minibalance")
    peak = vehicle.limits.peak_torque
    limits = replace(
        vehicle.limits, thermal_time=thermal_time, continuous_torque=torque, peak_torque=peak
    )
    return PowerModel.from_vehicle(replace(vehicle, limits=limits))


def pitches(terrace: float = TERRACE) -> Terrain:
    """Two steep pitches along x with a terrace between, 5 m wide: there is no path round them."""
    x = 0.25 * np.arange(104)
    first = 12.0 - 0.5 * terrace - PITCH
    climbed = np.clip(x - first, 0.0, PITCH) + np.clip(x - first - PITCH - terrace, 0.0, PITCH)
    return terrain(np.repeat(math.tan(math.radians(DEGREES)) * climbed[None, :], 20, axis=0))


def planned(thermal_time: float, terrace: float = TERRACE) -> Answer:
    return plan_route(terrain=pitches(terrace), model=model(thermal_time), **UP)


@pytest.fixture(scope="module")
def cooled() -> tuple[Answer, Motion]:
    """An answer whose motors are too warm without a rest."""
    answer = planned(THERMAL_TIME)
    motion = answer.routes[0].motion
    assert motion is not None
    return answer, motion


@pytest.fixture(scope="module")
def case() -> Case:
    """The question, for whom reads its answer."""
    request = PlanRequest.from_json({"map": "test", **UP})
    situation = situation_of(request, terrain=pitches(), model=model(THERMAL_TIME))
    ends = ((place["x"], place["y"]) for place in UP.values())
    return Case("test", UP, situation, situation.field("energy"), *ends)


def without_rests(motion: Motion) -> Motion:
    """The same motion, which stops for a moment where it rested."""
    time = motion.time.copy()
    for step in motion.rests:
        time[step + 1 :] -= motion.time[step + 1] - motion.time[step]
    return replace(motion, time=time)


def test_the_robot_rests_between_two_pitches_that_are_too_much_together(cooled) -> None:
    answer, motion = cooled
    assert len(motion.rests) == 1
    (step,) = motion.rests
    # On the terrace or before the first pitch, where standing takes no torque.
    x, y = motion.x[step], motion.y[step]
    slope = float(np.hypot(*pitches().gradient(np.array([x]), np.array([y]))).max())
    assert slope < 0.2 * math.tan(math.radians(DEGREES))
    assert any("rests once" in note for note in answer.notes)


def test_all_limits_hold_by_poses_that_another_program_reads(cooled, case) -> None:
    answer, _ = cooled
    assert broken_limits(case, answer.routes[0]) == {}
    closely = plan_route(
        terrain=pitches(), model=model(THERMAL_TIME), poses_every_s=0.05, **UP
    ).routes[0]
    assert np.diff(closely.arrays["t"]).min() > 0.0
    assert np.diff(closely.arrays["t"]).max() < 0.05 + 1e-9


def test_without_its_rest_or_with_half_of_it_the_motion_is_too_warm(cooled, case) -> None:
    _, motion = cooled
    field, conditions = case.field, case.situation.conditions
    assert overheated(field, conditions, motion) is None
    assert rested(field, conditions, motion) is motion
    warm = without_rests(motion)
    assert overheated(field, conditions, warm) is not None
    (step,) = motion.rests
    half = motion.time.copy()
    half[step + 1 :] -= 0.5 * (motion.time[step + 1] - motion.time[step])
    assert overheated(field, conditions, replace(motion, time=half)) is not None


def test_a_rest_takes_no_more_than_its_idle_power_and_its_start(cooled) -> None:
    answer, _ = cooled
    free = planned(1000.0).routes[0]
    assert free.motion is not None
    assert not len(free.motion.rests)
    spent = answer.routes[0].energy_j - free.energy_j
    longer = answer.routes[0].duration_s - free.duration_s
    idle = answer.routes[0].breakdown_j["electronics"] / answer.routes[0].duration_s
    # Half the mass times the speed squared, and as much again for what gear and motor lose.
    start = 12.0 * load_vehicle("minibalance").limits.speed ** 2
    assert 0.0 < spent < 2.0 * idle * longer + start


def test_no_rest_helps_a_pitch_that_is_too_long_by_itself() -> None:
    """Holding the robot on a slope takes torque, too: motors do not cool there."""
    refused = planned(10.0, terrace=0.0)
    assert refused.status == "no_route"
    assert refused.cause is not None
    assert refused.cause["limit"] == "torque rms"


@pytest.mark.parametrize("torque", [0.0215, 0.0208])
def test_on_a_long_ramp_the_rest_is_where_all_warm_windows_hold_it(torque: float) -> None:
    """Of a window of climbing, a rest takes out what is too much: 15 s·(r² - 1)/(r² - h²).

    r is the torque of the climb and h that of holding, over the continuous one. A rest at another
    place leaves some of the warm windows with less of it, and so has to last longer.
    """
    x = 0.25 * np.arange(150)
    ramp = math.tan(math.radians(10.0)) * np.clip(x - 6.0, 0.0, 22.0)
    ground = terrain(np.repeat(ramp[None, :], 20, axis=0))
    ends = {"start": {"x": 3.0, "y": 2.5}, "goal": {"x": 32.0, "y": 2.5}}
    warm = model(THERMAL_TIME, torque)
    answer = plan_route(terrain=ground, model=warm, **ends)
    motion = answer.routes[0].motion
    assert motion is not None
    situation = situation_of(
        PlanRequest.from_json({"map": "test", **ends}), terrain=ground, model=warm
    )
    conditions = situation.conditions
    rows, _, owner = motion_rows(
        situation.field("energy"), motion, conditions.class_rows, conditions.wind
    )
    torques = gear_torques(warm, rows).max(axis=1) / torque
    climb = float(np.median(torques[(motion.x[owner] > 8.0) & (motion.x[owner] < 26.0)]))
    (step,) = motion.rests
    hold = float(torques[owner == step].max())
    assert hold < 1.0 < climb
    least = THERMAL_TIME * (climb**2 - 1.0) / (climb**2 - hold**2)
    # Speeding up again takes torque too.
    limits = warm.vehicle.limits
    assert least < np.diff(motion.time)[step] < least + limits.speed / limits.acceleration
