"""Advice says what a drive would add to a log, and names a drive only where that is enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.diagnosis.advice.experiments import (
    CLEARLY,
    HALVED,
    Advice,
    Question,
    left_after,
)
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, Examination, examine
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.selection.select_effects import select
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured

NOISE = 0.02


def examined(log: Telemetry, base) -> Examination:
    fitted = fit(log, base)
    return examine(log, DesignColumns(candidate_library(fitted.model, log), Dictionary.of(log)))


@pytest.fixture(scope="module")
def advice(motion, base) -> Advice:
    log = measured(motion, base, NOISE, seed=2)
    examination = examined(log, base)
    return Advice(examination, select(examination), log)


def test_of_each_drive_the_longer_tells_more(advice: Advice) -> None:
    drives: dict[tuple, list] = {}
    for option in advice.options:
        # Once with a load and once without, or warm and cold, whatever the number of runs.
        loads = frozenset((run["payload"], run["motor_temp"]) for run in option.runs)
        drives.setdefault((option.drive.words, loads), []).append(option)
    log = advice.examination.evidence.total
    for options in drives.values():
        minutes = [option.minutes for option in options]
        assert minutes == sorted(minutes)
        told = [np.diag(o.gram)[: advice.examination.competitors.tangent] for o in options]
        assert np.all(told[0] >= np.diag(log)[: len(told[0])] * (1.0 - 1e-9))
        for less, more in zip(told, told[1:], strict=False):
            assert np.all(more >= less * (1.0 - 1e-6))


def test_the_robot_carries_what_it_has_carried(motion, base) -> None:
    rows = motion.rows.copy()
    heaviest = round(0.5 * base.vehicle.mass, 1)
    rows[: len(rows) // 2, INDEX["payload"]] = heaviest
    log = measured(replace(motion, rows=rows), base, NOISE, seed=2)
    examination = examined(log, base)
    options = Advice(examination, select(examination), log).options
    assert {run["payload"] for o in options for run in o.runs} == {0.0, heaviest}


def test_what_an_offset_of_every_run_hides_is_not_counted(advice: Advice) -> None:
    """A run with an unknown offset says nothing of a column that is constant in it."""
    spread = np.array([[1e6, 0.0], [0.0, 0.0]])
    noise = replace(advice.examination.noise, by_run=spread)
    blind = Advice(replace(advice.examination, noise=noise), advice.selection, advice.log)
    constant = np.full((50, 1), 3.0)
    varied = np.linspace(-1.0, 1.0, 50)[:, None]
    shared = np.column_stack([np.ones(50), np.full(50, 20.0)])
    columns = np.column_stack([constant, varied, shared])
    told = blind._of_run(columns.T @ columns, 1)
    assert told[0, 0] == pytest.approx(0.0, abs=1e-3)
    assert told[1, 1] == pytest.approx(float((varied**2).sum()), rel=1e-6)


def test_a_drive_is_named_only_if_it_is_enough(advice: Advice) -> None:
    """Of every answer the promise holds in the sums of the log and the drive together."""
    ranking = [s for s in advice.selection.ranking if not s.member.sensor]
    base = advice.examination.evidence.tangent
    total = advice.examination.evidence.total
    answered = 0
    for ranked in ranking:
        own = np.array(ranked.member.columns)
        question = Question((ranked.name,), ((ranked, ()),), narrower=True)
        best = advice._best(question)
        if best is None:
            continue
        answered += 1
        option = next(o for o in advice.options if o.sentence == best.run)
        before, after = (
            np.diag(np.linalg.pinv(left_after(g, base, own), hermitian=True))
            for g in (total, option.gram)
        )
        assert np.all(before >= HALVED**2 * after * (1.0 - 1e-6))
        assert best.gain >= np.log2(HALVED) - 0.01
        faster = [
            o
            for o in advice.options
            if np.min(advice._certainty(o.gram, question) / advice._certainty(total, question))
            >= HALVED
        ]
        assert best.minutes <= max(o.minutes for o in faster) + 0.1
    assert answered > 0


def test_twins_that_do_the_same_get_no_drive(advice: Advice) -> None:
    ranked = advice.selection.ranking[0]
    question = Question(("one", "other"), ((ranked, ranked.member.columns),))
    assert np.all(advice._certainty(advice.options[-1].gram, question) < CLEARLY)
    assert advice._best(question) is None
