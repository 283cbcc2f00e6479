"""An effect is judged beside the base model's stated parts, not in their place."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.telemetry.estimation import fit
from planner.telemetry.holdout import rms
from planner.telemetry.selection.selection_loop import investigate
from tests.telemetry.rows import measured

ROLLING = ("wheel_rolling", "rolling", 0)


@pytest.fixture(scope="module")
def found(motion, robot, base):
    """A search of a log that lacks nothing."""
    log = measured(motion, robot, 0.02, seed=1)
    return investigate(log, base, (), lambda _share, _what: None)


def with_rolling(fitted, value: float):
    """The fit with another rolling resistance."""
    values = fitted.model.parameters.copy()
    values[fitted.model.parameter_names.index(ROLLING)] = value
    return replace(fitted, model=replace(fitted.model, parameters=values))


def test_a_part_that_is_gone_is_pushed_out_and_others_are_not(found, base):
    place = base.parameter_names.index(ROLLING)
    stated = base.parameters[place]
    assert stated > 0.0
    assert found.pushed_out(found.base) == {}
    assert found.pushed_out(with_rolling(found.base, 0.5 * stated)) == {}
    assert found.pushed_out(with_rolling(found.base, 0.0)) == {place: stated}


def test_a_part_that_is_gone_without_a_claim_is_pushed_out_by_none(found):
    """A robot that rolls more easily than its file says does so whatever else is claimed."""
    alone = replace(found, base=with_rolling(found.base, 0.0))
    assert alone.pushed_out(with_rolling(found.base, 0.0)) == {}
    assert alone.left_beside_base(with_rolling(found.base, 0.0)) is None


def test_with_the_part_back_the_error_is_that_of_a_fit_that_keeps_it(found, base):
    """Whatever a fit without rolling resistance explains, it is judged with it."""
    left = found.left_beside_base(with_rolling(found.base, 0.0))
    place = base.parameter_names.index(ROLLING)
    others = [free for free in found.base.places if free != place]
    kept = fit(found.log, base, free=others, noise=found.examination.noise)
    assert rms(left - found.heldout(kept)) < 0.01 * rms(left)
    assert found.left_beside_base(found.base) is None
