"""The page says what the answer says, stands alone, and is a well-formed document."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.report import write_report
from planner.report.routes.route_map import (
    GIVEN_BACK,
    coloured_pieces,
)
from tests.report.synthetic import answer, route


@pytest.fixture
def page(tmp_path: Path) -> str:
    path = tmp_path / "pages" / "report.html"
    nowhere = answer(status="no_route", reason="a wall", routes=(), baselines={})
    write_report({"one <way>": answer(), "another": nowhere}, path, "A & B")
    return path.read_text(encoding="utf-8")


def test_the_page_holds_all_it_needs(page: str) -> None:
    # Namespaces are names and not addresses that are loaded.
    without_names = re.sub(r'xmlns="[^"]+"|"http://www.w3.org/2000/svg"', "", page)
    assert "http" not in without_names
    assert not re.search(r"<(link|script|img|iframe)[^>]+(src|href)=", page)


def test_text_from_outside_is_text(page: str) -> None:
    for text in ("one &lt;way&gt;", "A &amp; B", "x &lt; y &amp; z", "ramp &lt;1&gt;"):
        assert text in page


def test_numbers_are_those_of_the_answer(page: str) -> None:
    # 20 W for 16 s, and 25 W for the baseline.
    assert "<b>320.0 J</b>" in page
    assert "the shortest route costs 25 % more" in page
    assert re.search(r"climbing.{0,60}</th><td>80.0 J</td><td>25.0 %</td>", page)
    assert "No route: a wall" in page


def test_what_is_known_of_the_energy_is_told(page: str) -> None:
    # 320 J within a tenth, of 1,000 J.
    assert "288.0 J … 352.0 J (95 %)" in page
    assert "comes from electronics (power) 60 %, noise of one drive 40 %." in page
    assert "the chance that it suffices is over 99.99 %" in page


def test_poses_for_the_cursor_are_json(page: str) -> None:
    found = re.findall(r'<script class="poses" type="application/json">(.*?)</script>', page)
    poses = json.loads(found[0])
    assert len({len(column) for column in poses.values()}) == 1
    assert (poses["energy_j"][-1], poses["distance"][0]) == (320.0, 0.0)


def test_drawings_are_well_formed(page: str) -> None:
    drawings = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(drawings) >= 5
    for drawing in drawings:
        ElementTree.fromstring(drawing)


def test_power_that_is_only_rounding_gives_nothing_back(tmp_path: Path) -> None:
    one = route()
    watts = one.arrays["watts"].copy()
    watts[10:15] = -1.4e-14
    idle = replace(one, arrays={**one.arrays, "watts": watts})
    braking = replace(one, arrays={**one.arrays, "watts": np.where(watts < 0, -3.0, watts)})
    for driven, said in ((idle, False), (braking, True)):
        write_report({"there": answer(routes=(driven,))}, tmp_path / "page.html", "A route")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert ("gives back" in page) is said
        blue = "#{:02x}{:02x}{:02x}".format(*GIVEN_BACK)
        assert (blue in {colour for colour, _ in coloured_pieces(driven)}) is said


def test_an_effect_that_shows_as_nothing_is_left_out(tmp_path: Path) -> None:
    one = replace(route(), breakdown_j={**route().breakdown_j, "gear_loss": -1e-6})
    write_report({"there": answer(routes=(one,))}, tmp_path / "page.html", "A route")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "-0.0" not in page.partition('class="account"')[2].partition("</table>")[0]
