"""Numbers and TOML from outside: finite, or refused with a reason."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from planner.errors import InputError
from planner.reading import finite_number, parse_toml


@pytest.mark.parametrize(
    "value", [0, -3, 2.5, np.float32(2.5), np.int64(7), Fraction(1, 4), 2**1000]
)
def test_numbers_of_every_kind_are_floats(value: object) -> None:
    number = finite_number(value)
    assert type(number) is float
    assert number == value


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        False,
        "1",
        b"1",
        [1.0],
        {"value": 1},
        1j,
        math.nan,
        math.inf,
        10**400,
        -(10**5000),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_finite_number(value: object) -> None:
    assert finite_number(value) is None


def test_toml_with_and_without_a_byte_order_mark() -> None:
    for start in (b"", b"\xef\xbb\xbf"):
        assert parse_toml(start + "a = 'µ'\r\nb = [1, 2]\r\n".encode()) == {"a": "µ", "b": [1, 2]}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a = [", "end of document"),
        (b"a = '\xff'", "byte 5 is not UTF-8"),
        (b"a = " + b"1" * 5000, "too many digits"),
        (b"a = " + b"[" * 100_000 + b"]" * 100_000, "nested too deeply"),
    ],
    ids=["cut off", "bytes", "digits", "depth"],
)
def test_why_a_text_is_not_toml(content: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        parse_toml(content)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "value",
    [10**400, 10**5000, [10**5000], "x" * 1000],
    ids=["400 digits", "5000 digits", "in a list", "text"],
)
def test_an_error_shows_any_value_in_one_short_sentence(value: object) -> None:
    sentence = str(InputError("field", "is wrong", value=value, accepted="something else"))
    assert sentence.startswith("field: is wrong (got ")
    assert len(sentence) < 150
