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
    stands,
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
