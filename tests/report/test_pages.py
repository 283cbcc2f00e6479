"""Pages, cards and pictures of every kind of result by name; what cannot be shown is refused."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from planner.errors import RequestError
from planner.report import card, figure_names, write_report
from planner.report.markup import plain
from tests.report.synthetic import answer


def test_pictures_by_name(tmp_path: Path) -> None:
    there, nowhere = answer(), answer(status="no_route", routes=(), baselines={})
    assert there.figures() == ("overview", "map", "height", "power", "energy")
    assert nowhere.figures() == ("map",)
    for result in (there, nowhere):
        for name in result.figures():
            result.figure(name).save(tmp_path / f"{name}.svg")
            drawing = ElementTree.parse(tmp_path / f"{name}.svg").getroot()
            assert drawing.findtext("{http://www.w3.org/2000/svg}style")
    # The overview is the map with both profiles beside it.
    overview = there.plot().svg
    for name in ("map", "height", "power"):
        title = ElementTree.fromstring(there.figure(name).svg).findtext(
            "{http://www.w3.org/2000/svg}title"
        )
        assert f"<title>{plain(title)}</title>" in overview
    assert nowhere.plot().name == "map"
    with pytest.raises(RequestError, match="overview"):
        there.figure("horoscope")


def test_an_answer_writes_its_own_page(tmp_path: Path) -> None:
    answer().write_report(tmp_path / "own.html")
    page = (tmp_path / "own.html").read_text(encoding="utf-8")
    assert "<title>ramp &lt;1&gt;: (2, 5) to (18, 5)</title>" in page
    assert "<b>320.0 J</b>" in page


def test_a_notebook_card_without_a_route_says_why() -> None:
    blocked = answer(status="no_route", reason="a wall & more", routes=(), baselines={})
    assert "a wall &amp; more" in card(blocked)
    assert card(blocked) == blocked._repr_html_()
    ElementTree.fromstring(card(answer()))


def test_one_result_or_several_or_several_with_headings(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    nowhere = answer(status="no_route", reason="a wall", routes=(), baselines={})
    write_report([answer(), nowhere], path)
    page = path.read_text(encoding="utf-8")
    assert page.index("<b>320.0 J</b>") < page.index("No route: a wall")
    write_report({"first": nowhere, "second": answer()}, path, "Both")
    page = path.read_text(encoding="utf-8")
    assert "<title>Both</title>" in page
    assert page.index("first") < page.index("No route: a wall") < page.index("second")


@pytest.mark.parametrize("result", ["an answer", 3, None])
def test_what_is_no_result_is_refused(result: object, tmp_path: Path) -> None:
    for show in (card, figure_names, lambda one: write_report(one, tmp_path / "page.html")):
        with pytest.raises(RequestError, match="cannot be shown"):
            show(result)
    assert not (tmp_path / "page.html").exists()
