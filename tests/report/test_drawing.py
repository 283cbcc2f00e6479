"""Drawings: their words fit, and several of them stand beside each other."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import pytest

from planner.report.drawing import beside, chart, short, shortened, size_of, text, width_of


def test_a_drawing_tells_its_size_and_its_title() -> None:
    drawing = chart(320.0, 80.0, text(1, 2, "a < b"), "A & B", "c > d")
    assert size_of(drawing) == (320, 80)
    root = ElementTree.fromstring(drawing)
    assert (root.findtext("title"), root.findtext("desc")) == ("A & B", "c > d")
    assert root.findtext("text") == "a < b"


def test_drawings_beside_each_other_do_not_overlap() -> None:
    sizes = [[(100, 40), (80, 30)], [(60, 90)], [(50, 10), (50, 10), (50, 10)]]
    columns = [[chart(w, h, "", f"{w} {h}") for w, h in column] for column in sizes]
    whole = beside(columns, "All")
    places = re.findall(r"translate\((\d+) (\d+)\)", whole)
    boxes = [
        (int(x), int(y), int(x) + w, int(y) + h)
        for (x, y), (w, h) in zip(places, [s for column in sizes for s in column], strict=True)
    ]
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert right <= size_of(whole)[0]
        assert bottom <= size_of(whole)[1]
        for x0, y0, x1, y1 in boxes[k + 1 :]:
            assert right < x0 or x1 < left or bottom < y0 or y1 < top
    # No room is left at the edges.
    assert max(box[2] for box in boxes) == size_of(whole)[0]
    assert max(box[3] for box in boxes) == size_of(whole)[1]


@pytest.mark.parametrize("room", [24.0, 60.0, 200.0])
def test_words_are_cut_off_where_the_room_ends(room: float) -> None:
    words = "held-out error of the model"
    cut = shortened(words, room)
    assert width_of(cut) <= room
    if cut == words:
        return
    # As many letters as fit.
    kept = cut.removesuffix("…")
    assert words.startswith(kept)
    assert width_of(words[: len(kept) + 2] + "…") > room


def test_words_that_fit_stay_whole() -> None:
    assert shortened("error", width_of("error")) == "error"
    assert shortened("error", width_of("error") - 0.01) != "error"
    assert short("error", 5) == "error"
    assert short("an error", 4) == "an…"
    assert width_of("error", 22.0) == pytest.approx(2.0 * width_of("error", 11.0))
