"""Poses between the samples of a motion: arcs stay arcs, and kinks become gentle bends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.results.finer_poses import poses_every
from planner.search.trajectory.motion import Motion


def motion_through(points: np.ndarray, speed: np.ndarray, curvature: float) -> Motion:
    """A motion along chords; its speed changes evenly in time."""
    chords = np.hypot(*np.diff(points, axis=0).T)
    half = 0.5 * np.abs(curvature) * chords
    ways = chords if curvature == 0.0 else chords * half / np.sin(np.arcsin(half))
    seconds = 2.0 * ways / (speed[1:] + speed[:-1])
    none = np.zeros(len(chords))
    return Motion(
        points[:, 0],
        points[:, 1],
        np.zeros(len(points)),
        np.linspace(0.0, 1.0, len(points)),
        np.append(0.0, np.cumsum(seconds)),
        speed,
        none + curvature,
        none,
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_chords_of_an_arc_are_driven_on_the_arc(side):
    angles = np.radians(8.0) * np.arange(12)
    points = 2.0 * np.column_stack([np.sin(angles), side * (1.0 - np.cos(angles))])
    poses = poses_every(motion_through(points, np.full(12, 0.8), side / 2.0), 0.01)
    from_centre = np.hypot(poses["x"], poses["y"] - 2.0 * side)
    np.testing.assert_allclose(from_centre, 2.0, rtol=1e-9)
    assert np.diff(poses["t"]).max() <= 0.01 + 1e-12
    ends = [(poses["x"][k], poses["y"][k]) for k in (0, -1)]
    np.testing.assert_allclose(ends, points[[0, -1]], atol=1e-12)


@pytest.mark.parametrize("parts", [2, 3])
def test_parts_of_a_chord_lie_on_the_arc_of_the_whole(parts):
    """Then the direction turns evenly, and the acceleration across is that of the bend."""
    angles = np.radians(8.0) * np.arange(12)
    corners = 2.0 * np.column_stack([np.sin(angles), 1.0 - np.cos(angles)])
    at = np.arange(11 * parts + 1) / parts
    points = np.column_stack([np.interp(at, np.arange(12), column) for column in corners.T])
    poses = poses_every(motion_through(points, np.full(len(points), 0.8), 0.5), 0.01)
    x, y, t = (poses[name] for name in ("x", "y", "t"))
    np.testing.assert_allclose(np.hypot(x, y - 2.0), 2.0, rtol=1e-6)
    direction = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    rate = np.diff(direction) / (0.5 * (np.diff(t)[1:] + np.diff(t)[:-1]))
    np.testing.assert_allclose(0.8 * rate, 0.8**2 / 2.0, rtol=0.01)


def test_speed_and_yaw_change_evenly():
    points = np.column_stack([np.linspace(0.0, 4.0, 5), np.zeros(5)])
    poses = poses_every(motion_through(points, np.array([0, 0.6, 1.0, 0.6, 0]), 0.0), 0.02)
    reached = np.cumsum(np.hypot(np.diff(poses["x"]), np.diff(poses["y"])))
    mean = 0.5 * (poses["speed"][1:] + poses["speed"][:-1])
    np.testing.assert_allclose(np.cumsum(mean * np.diff(poses["t"])), reached, rtol=1e-9)
    np.testing.assert_allclose(poses["yaw"], 0.25 * poses["x"], atol=1e-12)


def test_a_slight_corner_is_rounded_over_half_of_both_steps():
    kink = math.radians(0.4)
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0 + math.cos(kink), math.sin(kink)]])
    poses = poses_every(motion_through(points, np.array([0.5, 1.0, 0.5]), 0.0), 0.002)
    x, y, t = (poses[name] for name in ("x", "y", "t"))
    velocity = np.column_stack([np.diff(x), np.diff(y)]) / np.diff(t)[:, None]
    direction = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    # Over one metre in all, the direction turns evenly by the whole angle.
    assert direction[-1] - direction[0] == pytest.approx(kink, rel=1e-6)
    turn = np.abs(np.diff(direction)) / (0.5 * (np.diff(t)[1:] + np.diff(t)[:-1]))
    assert turn.max() == pytest.approx(kink * 1.0, rel=0.02)
    assert np.abs(y - np.maximum(0.0, (x - 1.0) * math.tan(kink))).max() < 0.25 * kink
