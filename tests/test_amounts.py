"""Amounts as people read them: what was meant, no rounding noise, zero without a minus."""

from __future__ import annotations

import pytest

from planner.amounts import (
    chance,
    coordinates,
    estimate,
    joules,
    metres,
    number,
    seconds,
    share,
    signed,
    watts,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0.0 J"),
        (-0.01, "0.0 J"),
        (812.04, "812.0 J"),
        (-13.0, "-13.0 J"),
        (1118.4, "1,118 J"),
        (12_340.0, "12.34 kJ"),
        (432_000.0, "432.00 kJ"),
        (1_240_000.0, "1.24 MJ"),
        (-25_000.0, "-25.00 kJ"),
    ],
)
def test_joules(value: float, text: str) -> None:
    assert joules(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(42.0, "42.0 s"), (185.0, "3 min 05 s"), (8040.0, "2 h 14 min"), (3599.9, "1 h 00 min")],
)
def test_seconds(value: float, text: str) -> None:
    assert seconds(value) == text


def test_metres_and_no_sign_of_rounding() -> None:
    assert (metres(12.3), metres(1204.2)) == ("12.30 m", "1,204 m")
    assert (seconds(-1e-9), metres(-1e-9)) == ("0.0 s", "0.00 m")


@pytest.mark.parametrize(
    ("probability", "text"),
    [
        (0.5, "50 %"),
        (0.974, "97 %"),
        (0.994, "99.4 %"),
        (0.006, "0.6 %"),
        (0.9996, "99.96 %"),
        (1.0, "over 99.99 %"),
        (0.0, "under 0.01 %"),
    ],
)
def test_chance(probability: float, text: str) -> None:
    """Nothing short of certain is called certain."""
    assert chance(probability) == text


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (watts(-1.4e-14), "0.000 W"),
        (watts(-0.041), "-0.041 W"),
        (signed(-1.4e-14), "+0.000 W"),
        (signed(-0.041), "−0.041 W"),
        (share(-1e-17), "0.0 %"),
        (share(-0.02), "-2.0 %"),
        (estimate(-1.4e-14, 0.01, "m²"), "0 ± 0.01 m²"),
        (estimate(0.2213, 0.0041, "m²"), "0.2213 ± 0.0041 m²"),
        (estimate(0.0123, 0.5, "1"), "0.0123 ± 0.5"),
        # Without an error there is nothing to measure it by.
        (number(1.4e-14), "1.4e-14"),
        (number(1.4e-14, float("nan")), "1.4e-14"),
    ],
)
def test_what_the_digits_do_not_show_is_zero(said: str, expected: str) -> None:
    assert said == expected


def test_a_place_is_written_in_full_on_a_projected_map():
    assert coordinates(2.0, 17.5) == "2, 17.5"
    assert coordinates(20000.0, -0.001) == "20000, 0"
    assert coordinates(712034.504, 4051234.0) == "712034.5, 4051234"
