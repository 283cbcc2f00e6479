"""A member that lowers no error on runs left out goes; one that does stays."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.power.model import PowerModel
from planner.telemetry.holdout.heldout import heldout_rmse
from planner.telemetry.selection.backward_elimination import without_unsupported
from planner.telemetry.selection.selection_loop import investigate
from planner.telemetry.terms import Addition, fit_with
from tests.power.states import changed
from tests.telemetry.rows import measured


def heard_by_nobody(_share, _what):
    """No progress is shown."""


@pytest.fixture(scope="module")
def scrubbing(motion, base):
    """What is found on the log of a robot that scrubs when it turns."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    log = measured(motion, changed(robot, yaw_scrub__scrub_moment=3.0), 0.02, seed=1)
    return investigate(log, base, (), heard_by_nobody)


@pytest.mark.parametrize("idle", ["air_drag", "gear_asymmetry"])
def test_an_effect_that_is_not_there_goes_and_the_true_one_stays(scrubbing, idle):
    ranked = next(s for s in scrubbing.selection.ranking if s.name == idle)
    library = scrubbing.examination.competitors.library
    extra = Addition.of(library, ranked.member.term, ranked.coefficients)
    additions = (extra, *scrubbing.additions)
    library = scrubbing.examination.competitors.library
    fitted = fit_with(
        scrubbing.origin,
        scrubbing.log,
        additions,
        noise=scrubbing.examination.noise,
        within=library.model,
    )
    members = (ranked.member, *scrubbing.selection.members)
    both = replace(
        scrubbing,
        selection=replace(scrubbing.selection, members=members),
        additions=additions,
        fitted=fitted,
    )
    left = without_unsupported(both, heard_by_nobody)
    assert [m.name for m in left.selection.members] == ["yaw_scrub"]
    assert left.additions == scrubbing.additions
    assert heldout_rmse(left.log, left.fitted) <= 1.002 * heldout_rmse(both.log, both.fitted)


def test_a_single_member_is_left_to_the_report(scrubbing):
    assert without_unsupported(scrubbing, heard_by_nobody) is scrubbing
