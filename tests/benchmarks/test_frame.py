"""OMPL's frame round a search costs next to nothing."""

from __future__ import annotations

import statistics
import time

import pytest

from planner.search.ompl import EnergyProblem, solved
from planner.search.solve import best_route
from tests.search.ompl.problems import ENDS, RELIEF

FRAME_S = 0.005
"""CPU s that state space, problem definition, planner and path may take in one answer."""
RUNS = 21


@pytest.mark.bench
def test_the_frame_takes_at_most_five_milliseconds() -> None:
    run = EnergyProblem(terrain=RELIEF, **ENDS).objective.run
    outcome = best_route(run)
    taken = []
    for _ in range(RUNS):
        begun = time.process_time()
        assert solved(run, lambda _: outcome)[0] is outcome
        taken.append(time.process_time() - begun)
    assert statistics.median(taken) <= FRAME_S
