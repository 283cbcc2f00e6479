"""Which answer is given, and when nothing is missing."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.diagnosis import decision as decision_module
from planner.telemetry.diagnosis import formula_answers
from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.decision import (
    MOST_OF_EXCESS,
    decide,
    stands,
)
from planner.telemetry.diagnosis.unexplained import Unexplained
from planner.telemetry.holdout import heldout_residual, rms, supports
from planner.telemetry.quantities_of_motion import motion_axes
from planner.telemetry.selection import Found, Member, ShapeFound
from planner.telemetry.selection.selection_loop import investigate
from tests.power.states import changed
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.rows import measured

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


@pytest.fixture(scope="module")
def scrubbed(motion, base) -> Found:
    """A search of a robot's log that scrubs in turns."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    robot = changed(robot, yaw_scrub__scrub_moment=3.0)
    log = measured(motion, robot, 0.02, seed=1)
    return investigate(log, base, (), lambda _share, _what: None)


def test_an_effect_that_the_search_overlooked_is_as_unsure_as_another(scrubbed):
    """Data sheet and sensors err beside what held-out runs show as well."""
    found, log = scrubbed, scrubbed.log
    assert [member.name for member in found.selection.members] == ["yaw_scrub"]
    nobody = replace(found.selection, members=(), shape=None)
    overlooked = replace(found, selection=nobody, additions=(), fitted=found.base)
    answer = decide(overlooked, np.full(len(log), found.base.noise.floor_w)).answer
    assert [member.name for member in answer.members] == ["yaw_scrub"]
    place = answer.fit.model.parameter_names.index(("yaw_scrub", "scrub_moment", 0))
    plain, unsure = (found.refit(answer.additions, tried=how).model for how in (False, True))
    for one in (plain, unsure, answer.fit.model):
        assert one.stderr is not None
    assert answer.fit.model.stderr[place] == pytest.approx(unsure.stderr[place], rel=1e-3)
    assert unsure.stderr[place] > 1.1 * plain.stderr[place]


@pytest.mark.parametrize("apart", [True, False])
def test_where_whole_runs_differ_single_effects_are_fitted(scrubbed, monkeypatch, apart):
    """A floor that was estimated beside a strong effect takes it for noise.

    Nothing asks for a trial then, but runs that no column tells apart.
    """
    found, log = scrubbed, scrubbed.log
    monkeypatch.setattr(decision_module, "unexplained_by", lambda *_: Unexplained(1.0))
    shift = rms(found.base.residual) * np.where(log.run % 2, 1.0, -1.0) * apart
    base = replace(found.base, residual=found.base.residual + shift)
    ranking = tuple(replace(ranked, probability=0.0) for ranked in found.selection.ranking)
    nobody = replace(found.selection, members=(), shape=None, ranking=ranking)
    log = replace(log, power=log.power + shift)
    overlooked = replace(found, log=log, selection=nobody, additions=(), base=base, fitted=base)
    before = overlooked.heldout(base)
    decided = decide(overlooked, np.full(len(log), rms(before)))
    assert bool(decided.tried) == apart
    if apart:
        assert decided.tried[0].name == "yaw_scrub"
        assert rms(decided.floor) < 0.8 * rms(before)


@pytest.mark.parametrize(("over_floor", "named"), [(1.3, True), (1.1, False)])
def test_of_the_little_above_the_floor_no_two_effects_are_named(
    motion, base, monkeypatch, over_floor, named
):
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub", "air_drag"))
    robot = changed(robot, yaw_scrub__scrub_moment=3.0, air_drag__drag_area=0.6)
    log = measured(motion, robot, 0.02, seed=1)
    found = investigate(log, base, (), lambda _share, _what: None)
    both = {member.name for member in found.selection.members}
    assert both == {"yaw_scrub", "air_drag"}
    monkeypatch.setattr(decision_module, "unexplained_by", lambda *_: Unexplained(over_floor))
    # One alone does not stand, or it would be named in their place.
    monkeypatch.setattr(decision_module, "fitted_singles", lambda *_: ())
    decided = decide(found, np.full(len(log), found.base.noise.floor_w))
    assert {member.name for member in decided.answer.members} == (both if named else set())
    assert set(decided.alike) == (set() if named else both)
    assert not decided.complete


