"""Odd geometry: equal and close places, huge and tiny cells, maps of few cells, holes."""

from __future__ import annotations

import pytest

from tests.benchmarks.odd_requests import outcome, questions

QUESTIONS = list(questions(24, seed=1))


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """What the first answer compiles is no part of its time."""
    for question in QUESTIONS[:8]:
        outcome(question)


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question[0])
def test_an_odd_request_gets_an_answer_or_a_sentence_in_time(question):
    _, wrong = outcome(question)
    assert wrong == ""
