"""A claim stays where no other search, and no other reading of the motion, speaks against it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.reconcile import beyond_noise, confirmed, outdone, undisputed
from planner.telemetry.diagnosis.unexplained import Unexplained
from planner.telemetry.prediction import predict
from planner.telemetry.selection import Member
from tests.telemetry.rows import base_model

NOTHING: Any = SimpleNamespace()
"""A fit that no test looks at."""


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


def test_a_search_that_can_only_mean_the_same_effect_disputes_nothing(motion, search):
    """It names none because less than half of what is left goes with it, not because of a rival."""
    one, undecided = named(motion, 1.05, "wear"), replace(named(motion, 1.05), alike=("wear",))
    assert undisputed(search, one, undecided) is one


def test_of_two_searches_that_name_other_effects_unseen_runs_may_choose(motion):
    """The one that they support against the other; neither where they tell no difference."""
    one, other = named(motion, 1.5, "wear", "stiction"), named(motion, 1.5, "air_drag")
    worse = replace(other, answer=replace(other.answer, left=1.1 * other.answer.left))
    assert outdone(motion, worse, one)
    assert not outdone(motion, one, worse)
    assert not outdone(motion, one, other)
    assert not outdone(motion, other, one)
    # Where one of them names nothing, that alone does not speak for the other.
    assert not outdone(motion, named(motion, 1.5), one)


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


def usual(motion: Any, left: float) -> Any:
    """A search in the usual reading, in which a claim that is fitted leaves an error."""
    signs = np.where(np.arange(len(motion)) % 2, 1.0, -1.0)
    return SimpleNamespace(
        log=motion,
        refit=lambda additions: NOTHING,
        left_beside_base=lambda fitted: None,
        heldout=lambda fitted: left * signs,
    )


def test_a_claim_needs_the_usual_reading(motion, search):
    """Its search makes the same claim, or its held-out runs support it: either will do."""
    claim = named(motion, 1.5, "stiction")
    fits, fails = usual(motion, 1.0), usual(motion, 1.59)
    others = {
        "the same": (fails, named(motion, 1.6, "stiction"), True),
        "one that looks the same": (fails, named(motion, 1.6, "wear", wear=("stiction",)), True),
        "among more": (fails, named(motion, 1.6, "stiction", "wear"), True),
        "another": (fails, named(motion, 1.6, "wear"), False),
        "none": (fails, named(motion, 1.6), False),
        "none, but it fits": (fits, named(motion, 1.6), True),
        "another, but it fits": (fits, named(motion, 1.6, "wear"), True),
    }
    for what, (other, decision, stays) in others.items():
        found = confirmed(search, claim, [(other, decision)])
        assert found.answer.claims == stays, what
        assert found.alike == (() if stays else ("stiction",)), what
        assert not found.complete, what
    # Nothing is claimed without one.
    nothing = named(motion, 1.6)
    assert confirmed(search, nothing, [(fits, claim)]) is nothing


@dataclass(frozen=True)
class NoisySearch:
    """A search whose model misses 1 W of noise, an effect, and what noise of the motion makes."""

    log: Any
    effect_w: float
    motion_w: float
    base: Any
    corrections: Any = field(default_factory=dict)

    def refit(self, additions: Any) -> bool:
        return bool(additions)

    def left_beside_base(self, claimed: bool) -> None:
        return None

    def heldout(self, claimed: bool) -> Any:
        variance = 2.0 if self.log.source == "noisier" else 1.0
        taken = 0.0 if claimed else self.effect_w**2 + variance * self.motion_w**2
        scatter = np.random.default_rng(4).standard_normal(len(self.log))
        return np.sqrt(1.0 + taken) * scatter


def test_a_claim_must_not_live_on_noise_of_the_motion(motion):
    """What it takes off by noise alone is twice as much where the noise's variance is."""
    copies = [replace(motion, source="noisier")] * 2
    watts = predict(base_model(), motion)
    cases = [(0.5, 0.0, 1.0, True), (0.4, 0.4, 1.0, True), (0.0, 0.5, 1.0, False)]
    cases += [(0.05, 0.5, 1.0, False)]
    cases += [(0.0, 0.5, 0.0, True)]  # noise does nothing to the prediction: nothing to take back
    for effect, noise, scattered, stays in cases:
        base = SimpleNamespace(model=base_model(), watts=watts + scattered)
        search: Any = NoisySearch(motion, effect, noise, base)
        before, floor = search.heldout(False), np.ones(len(motion))
        claim = Answer(NOTHING, search.heldout(True), (Member("wear", (0,)),), (NOTHING,))
        decision = Decision(claim, before, floor, Unexplained(1.0), None, (), (), "")
        found = beyond_noise(search, decision, copies)
        assert found.answer.claims == stays, (effect, noise)
        assert found.complete != stays, (effect, noise)
        nothing = replace(decision, answer=Answer(NOTHING, before))
        assert beyond_noise(search, nothing, copies) is nothing
