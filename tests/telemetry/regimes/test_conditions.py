"""Conditions on an axis: their bins are what their words say."""

import numpy as np

from planner.telemetry.quantities_of_motion import AXES
from planner.telemetry.regimes.conditions import conditions_on, refined, within
from tests.telemetry.regimes.drives import drive

AXES_OF_DRIVE, _ = drive()


def test_words_and_bins_select_the_same_rows():
    for name in AXES:
        axis = conditions_on(name, AXES_OF_DRIVE[name])
        for condition, member in zip(axis.sets, axis.member, strict=True):
            np.testing.assert_array_equal(
                condition.holds(AXES_OF_DRIVE[name]), member[axis.code] > 0.0
            )


def test_a_threshold_without_rows_stays():
    """Where the other conditions of a regime let no row through, there is nothing to move it by."""
    slow = within("yaw_rate", None, 0.1, magnitude=True)
    assert refined(slow, np.zeros(0), np.zeros(0)) is slow
    assert refined(slow, np.full(9, np.nan), np.ones(9)) is slow
