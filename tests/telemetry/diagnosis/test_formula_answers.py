"""Which effects stand beside a formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.diagnosis.formula_answers import formula_of_shape, without_effects
from planner.telemetry.selection import Found
from planner.telemetry.selection.selection_loop import investigate
from tests.power.states import changed
from tests.telemetry.rows import measured


def hunting(motion, robot, base) -> Found:
    """A search of the log of a robot whose servo hunts in slow turns, with 3 W."""
    rate = np.abs(motion.rows[:, INDEX["wz"]]) / 0.25
    log = measured(motion, robot, 0.02, seed=3, extra=3.0 * rate * np.exp(1.0 - rate))
    return investigate(log, base, (), lambda _share, _what: None)


@pytest.fixture(scope="module")
def both(motion, base) -> Found:
    """Scrub that is there, beside the servo."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    return hunting(motion, changed(robot, yaw_scrub__scrub_moment=3.0), base)


def names(answer) -> set[str]:
    assert answer is not None
    assert answer.proposal is not None
    assert {a.declaration.slug for a in answer.additions} == {m.name for m in answer.members}
    return {member.name for member in answer.members}


def test_an_effect_that_is_there_stays_beside_a_formula(both):
    """The search also selects one that is not."""
    floor = np.full(len(both.log), both.base.noise.floor_w)
    first = formula_of_shape(both)
    assert names(first) > {"yaw_scrub"}
    assert names(without_effects(both, first, floor)) == {"yaw_scrub"}


def test_an_effect_that_is_not_there_does_not_stay(motion, base, both):
    """A servo alone, and scrub that was selected before the formula."""
    alone = hunting(motion, base, base)
    shape = replace(alone.selection.shape, alone=False)
    selection = replace(alone.selection, members=both.selection.members, shape=shape)
    biased = replace(alone, selection=selection, additions=both.additions)
    floor = np.full(len(alone.log), alone.base.noise.floor_w)
    first = formula_of_shape(biased)
    assert names(first) >= {"yaw_scrub"}
    assert not names(without_effects(biased, first, floor))


def test_what_looks_like_an_effect_stays_beside_it(both):
    near = replace(both.selection.shape, near=("yaw_scrub",))
    looking = replace(both, selection=replace(both.selection, shape=near))
    first = formula_of_shape(looking)
    floor = np.full(len(both.log), both.base.noise.floor_w)
    assert without_effects(looking, first, floor) is first
    assert without_effects(both, None, floor) is None