@pytest.mark.parametrize("by_chance", [True, False])
def test_near_the_floor_an_effect_is_named_where_chance_would_not_do_it(
    motion, base, monkeypatch, by_chance
):
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    robot = changed(robot, yaw_scrub__scrub_moment=0.25)
    log = measured(motion, robot, 0.02, seed=1)
    found = investigate(log, base, (), lambda _share, _what: None)
    assert [member.name for member in found.selection.members] == ["yaw_scrub"]

    def seen(log, before, after, floor, *, chosen=False, **given):
        return not (chosen and by_chance) and supports(log, before, after, floor, **given)

    monkeypatch.setattr(decision_module, "supports", seen)
    floor = np.full(len(log), found.base.noise.floor_w)
    decided = decide(found, floor)
    assert rms(decided.before) < 1.2 * rms(floor)
    assert [member.name for member in decided.answer.members] == ["yaw_scrub"] * (not by_chance)
    assert decided.alike == (("yaw_scrub",) if by_chance else ())
    assert not decided.complete


def test_an_effect_that_a_formula_outdoes_is_not_named(motion, base, monkeypatch):
    """A servo hunts in slow turns: scrub explains some of it, though not as well as the formula.

    Where runs are too few for a formula, scrub is no surer than it was.
    """

    def strictly(log, before, after, floor, *, formula=False, **given):
        return not formula and supports(log, before, after, floor, **given)

    rate = np.abs(motion.rows[:, INDEX["wz"]]) / 0.25
    log = measured(motion, base, 0.02, seed=3, extra=3.0 * rate * np.exp(1.0 - rate))
    found = investigate(log, base, (), lambda _share, _what: None)
    floor = np.full(len(log), found.base.noise.floor_w)
    assert decide(found, floor).answer.proposal is not None
    monkeypatch.setattr(decision_module, "supports", strictly)
    unsure = decide(found, floor)
    assert not unsure.answer.claims
    assert "yaw_scrub" in unsure.alike
    assert not unsure.complete
    # Scrub that would not stand itself is no answer that the formula must beat as clearly.
    before = found.heldout(found.base)

    def against_nothing(log, one, other, floor, *, formula=False, **given):
        alone = np.array_equal(one, before) or not formula
        return alone and supports(log, one, other, floor, **given)

    monkeypatch.setattr(decision_module, "supports", against_nothing)
    for least, claimed in ((0.0, False), (0.9, True)):

        def most(before, after, _, least=least):
            return bool(rms(after) ** 2 < (1.0 - least) * rms(before) ** 2)

        monkeypatch.setattr(decision_module, "stands", most)
        assert (decide(found, floor).answer.proposal is not None) is claimed


@pytest.mark.parametrize(("better", "named"), [(1.0, False), (0.8, True)])
def test_two_effects_chosen_by_their_error_must_lead_a_formula(
    motion, base, monkeypatch, better, named
):
    rate = np.abs(motion.rows[:, INDEX["wz"]]) / 0.25
    log = measured(motion, base, 0.02, seed=3, extra=3.0 * rate * np.exp(1.0 - rate))
    found = investigate(log, base, (), lambda _share, _what: None)
    floor = np.full(len(log), found.base.noise.floor_w)
    formula = decide(found, floor).answer
    assert formula.proposal is not None
    both = Member("yaw_scrub", (0,)), Member("air_drag", (0,))
    pair = Answer(found.base, better * formula.left, both)
    monkeypatch.setattr(decision_module, "best_pair", lambda *_: pair)
    answer = decide(found, floor).answer
    assert answer.members == (both if named else ())
    assert (answer.proposal is None) == named


