"""What a moved path takes with the driving it had, against driving that is found anew."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.results import energy_of
from planner.search.trajectory.drive import ROUGHLY, move, moved_alike
from planner.search.trajectory.motion import Motion
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
        found = move(field, conditions, [path], yaws, objective=0, care=ROUGHLY, checked=False)
        assert isinstance(found, Motion)
        return found

    return field, conditions, drive


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
