"""What is asked beside ground and places: defaults, and refusals that name field and remedy."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import RequestError
from planner.search.requests.questions import PlanRequest
from tests.search.requests.good import GOOD, refused


def test_what_is_left_out_takes_its_default() -> None:
    request = PlanRequest.from_json(GOOD)
    assert request.start.yaw is None
    assert request.goal.yaw == 0.5
    assert request.via == ()
    assert request.payload.mass == 0
    assert (request.objective, request.alternatives, request.seed) == ("energy", 1, 0)
    assert request.time_budget_s == 2.0


def test_a_request_survives_json() -> None:
    request = PlanRequest.from_json({**GOOD, "via": [{"x": 3, "y": 3}], "iterations": 500})
    assert PlanRequest.from_text(request.model_dump_json()) == request


def test_numpy_numbers_are_numbers() -> None:
    assert PlanRequest.from_json({**GOOD, "seed": np.int64(7)}).seed == 7


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"objective": "beauty"}, "objective", '"energy", "time" or "length"'),
        ({"alternatives": 0}, "alternatives", "1 to 5"),
        ({"alternatives": 2.0}, "alternatives", "whole"),
        ({"seed": -1}, "seed", "too small"),
        ({"seed": True}, "seed", "whole"),
        ({"time_budget_s": 0}, "time_budget_s", "too small"),
        ({"time_budget_s": 601}, "time_budget_s", "too large"),
        ({"timebudget": 3}, "timebudget", "did you mean 'time_budget_s'"),
    ],
)
def test_a_refusal_names_the_field_and_what_would_do(
    changes: dict[str, Any], field: str, words: str
) -> None:
    refused(changes, field, words)


def test_a_misspelt_field_is_named_before_the_one_it_leaves_missing() -> None:
    document = {("strat" if key == "start" else key): value for key, value in GOOD.items()}
    with pytest.raises(RequestError, match=r"strat.*did you mean 'start'"):
        PlanRequest.from_json(document)


_json = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(field=st.sampled_from(sorted(PlanRequest.model_fields)), value=_json)
def test_any_json_in_any_field_is_taken_or_refused_with_that_field(field: str, value: Any) -> None:
    refused_for = ""
    try:
        PlanRequest.from_json({**GOOD, "vehicle": None, field: value})
    except RequestError as error:
        refused_for = error.field
    assert refused_for.split(".")[0].split("[")[0] in {"", field, "request"}


def test_checking_a_request_needs_no_planner() -> None:
    script = (
        "import sys, planner.search.requests; print({'numba', 'ompl', 'numpy'} & {*sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "set()"
