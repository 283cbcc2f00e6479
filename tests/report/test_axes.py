"""Ticks are round numbers, and numbers lie at their pixels."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from planner.report.axes import Axes, nice_ticks, padded, thinned, tick_words
from planner.report.drawing import width_of


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-3.2, 17.0), (0.0, 0.004), (95.0, 96.0)])
def test_ticks_are_round_and_inside(low: float, high: float) -> None:
    ticks = nice_ticks(low, high)
    assert 3 <= len(ticks) <= 11
    assert low - 1e-9 <= min(ticks)
    assert max(ticks) <= high + 1e-9


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-1.4e-14, 80.0, ["0", "20", "40", "60", "80"]),
        (12041.22, 12041.31, ["12041.225", "12041.250", "12041.275", "12041.300"]),
        (-0.00042, 0.0005, ["-0.00025", "0.00000", "0.00025", "0.00050"]),
        (0.0, 1_250_000.0, ["0", "500000", "1000000"]),
    ],
)
def test_ticks_have_the_digits_of_their_step(low: float, high: float, words: list[str]) -> None:
    assert tick_words(nice_ticks(low, high, count=4)) == words


def test_thinning_keeps_both_ends() -> None:
    assert list(thinned(3)) == [0, 1, 2]
    kept = thinned(100_000, most=50)
    assert (kept[0], kept[-1], len(kept)) == (0, 99_999, 50)


def test_numbers_lie_at_their_pixels() -> None:
    axes = Axes(400, 200, (1.0, 3.0), (-5.0, 5.0), inner=(50.0, 10.0, 350.0, 170.0))
    assert axes.x(np.array([1.0, 2.0, 3.0])) == pytest.approx([50.0, 200.0, 350.0])
    # Upwards is less.
    assert axes.y(np.array([-5.0, 0.0, 5.0])) == pytest.approx([170.0, 90.0, 10.0])
    assert axes.points(np.array([1.0, 2.0]), np.array([5.0, 0.0])) == "50.0,10.0 200.0,90.0"


def test_a_line_stays_within_the_frame() -> None:
    axes = Axes(400, 200, (0.0, 1.0), (0.0, 10.0), inner=(0.0, 0.0, 400.0, 200.0))
    line = ElementTree.fromstring(axes.line(np.array([0.0, 0.5, 1.0]), [-3.0, 5.0, 99.0], "k"))
    heights = [float(place.split(",")[1]) for place in line.attrib["points"].split()]
    assert heights == [200.0, 100.0, 0.0]


def test_a_frame_leaves_room_for_long_numbers() -> None:
    short, long = (Axes(400, 200, (0.0, 1.0), (0.0, high)) for high in (8.0, 8e9))
    assert long.left > short.left
    for axes in (short, long):
        assert axes.left > max(width_of(words) for words in axes.y_ticks.values())
        assert axes.left < axes.right <= axes.width
        assert 0.0 < axes.top < axes.bottom < axes.height


def test_padding_takes_both_ends_along() -> None:
    assert padded(0.0, 10.0, share=0.1) == pytest.approx((-1.0, 11.0))
    low, high = padded(5.0, 5.0, least=0.5)
    assert (low, high) == (4.5, 5.5)
