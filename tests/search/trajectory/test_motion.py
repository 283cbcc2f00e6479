"""A motion's rows account for all of its time and way, and its stations ride on the ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.search.field import sample_surface
from planner.search.results.finer_poses import poses_every
from planner.search.trajectory.drive import move
from planner.search.trajectory.motion import Motion, joined, motion_rows
from tests.benchmarks.peers.case import case_of
from tests.search.maps import hills, terrain


@pytest.fixture(scope="module")
def driven():
    """Field, circumstances and a motion with a bend across hills."""
    asked = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 14.0, "y": 12.0}}
    case = case_of("test", asked, terrain(hills(64, rms_degrees=4.0)))
    conditions = case.situation.conditions
    path = np.array([[3.0, 4.0], [9.0, 5.0], [14.0, 12.0]])
    motion = move(case.field, conditions, [path], [None, None])
    assert isinstance(motion, Motion)
    return case.field, conditions, motion


def test_rows_add_up_to_the_duration_and_to_the_length(driven) -> None:
    field, conditions, motion = driven
    rows, seconds, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind)
    assert seconds.sum() == pytest.approx(motion.time[-1])
    steps = np.bincount(owner, weights=seconds, minlength=len(motion.time) - 1)
    np.testing.assert_allclose(steps, np.diff(motion.time), rtol=1e-9)
    # Speed in the time it is driven is the length of the surface between the stations.
    apart = np.diff(np.column_stack([motion.x, motion.y, motion.heights]), axis=0)
    speed = np.hypot(rows[:, INDEX["vx"]], rows[:, INDEX["vy"]])
    assert speed @ seconds == pytest.approx(np.sqrt((apart**2).sum(axis=1)).sum(), rel=1e-9)
    # And yaw rate in time is the turn.
    turned = rows[:, INDEX["wz"]] @ seconds
    assert turned == pytest.approx(motion.yaw[-1] - motion.yaw[0], abs=1e-9)


def test_samples_lie_on_the_surface_from_rest_to_rest(driven) -> None:
    field, _, motion = driven
    heights, _ = sample_surface(field, np.column_stack([motion.x, motion.y]))
    np.testing.assert_allclose(motion.heights, heights)
    assert motion.speed[[0, -1]].tolist() == [0.0, 0.0]
    assert (np.diff(motion.time) > 0.0).all()


@pytest.mark.parametrize("corner", [(9.0, 4.0), (9.0, 9.0)])
def test_rows_move_as_the_poses_on_the_arcs_of_bends(corner) -> None:
    """Chords of the same bends turn the travel by some degrees at once."""
    asked = {"start": {"x": 3.0, "y": 4.0}, "goal": {"x": 9.5, "y": 12.0}}
    case = case_of("test", asked, terrain(np.zeros((64, 64))))
    conditions = case.situation.conditions
    path = np.array([[3.0, 4.0], corner, [9.5, 12.0]])
    motion = move(case.field, conditions, [path], [None, None])
    inputs = case.field, motion, conditions.class_rows, conditions.wind
    rows, _, _ = motion_rows(*inputs, on_arcs=True)
    poses = poses_every(motion, 1e-3)
    apart = np.hypot(np.diff(poses["x"]), np.diff(poses["y"]))
    travel = np.unwrap(np.arctan2(np.diff(poses["y"]), np.diff(poses["x"]))[apart > 1e-6])
    then = (0.5 * (poses["t"][1:] + poses["t"][:-1]))[apart > 1e-6]
    time = rows[:, INDEX["time_since_start"]]
    yaw = np.interp(time, poses["t"], poses["yaw"])
    found = yaw + np.arctan2(rows[:, INDEX["vy"]], rows[:, INDEX["vx"]])
    off = np.remainder(found - np.interp(time, then, travel) + np.pi, 2.0 * np.pi) - np.pi
    fast = np.hypot(rows[:, INDEX["vx"]], rows[:, INDEX["vy"]]) > 0.1
    bent = np.abs(np.diff(np.unwrap(motion.arcs.direction))).max()
    assert np.abs(off[fast]).max() < 0.1 * bent


def test_joined_motions_take_the_time_of_both_and_never_jump_in_yaw(driven) -> None:
    _, _, motion = driven
    turned = 4.0 * np.pi + motion.yaw[-1] - motion.yaw[0]
    after = replace(motion, yaw=motion.yaw + turned)
    both = joined([motion, after])
    assert len(both.x) == 2 * len(motion.x) - 1
    assert both.time[-1] == pytest.approx(2.0 * motion.time[-1])
    assert np.abs(np.diff(both.yaw)).max() <= np.abs(np.diff(motion.yaw)).max() + 1e-9