@pytest.mark.parametrize("certain", [True, False])
def test_two_effects_of_which_the_search_is_certain_need_no_more_than_others(
    motion, base, monkeypatch, certain
):
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub", "air_drag"))
    robot = changed(robot, yaw_scrub__scrub_moment=1.5, air_drag__drag_area=0.3)
    log = measured(motion, robot, 0.02, seed=1)
    found = investigate(log, base, (), lambda _share, _what: None)
    ranking = tuple(
        one if certain else replace(one, probability=min(one.probability, 0.5))
        for one in found.selection.ranking
    )
    nobody = replace(found.selection, members=(), shape=None, ranking=ranking)
    overlooked = replace(found, selection=nobody, additions=(), fitted=found.base)

    def too_few_runs_for_a_formula(log, before, after, floor, *, formula=False, **given):
        return not formula and supports(log, before, after, floor, **given)

    monkeypatch.setattr(decision_module, "supports", too_few_runs_for_a_formula)
    answer = decide(overlooked, np.full(len(log), found.base.noise.floor_w)).answer
    named = {member.name for member in answer.members}
    assert (named == {"yaw_scrub", "air_drag"}) is certain


def fan_in_runs(motion, base, watts: float) -> tuple[Found, np.ndarray]:
    """A search that selected nothing of a fan that lasts for runs, and a floor that holds it."""
    temperature = motion_axes(motion.rows)["temperature"]
    fan = watts * (temperature > np.nanmedian(temperature))
    log = measured(motion, base, 0.02, seed=11, extra=fan)
    found = investigate(log, base, (), lambda _share, _what: None)
    nobody = replace(found.selection, members=(), shape=None)
    overlooked = replace(found, selection=nobody, additions=(), fitted=found.base)
    return overlooked, np.full(len(log), rms(found.heldout(found.base)) / 1.1)


def test_a_floor_that_holds_slow_power_hides_no_formula(motion, base, monkeypatch):
    """A fan that lasts for runs looks like slow noise, to the floor and to regimes as well."""
    asked_for = []

    def propose(examination, axis, *_):
        asked_for.append(axis)
        raise InterruptedError

    monkeypatch.setattr(formula_answers, "propose", propose)
    monkeypatch.setattr(decision_module, "unexplained_by", lambda *_: Unexplained(1.1))
    for watts in (0.0, 1.0):
        overlooked, floor = fan_in_runs(motion, base, watts)
        with pytest.raises(InterruptedError) if watts else nullcontext():
            decide(overlooked, floor)
        assert asked_for == (["temperature"] if watts else [])


def test_what_is_too_unsure_for_a_formula_is_more_than_noise(motion, base, monkeypatch):
    """A fan that lasts for runs: where they are too few for a formula, the model lacks it still.

    Regimes take it for slow noise, as the floor does.
    """

    def effects_alone(*given, formula=False, **further):
        return not formula and supports(*given, **further)

    def over(_, left, floor, *__):
        return Unexplained(rms(left) / rms(floor))

    monkeypatch.setattr(decision_module, "supports", effects_alone)
    monkeypatch.setattr(decision_module, "unexplained_by", over)
    for watts in (0.0, 1.0):
        overlooked, floor = fan_in_runs(motion, base, watts)
        decided = decide(overlooked, floor)
        assert not decided.answer.claims
        assert decided.complete is not bool(watts)
        assert (rms(decided.floor) < 0.8 * rms(floor)) is bool(watts)


def test_a_claim_adds_nothing_to_rows_far_out(scrubbed, monkeypatch):
    """Scrub explains most rows; one in 200 would be predicted much worse by who adopts it."""
    spread = scrubbed.base.noise.floor_w

    def with_outliers(log, fitted):
        residual = heldout_residual(log, fitted)
        residual[::200] = (20.0 if fitted is scrubbed.base else 40.0) * spread
        return residual

    monkeypatch.setattr(decision_module, "heldout_residual", with_outliers)
    unsure = decide(scrubbed, np.full(len(scrubbed.log), spread))
    assert not unsure.answer.claims
    assert unsure.alike == ("yaw_scrub",)


def test_a_formula_beside_effects_is_more_than_the_misfit_of_their_form():
    """Of 10 W that effects take off, their form may well miss a fifth, and leave 1 % of squares."""
    shape = ShapeFound(0, 0, 9.0, 1.0, False, ())
    assert not shape.weighs(100.0, 3.9)
    assert shape.weighs(100.0, 4.1)
