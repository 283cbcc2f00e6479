"""Errors: one sentence each, the same in another process."""

from __future__ import annotations

import pickle

import pytest

from planner.errors import InputError, MapError, RequestError, short


def test_a_sentence_names_field_problem_value_and_what_would_do() -> None:
    error = RequestError("start.x", "is beyond the map", value=41.5, accepted="0 to 40")
    assert str(error) == "start.x: is beyond the map (got 41.5); accepted: 0 to 40"
    assert "got" not in str(RequestError("start", "is missing", accepted="x and y in m"))


@pytest.mark.parametrize(
    "value", ["x" * 5000, list(range(5000)), 10**5000], ids=["text", "list", "number"]
)
def test_a_value_of_any_size_stays_short(value: object) -> None:
    assert len(short(value)) <= 80
    assert len(str(InputError("here", "is too large", value=value, accepted="less"))) < 150


def test_an_error_crosses_to_another_process() -> None:
    error = MapError("map", "has no heights", value=(3, 4), accepted="a heightmap")
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is MapError
    assert str(back) == str(error)
    assert (back.field, back.value, back.accepted) == ("map", (3, 4), "a heightmap")
