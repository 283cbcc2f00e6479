"""Which answer is given, and when nothing is missing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.telemetry.diagnosis.decision import (
    MOST_OF_EXCESS,
    Answer,
    Decision,
    confirmed,
    stands,
    undisputed,
)
from planner.telemetry.diagnosis.unexplained import Unexplained
from planner.telemetry.selection import Member
from tests.telemetry.diagnosis import synthetic_results as results

NOTHING: Any = SimpleNamespace()
"""A fit that no test looks at."""


@pytest.fixture
def decision() -> Decision:
    """Nothing is claimed, and the error is at the floor."""
    flat = np.ones(10)
    return Decision(Answer(NOTHING, flat), flat, flat, Unexplained(1.0), None, (), (), "")


def test_nothing_is_missing_where_nothing_is_left(decision):
    assert decision.complete
    claim = Answer(NOTHING, np.ones(10), (Member("air_drag", (0,)),))
    assert claim.claims
    changes: list[dict[str, Any]] = [
        {"answer": claim},
        {"unexplained": Unexplained(1.21)},
        {"unexplained": Unexplained(1.0, (results.regime(),))},
        {"alike": ("stiction",)},
    ]
    for change in changes:
        assert not replace(decision, **change).complete, change


def test_a_claim_takes_most_of_what_lies_above_the_floor():
    floor = np.full(1000, 1.0)
    before, near, half, little = (np.full(1000, e) for e in (3.0, 1.19, 2.2, 2.4))
    assert stands(before, near, floor)
    assert 9.0 - 2.2**2 > MOST_OF_EXCESS * 8.0 > 9.0 - 2.4**2
    assert stands(before, half, floor)
    assert not stands(before, little, floor)
    # Near the floor, too: what takes off a little of the little that is left is not the cause.
    near, slightly, nearly = (np.full(1000, e) for e in (1.19, 1.17, 1.02))
    assert not stands(near, slightly, floor)
    assert stands(near, nearly, floor)
    assert stands(near, np.full(1000, 0.9), floor)  # the floor was estimated too high


@pytest.fixture
def search(motion) -> Any:
    """A search of a log whose model leaves a hundredth more than the noise."""
    flat = np.full(len(motion), 10.0)
    return SimpleNamespace(log=motion, base=SimpleNamespace(watts=flat))


def named(motion: Any, error: float, *names: str, **aliases: tuple[str, ...]) -> Decision:
    """A decision that names effects, where the model alone leaves an error."""
    signs = np.where(np.arange(len(motion)) % 2, 1.0, -1.0)
    members = tuple(Member(name, (0,)) for name in names)
    answer = Answer(NOTHING, signs, members, aliases=aliases)
    left = Unexplained(1.0)
    return Decision(answer, error * signs, np.ones(len(motion)), left, None, (), (), "")


def test_two_searches_that_name_other_effects_name_none(motion, search):
    one, other = named(motion, 1.05, "wear"), named(motion, 1.05, "stiction")
    left = undisputed(search, one, other)
    assert not left.answer.claims
    assert not left.complete
    assert set(left.alike) == {"wear", "stiction"}
    assert left.unexplained.heldout_over_floor == pytest.approx(1.05)


def test_a_search_that_names_none_of_several_disputes_one_of_them(motion, search):
    undecided = replace(named(motion, 1.05), alike=("wear", "stiction"))
    assert not undisputed(search, named(motion, 1.05, "wear"), undecided).answer.claims


def test_what_two_searches_share_stays(motion, search):
    one = named(motion, 1.05, "wear")
    agreeing = [
        one,
        named(motion, 1.05),  # it found nothing
        named(motion, 1.05, "stiction", stiction=("wear",)),
        named(motion, 1.05, "wear", "stiction"),
    ]
    for other in agreeing:
        assert undisputed(search, one, other) is one


def test_what_lies_well_above_the_noise_is_not_disputed(motion, search):
    one = named(motion, 1.5, "wear")
    assert undisputed(search, one, named(motion, 1.5, "stiction")) is one


def test_a_claim_must_lead_the_better_of_two_models_without_it(motion, search):
    """Around the other model, usual errors explain nearly what the effect does."""
    one, other = named(motion, 1.5, "wear"), named(motion, 1.02)
    poor = replace(one, floor=0.9 * one.floor)
    left = undisputed(search, poor, other)
    assert not left.answer.claims
    assert left.alike == ("wear",)
    assert undisputed(search, poor, other, same_log=False) is poor
    assert undisputed(search, poor, named(motion, 1.4)) is poor


def test_what_one_reading_of_the_motion_shows_alone_is_not_claimed(motion, search):
    claim = named(motion, 1.5, "stiction")
    others = {
        "the same": (named(motion, 1.6, "stiction"), True),
        "one that looks the same": (named(motion, 1.6, "wear", wear=("stiction",)), True),
        "among more": (named(motion, 1.6, "stiction", "wear"), True),
        "another": (named(motion, 1.6, "wear"), False),
        "none": (named(motion, 1.6), False),
    }
    for what, (other, stays) in others.items():
        found = confirmed(search, claim, [other])
        assert found.answer.claims == stays, what
        assert found.alike == (() if stays else ("stiction",)), what
        assert not found.complete, what
    # Nothing is claimed without one.
    nothing = named(motion, 1.6)
    assert confirmed(search, nothing, [claim]) is nothing
