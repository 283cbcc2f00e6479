"""What pydantic complains of is said once, in the user's terms."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from planner.validation import Complaint, accepted_at, as_request_error, first_complaint


class Part(BaseModel):
    """A part of what is asked."""

    model_config = ConfigDict(extra="forbid")
    length: float = Field(gt=0.0, description="metres above 0")


class Asked(BaseModel):
    """What is asked."""

    model_config = ConfigDict(extra="forbid")
    name: str = Field(description="a name")
    parts: tuple[Part, ...] = Field(default=(), description="parts")


def refused(document: Any) -> ValidationError:
    with pytest.raises(ValidationError) as caught:
        Asked.model_validate(document)
    return caught.value


def test_a_misspelt_field_comes_before_the_one_that_is_missing() -> None:
    error = refused({"nmae": "one"})
    assert [complaint["type"] for complaint in error.errors()] == ["missing", "extra_forbidden"]
    first = first_complaint(error.errors())
    assert (first.place, first.kind, first.value) == ("nmae", "extra_forbidden", "one")
    assert str(as_request_error(Asked, error)) == (
        "nmae: no such field, did you mean 'name'?; accepted: an object with name, parts"
    )


@pytest.mark.parametrize(
    ("part", "sentence"),
    [
        ({"length": -1.0}, "parts[1].length: is too small (got -1.0); accepted: metres above 0"),
        ({}, "parts[1].length: is missing; accepted: metres above 0"),
        (
            {"length": 1.0, "lenght": 1.0},
            "parts[1].lenght: no such field, did you mean 'length'?; "
            "accepted: an object with length",
        ),
    ],
)
def test_a_sentence_names_the_place_and_what_it_accepts(part: Any, sentence: str) -> None:
    error = refused({"name": "one", "parts": [{"length": 1.0}, part]})
    assert str(as_request_error(Asked, error)) == sentence


def test_what_is_accepted_is_what_the_field_says_or_all_fields() -> None:
    assert accepted_at(Asked, ("parts", 1, "length")) == "metres above 0"
    assert accepted_at(Asked, ("parts", 1)) == "parts"
    assert accepted_at(Asked, ()) == "an object with name, parts"
    assert accepted_at(Asked, ("nmae",)) == "an object with name, parts"


def test_a_place_is_printable_and_short() -> None:
    assert Complaint(("parts", 1, "length"), "missing", "", None).place == "parts.1.length"
    odd = Complaint(("a\nb", "c" * 100), "missing", "", None).place
    assert odd.startswith("'a\\nb'.ccc")
    assert odd.isprintable()
    assert len(odd) == 80


def test_a_check_of_our_own_is_told_in_its_own_words() -> None:
    error = {"loc": (), "type": "value_error", "msg": "Value error, exactly one is required"}
    assert first_complaint([error]).message == "exactly one is required"
