"""How bounds on an axis read."""

from __future__ import annotations

import pytest

from planner.telemetry.quantities_of_motion import AXES, FURTHER, STANDSTILL
from planner.telemetry.regimes.words import WORDS, figure_of, heading_words, said


@pytest.mark.parametrize(
    ("axis", "low", "high", "magnitude", "words"),
    [
        ("speed", 0.4, None, False, "faster than 0.4 m/s"),
        ("speed", None, 0.4, False, "slower than 0.4 m/s"),
        ("speed", 0.2, 0.4, False, "at 0.2 to 0.4 m/s"),
        ("speed", STANDSTILL, None, False, "in motion"),
        ("speed", STANDSTILL, 0.4, False, "moving slower than 0.4 m/s"),
        ("speed", None, STANDSTILL, False, "standing still"),
        ("slope_along", 3.0, None, False, "climbing more than 3°"),
        ("slope_along", None, -3.0, False, "descending more than 3°"),
        ("slope_along", -5.0, -3.0, False, "descending 3 to 5°"),
        ("slope_along", 3.0, None, True, "climbing or descending more than 3°"),
        ("yaw_rate", None, 0.2, True, "turning slower than 0.2 rad/s"),
        ("com_x", None, -0.01, False, "with the centre of mass more than 0.01 m back"),
    ],
)
def test_bounds_in_words(
    axis: str, low: float | None, high: float | None, magnitude: bool, words: str
) -> None:
    assert said(axis, low, high, magnitude) == words


def test_every_axis_with_numbers_has_words() -> None:
    axes = {**AXES, **FURTHER}
    assert set(WORDS) == set(axes) - {"heading", "surface"}
    for name, words in WORDS.items():
        # What has a sign says so for both sides, and for the size.
        signed = bool(words.negative and words.size)
        assert signed == axes[name].signed


def test_sectors_without_a_name_list_their_directions() -> None:
    assert heading_words(30, 360, 22.0) == "heading 30° to the left (±22°)"
    assert heading_words(30, 180, 22.0) == "heading 30° to the left or 150° to the right (±22°)"
    three = "heading forward, 120° to the left or 120° to the right (±22°)"
    assert heading_words(0, 120, 22.0) == three


def test_figures_are_written_out() -> None:
    assert figure_of(0.25) == "0.25"
    assert figure_of(1_250_000.0) == "1,250,000"
