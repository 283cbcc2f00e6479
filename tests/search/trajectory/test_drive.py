"""What a moved path takes with the driving it had, against driving that is found anew."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.limit_places import Infeasible
from planner.search.results import energy_of
from planner.search.trajectory.drive import CLOSELY, ROUGHLY, move, moved_alike
from planner.search.trajectory.motion import Motion, assemble, room_to_move
from planner.search.trajectory.speed_profile import speed_profile
from planner.search.trajectory.track import lay_track, steps_of
from planner.search.trajectory.yaw import YawProfile
from tests.benchmarks.peers.case import case_of
from tests.search.maps import hills, terrain

ASKED = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 20.0, "y": 12.0}}
PATH = np.array([[3.0, 4.0], [8.0, 5.0], [14.0, 9.5], [20.0, 12.0]])


@pytest.fixture(scope="module", params=["level", "hills"])
def driven(request):
    """Field, conditions, and how to drive a path roughly."""
    heights = np.zeros((96, 96)) if request.param == "level" else hills(96, rms_degrees=5.0)
    situation = case_of("test", ASKED, terrain(heights)).situation
    field, conditions = situation.field("energy"), situation.conditions

    def drive(path):
        yaws = [None, None]
        found = move(field, conditions, [path], yaws, care=ROUGHLY, checked=False)
        assert isinstance(found, Motion)
        return found

    return field, conditions, drive


def test_all_walls_in_the_way_are_found_at_once():
    """Three ridges that nobody climbs, with level ground between: past each the yaw is free."""
    x = 0.25 * np.tile(np.arange(96.0), (60, 1))
    ridges = (7.0, 12.0, 17.0)
    heights = sum(np.maximum(0.8 - 1.2 * np.abs(x - at), 0.0) for at in ridges)
    situation = case_of("test", ASKED, terrain(heights)).situation
    path = np.array([[3.0, 6.0], [21.0, 6.0]])
    found = move(
        situation.field("energy"),
        *(situation.conditions, [path], [None, None]),
        checked=False,
    )
    assert isinstance(found, Infeasible)
    beside = [min(abs(x - at) for at in ridges) for x, _ in found.places]
    assert max(beside) < 1.2
    for at in ridges:
        assert any(abs(x - at) < 1.2 for x, _ in found.places)


def bent(aside: float):
    path = PATH.copy()
    path[1] += aside * np.array([0.6, -0.8])
    path[2] -= aside * np.array([0.5, -0.85])
    return path


def test_a_path_that_did_not_move_is_driven_as_before(driven):
    field, conditions, drive = driven
    motion = drive(PATH)
    same = moved_alike(field, conditions, motion, [PATH], [PATH])
    np.testing.assert_allclose(np.column_stack([same.x, same.y])[[0, -1]], PATH[[0, -1]])
    np.testing.assert_allclose(same.time[-1], motion.time[-1], rtol=2e-3)
    before, after = (energy_of(field, conditions, one) for one in (motion, same))
    assert after == pytest.approx(before, rel=2e-3)


@pytest.mark.parametrize("aside", [-0.8, -0.3, 0.3, 0.8])
def test_what_a_move_saves_is_what_driving_anew_says(driven, aside):
    """With the driving found anew it saves no less; on level ground, where that hardly changes.

    Rough driving has yaw angles 5.6° apart. Rollers that turn a little to the side drag in full, so
    that two rough searches differ by more than 0.1 %.
    """
    field, conditions, drive = driven
    motion, path = drive(PATH), bent(aside)
    here = energy_of(field, conditions, moved_alike(field, conditions, motion, [PATH], [PATH]))
    there = energy_of(field, conditions, moved_alike(field, conditions, motion, [PATH], [path]))
    before, anew = (energy_of(field, conditions, one) for one in (motion, drive(path)))
    more = (there - here) - (anew - before)
    assert -1e-3 * before < more < 0.02 * before
    if not np.ptp(field.heights):
        assert abs(more) < 2e-3 * before < 0.25 * abs(anew - before)


@pytest.mark.parametrize("degrees", [-40.0, -10.0, 2.0, 25.0, 60.0])
def test_a_via_place_is_passed_without_a_stop(degrees):
    """A stop takes half of m·v² again: more than a bend of up to 60° on 5 m of level ground."""
    situation = case_of("test", ASKED, terrain(np.zeros((96, 96)))).situation
    field, conditions = situation.field("energy"), situation.conditions
    place, turn = np.array([10.0, 10.0]), np.radians(degrees)
    come = np.array([place - (5.0, 0.0), place])
    go = np.array([place, place + 5.0 * np.array([np.cos(turn), np.sin(turn)])])

    def drive(legs):
        yaws = [None] * (len(legs) + 1)
        found = move(field, conditions, legs, yaws)
        assert isinstance(found, Motion)
        return found

    motion = drive([come, go])
    k = int(np.hypot(motion.x - place[0], motion.y - place[1]).argmin())
    np.testing.assert_allclose((motion.x[k], motion.y[k]), place, atol=1e-9)
    assert motion.speed[1:-1].min() > 0.0
    assert motion.speed[k] > 0.8 * conditions.model.vehicle.limits.speed
    stopping = sum(energy_of(field, conditions, drive([leg])) for leg in (come, go))
    straight = drive([np.array([come[0], 2.0 * place - come[0]])])
    least = energy_of(field, conditions, straight)
    assert least - 1e-3 * least < energy_of(field, conditions, motion) < stopping


@pytest.fixture(scope="module")
def coarse():
    """Field and conditions of rough hills with cells of 60 m."""
    heights = 20.0 * hills(96, cell=3.0, rms_degrees=3.0, seed=4)
    situation = case_of("test", ASKED, terrain(heights, cell=60.0)).situation
    return situation.field("energy"), situation.conditions


@pytest.mark.parametrize("care", [ROUGHLY, CLOSELY])
def test_a_robot_does_not_stop_to_turn_at_bends_that_it_can_drive(coarse, care):
    """Where the yaw is decided at few places, one of them is at each end of a bend."""
    field, conditions = coarse
    x, y = np.linspace(400.0, 5000.0, 24), np.linspace(500.0, 4600.0, 24)
    y[1:-1] += 60.0 * (-1.0) ** np.arange(1, 23)
    path, yaws = np.column_stack([x, y]), [None, None]
    motion = move(field, conditions, [path], yaws, care=care, checked=False)
    assert isinstance(motion, Motion)
    assert motion.speed[1:-1].min() > 0.0


def test_a_turn_on_the_spot_takes_no_longer_on_coarse_cells(coarse):
    """Beside the turn itself it costs the time to slow down and to speed up, on long steps as well.

    From v to rest and back at a constant a takes 2 v/a instead of v/a for the same metres.
    """
    field, conditions = coarse
    limits = conditions.model.vehicle.limits
    ends = np.array([[600.0, 600.0], [900.0, 600.0]])
    kinematics = {"speed": limits.speed, "acceleration": limits.acceleration}
    track = lay_track(field, [ends], spacing=6.0, **kinematics)
    turned = np.where(np.arange(len(track.points)) >= len(track.points) // 2, 0.5 * np.pi, 0.0)
    taken = []
    for leaving in (np.zeros_like(turned), turned):
        arriving = np.append(leaving[:1], leaving[:-1])
        roomy, yaw = room_to_move(track, YawProfile(arriving, leaving, 0.0), **kinematics)
        assert roomy.lengths.sum() == pytest.approx(300.0)
        np.testing.assert_allclose(roomy.points[list(roomy.marks)], ends)
        fastest = np.full(len(roomy.lengths), limits.speed)
        hardest = np.full((len(roomy.lengths), 2), limits.acceleration)
        speeds, _ = speed_profile(
            *(conditions.hurried, roomy, yaw, steps_of(field, roomy)),
            *(CLOSELY.speeds, CLOSELY.levels, fastest, hardest),
        )
        motion = assemble(field, roomy, yaw, speeds, yaw_rate=limits.yaw_rate, spacing=6.0)
        taken.append(motion.time[-1])
    ramp = 0.5  # s to the full yaw rate, and as much to stop
    turn = 0.5 * np.pi / limits.yaw_rate + ramp
    lost = taken[1] - taken[0] - turn
    assert (
        0.9 * limits.speed / limits.acceleration < lost < 1.5 * limits.speed / limits.acceleration
    )
