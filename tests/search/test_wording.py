"""What people read is the number that was meant."""

import pytest

from planner.search.wording import (
    chance,
    extra_cost,
    extra_share,
    joules,
    metres,
    seconds,
    width_from,
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


def test_metres() -> None:
    assert (metres(12.3), metres(1204.2)) == ("12.30 m", "1,204 m")


@pytest.mark.parametrize(
    ("energy", "best", "text"),
    [
        (246.0, 200.0, "costs 23 % more"),
        (204.0, 200.0, "costs 2.0 % more"),
        (200.05, 200.0, "costs the same"),
        (150.0, 200.0, "costs 25 % less"),
        # Downhill with recovery the best route gives energy back: no share of it makes sense.
        (50.0, -100.0, "costs 150.0 J more"),
    ],
)
def test_extra_cost(energy: float, best: float, text: str) -> None:
    assert extra_cost(energy, best) == text


@pytest.mark.parametrize(
    ("energy", "best", "text"),
    [
        (246.0, 200.0, "+23 %"),
        (204.0, 200.0, "+2.0 %"),
        (150.0, 200.0, "-25 %"),
        (50.0, -100.0, "+150.0 J"),
    ],
)
def test_extra_share(energy: float, best: float, text: str) -> None:
    assert extra_share(energy, best) == text


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


def test_where_the_width_comes_from() -> None:
    parts = [
        {"effect": "wheel_rolling", "parameter": "rolling", "share_of_variance": 0.61},
        {"effect": "noise", "parameter": "one drive", "share_of_variance": 0.3},
        {"effect": "yaw_scrub", "parameter": "scrub_moment", "share_of_variance": 0.09},
    ]
    titles = {"wheel_rolling": "rolling of the wheels"}
    assert width_from(parts, titles, 2) == (
        "rolling of the wheels (rolling) 61 %, noise of one drive 30 %"
    )
    assert width_from(parts[2:], {}) == "yaw_scrub (scrub moment) 9 %"


def test_rounding_errors_have_no_sign() -> None:
    assert seconds(-1e-9) == "0.0 s"
    assert metres(-1e-9) == "0.00 m"
    assert extra_share(200.0 - 1e-9, 200.0) == "+0.0 %"
    assert extra_share(150.0, 200.0) == "-25 %"
