"""Explanations fitted in full: what a log gains by an explanation, and what it must not gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import Cancelled
from planner.power.rows import rows_from
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.other_terms import SENSORS, Dictionary
from planner.telemetry.selection.full_refit_comparison import (
    FullFits,
    Refit,
    aliases_of,
    predicting_best_first,
    shown_in,
    simpler_first,
    sizes_of,
    without_idle,
)
from planner.telemetry.selection.select_effects import RankedTerm, select
from planner.telemetry.selection.subset_search import CompetingModel, Member, SubsetScorer
from planner.telemetry.terms import Term, candidate_library
from tests.telemetry.rows import measured, plain_log

NOISE = 0.03


@pytest.fixture(scope="module")
def examined(base):
    """Steady drives of a robot that is as its model says, fitted and summed up."""
    angle = np.repeat(np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False), 50)
    speed = np.repeat(np.tile([0.3, 0.6, 0.9], 4), 50)
    rows = rows_from(vx=speed * np.cos(angle), vy=speed * np.sin(angle))
    log = measured(plain_log([50] * 12, rows), base, NOISE, seed=4)
    fitted = fit(log, base)
    library = candidate_library(fitted.model, log)
    return log, fitted, examine(log, DesignColumns(library, Dictionary.of(log)))


EFFECT = Term("effect", (0,))


def entry(names: str, by_cluster, aliases=None, *, sensor: bool = False, left=()) -> Refit:
    gains = np.asarray(by_cluster, float)
    members = tuple(Member(name, (0,), None if sensor else EFFECT) for name in names)
    score = float(gains.sum())
    return Refit(CompetingModel(members, ()), score, gains, np.asarray(left), aliases or {})


def test_what_explains_as_much_is_a_tie_and_what_trails_in_every_block_is_none():
    even = entry("ab", [10.0] * 20)
    other = entry("ac", 10.0 + np.tile([3.0, -3.0], 10))
    behind = entry("ad", [9.0] * 20)
    assert aliases_of(even, [even, other, behind]) == {"a": (), "b": ("c",)}


@pytest.fixture
def drive():
    """Twelve runs, and an error of 1 W on each row of them."""
    log = plain_log([50] * 12)
    return log, np.where(np.arange(len(log)) % 2, 1.0, -1.0)


def test_unseen_runs_overrule_what_a_likelihood_says(drive):
    """Of those that they support against the likeliest set, the one that predicts them best."""
    log, error = drive
    likeliest = entry("a", [10.0] * 20, left=error)
    better, best = (
        entry("ab", [8.0] * 20, left=0.9 * error),
        entry("cd", [1.0] * 20, left=0.5 * error),
    )
    first, *others = predicting_best_first([likeliest, better, best], log, np.abs(error))
    assert first is best
    assert others == [likeliest, better]


@pytest.mark.parametrize("share", [1.0, 0.97])
def test_a_set_that_predicts_hardly_better_does_not_overrule(drive, share):
    log, error = drive
    entries = [entry("a", [10.0] * 20, left=error), entry("ab", [8.0] * 20, left=share * error)]
    assert predicting_best_first(entries, log, np.abs(error)) == entries


def test_few_runs_do_not_overrule():
    """With four runs each fold is one of them."""
    log = plain_log([150] * 4)
    error = np.where(np.arange(len(log)) % 2, 1.0, -1.0)
    entries = [entry("a", [10.0] * 20, left=error), entry("ab", [8.0] * 20, left=0.5 * error)]
    assert predicting_best_first(entries, log, np.abs(error)) == entries


def test_what_helps_one_run_alone_does_not_overrule(drive):
    log, error = drive
    once = np.where(log.run == 3, 0.01, 1.0) * error
    entries = [entry("a", [10.0] * 20, left=error), entry("ab", [8.0] * 20, left=once)]
    assert predicting_best_first(entries, log, np.abs(error)) == entries


def test_unseen_runs_neither_blame_a_sensor_nor_clear_it(drive):
    log, error = drive
    for first, second in ((True, False), (False, True)):
        one = entry("a", [10.0] * 20, sensor=first, left=error)
        other = entry("b", [8.0] * 20, sensor=second, left=0.5 * error)
        assert predicting_best_first([one, other], log, np.abs(error)) == [one, other]


def test_a_member_is_shown_where_unseen_runs_miss_it(drive):
    log, error = drive
    both, only_a = entry("ab", [9.0] * 20, left=0.5 * error), entry("a", [8.0] * 20, left=error)
    only_b = entry("b", [8.0] * 20, left=0.51 * error)
    entries = [both, only_a, only_b]
    assert shown_in(both, entries, log, np.abs(error)) == {"b"}
    assert shown_in(only_a, entries, log, np.abs(error)) == frozenset()


@pytest.mark.parametrize(("share", "stays"), [(0.8, True), (0.93, False)])
def test_a_further_member_must_predict_much_better_beside_the_selection(drive, share, stays):
    log, error = drive
    spread = np.abs(error)
    pair = entry("ab", [10.0] * 20, left=error)
    triple = entry("abc", [20.0] * 20, left=share * error)
    other = entry("ad", [5.0] * 20, left=error)
    names = frozenset("ab")
    found = without_idle([triple, pair, other], names, [], log, spread)
    assert found == ([triple, pair, other] if stays else [pair, other])
    # What an earlier round had is no new guess.
    assert triple in without_idle([triple, pair], names, [triple.names], log, spread)


def test_what_unseen_runs_show_needs_no_test_on_sums(examined):
    """This robot is as its model says: on the sums nothing is significant."""
    scorer = SubsetScorer(examined[2], exact=True)
    assert scorer.checked((0,))[0] == ()
    assert scorer.checked((0,), shown={scorer.members[0].name})[0] == (0,)
    other = next(k for k, m in enumerate(scorer.members) if m.name != scorer.members[0].name)
    assert scorer.checked((0, other), shown={scorer.members[0].name})[0] == (0,)


def test_size_of_a_member_is_what_the_others_lack_without_it():
    """Gain G over n rows is that of a column of ρ: G = n·ρ²/2."""
    both, alone, nothing = entry("ab", [10.0] * 20), entry("a", [5.0] * 20), np.full(20, 2.0)
    rho = {gain: pytest.approx(np.sqrt(2.0 * gain / 5000)) for gain in (100.0, 60.0)}
    assert sizes_of(both, [both, alone], nothing, 5000) == {"b": rho[100.0]}
    assert sizes_of(alone, [both, alone], nothing, 5000) == {"a": rho[60.0]}


def test_a_contest_is_stopped_between_two_fits(examined):
    """Whoever cancels while explanations are fitted is asked before each of them."""
    log, fitted, examination = examined
    selection = select(examination)
    number = list(SENSORS).index("power_scale")
    scale = Member("power_scale", (examination.competitors.sensor(number),))
    known = (CompetingModel((), ()), CompetingModel((scale,), (np.array([0.01]),)))
    asked: list[int] = []

    def check() -> None:
        asked.append(1)
        if len(asked) == 2:
            raise Cancelled("stop")

    with pytest.raises(Cancelled):
        FullFits(log, fitted, examination, check).compare(selection, known)
    assert len(asked) == 2


@pytest.mark.parametrize(("wrong", "stands"), [(0.0, False), (0.05, True)])
def test_a_sensor_fault_is_named_where_the_log_without_its_error_is_likelier(
    examined, wrong, stands
):
    """What the sums say for it is not enough, once everything is fitted in full."""
    log, fitted, examination = examined
    kind = "heading_misalignment"
    number = list(SENSORS).index(kind)
    turned = Member(kind, (examination.competitors.sensor(number),))
    said = RankedTerm(kind, 500.0, 30.0, 0.0, 1.0, 1.0, turned, np.array([0.05]))
    blamed = replace(select(examination), members=(turned,), ranking=(said,))
    rows = log.rows.copy()
    motion = (rows[:, 0] + 1j * rows[:, 1]) * np.exp(1j * wrong)
    rows[:, 0], rows[:, 1] = motion.real, motion.imag
    fits = FullFits(replace(log, rows=rows), fitted, examination)
    assert fits.confirmed(blamed, kind) is stands


def test_what_is_selected_is_among_the_competitors_however_low_it_scores(examined):
    scorer = SubsetScorer(examined[2], exact=True)
    scorer.admit((0,))
    scorer.admit((1,))
    low = min([(0,), (1,)], key=lambda chosen: scorer.scored[chosen])
    alternatives = scorer.alternatives(low, most=1)
    assert len(alternatives) == 2
    assert alternatives[-1].members == (scorer.members[low[0]],)


@pytest.mark.parametrize(("behind", "first"), [(3.0, "s"), (9.0, "ab")])
def test_one_sensor_comes_before_two_effects_that_are_tied_with_it(behind, first):
    """Unless it is clearly behind, or only one of the effects is tied with it."""
    sensor = entry("s", [-behind], {"s": ()}, sensor=True)
    both = entry("ab", [0.0], {"a": ("s",), "b": ("c", "s")})
    assert simpler_first([both, sensor])[0].names == set(first)
    one = entry("ab", [0.0], {"a": ("s",), "b": ("c",)})
    assert simpler_first([one, sensor])[0] is one
