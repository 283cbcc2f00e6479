"""Recovery strategies: each applies where its reason does, and every chain of them ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.limit_places import Infeasible
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve.pipeline import Attempt
from planner.search.solve.recovery.caution import (
    CLEARANCE_PENALTIES,
    PENALISED_PLACES,
    SLOPE_MARGINS,
    first_caution,
    gentler_slopes,
    more_clearance,
    next_caution,
    past_the_place,
)
from tests.search.maps import drawn, hills, terrain

STEEP = Infeasible(6.0, 5.0, "the limit of torque is broken")
WARM = Infeasible(6.0, 5.0, "motors give 1.04 times their continuous torque", limit="torque rms")
TIGHT = Infeasible(6.0, 5.0, "the body touches something", True)


def run_on(relief) -> Run:
    ends = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 9.0, "y": 8.0}}
    request = PlanRequest.from_json({"map": "here", **ends})
    return Run(request, situation_of(request, terrain=relief), silent, CancellationToken())


@pytest.fixture(scope="module")
def open_ground() -> Run:
    return run_on(terrain(hills(48, rms_degrees=2.0)))


@pytest.fixture(scope="module")
def walled() -> Run:
    rows = ["." * 24] * 11 + ["." * 10 + "####" + "." * 10] + ["." * 24] * 12
    return run_on(drawn("\n".join(rows), cell=0.5))


def first_of(run: Run, patient: bool = True):
    field = run.field("energy")
    return first_caution(run, field, "energy", patient=patient), Attempt(field)


def test_a_broken_limit_asks_for_another_place_and_then_for_gentler_slopes(open_ground):
    caution, attempt = first_of(open_ground)
    broken = replace(attempt, infeasible=STEEP)
    for margin in SLOPE_MARGINS:
        for left in range(PENALISED_PLACES, -1, -1):
            assert caution.slope_margins[0] == margin
            assert caution.places_left == left
            caution = next_caution(caution, broken)
    assert caution is None


def test_motors_too_warm_ask_for_paths_past_the_place_and_for_nothing_else(open_ground):
    """Gentler slopes are looked at once, after all of these (test_torque_limits)."""
    caution, attempt = first_of(open_ground)
    at = attempt.field.nodes_at((6.0, 5.0))
    warm = replace(attempt, infeasible=WARM)
    for left in range(PENALISED_PLACES - 1, -1, -1):
        before = caution.factor[at] if caution.factor.size > 1 else 1.0
        caution = next_caution(caution, warm)
        assert (caution.places_left, caution.slope_margins) == (left, SLOPE_MARGINS)
        assert caution.factor[at] == 2.0 * before
    assert next_caution(caution, warm) is None


def test_all_places_of_a_path_get_their_penalty_at_once(open_ground):
    caution, attempt = first_of(open_ground)
    several = replace(STEEP, others=((3.0, 8.0), (8.0, 3.0)))
    factor = past_the_place(caution, replace(attempt, infeasible=several)).factor
    field = attempt.field
    for x, y in several.places:
        assert factor[field.nodes_at((x, y))] == 2.0
    alone = past_the_place(caution, replace(attempt, infeasible=STEEP)).factor
    assert (factor > 1.0).sum() == pytest.approx(3 * (alone > 1.0).sum(), rel=0.1)


def test_the_penalty_is_near_the_place_alone(open_ground):
    caution, attempt = first_of(open_ground)
    factor = past_the_place(caution, replace(attempt, infeasible=STEEP)).factor
    field = attempt.field
    j, i = np.argwhere(factor > 1.0).mean(axis=0)
    assert (field.x0 + i * field.dx, field.y0 + j * field.dy) == pytest.approx((6.0, 5.0), abs=0.2)
    assert (factor > 1.0).sum() < 40
    assert set(np.unique(factor)) == {1.0, 2.0}


def test_want_of_room_asks_for_more_clearance_where_there_are_obstacles(open_ground, walled):
    caution, attempt = first_of(walled)
    tight = replace(attempt, infeasible=TIGHT)
    for penalty in CLEARANCE_PENALTIES[1:]:
        caution = next_caution(caution, tight)
        assert caution.clearance_penalties[0] == penalty
    # The strongest did not do: what is left is less of the slope limit.
    assert next_caution(caution, tight).slope_margins == SLOPE_MARGINS[1:]
    caution, attempt = first_of(open_ground)
    assert more_clearance(caution, replace(attempt, infeasible=TIGHT)) is None


def test_a_route_that_turns_much_asks_for_clearance_and_for_nothing_else(walled):
    caution, attempt = first_of(walled)
    assert more_clearance(caution, attempt) is not None
    assert past_the_place(caution, attempt) is None
    assert gentler_slopes(caution, attempt) is None


def test_a_clearance_penalty_is_in_the_field_unless_the_yaw_is_searched(walled):
    caution, attempt = first_of(walled)
    stronger = more_clearance(caution, attempt)
    assert stronger.field(walled, "energy").factor.max() > 1.0
    assert stronger.unobstructed_field(walled, "energy").factor.max() == 1.0


def test_a_baseline_is_given_up_sooner(open_ground):
    caution, attempt = first_of(open_ground, patient=False)
    broken = replace(attempt, infeasible=STEEP)
    tried = 0
    while caution is not None:
        caution, tried = next_caution(caution, broken), tried + 1
    assert tried < len(SLOPE_MARGINS)
