"""The page in a real browser: choose, plan, read; and nothing is loaded from elsewhere."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import expect

from planner.errors import RequestError
from planner.search.results import SearchSummary
from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, opened
from tests.service.web.reports import RELIEF, answer, answered

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers) -> Iterator[Any]:
    """The page, opened."""

    def work(job: str, _: tuple[Any, ...]) -> str:
        return json.dumps(RELIEF if job == "relief" else answered(answer()))

    workers.work = work
    with opened(settings, workers) as made:
        yield made


def click_metres(page: Any, x: float, y: float) -> None:
    """Click the map at a place of its frame."""
    box = page.locator("#picture").bounding_box()
    scale = box["width"] / 20.0
    page.mouse.click(box["x"] + x * scale, box["y"] + (10.0 - y) * scale)


def test_two_clicks_plan_a_route(page: Any, workers: ScriptedWorkers) -> None:
    click_metres(page, 2.0, 1.0)
    click_metres(page, 8.0, 4.0)
    page.get_by_text("the shortest route costs 25 % more").wait_for()
    request = workers.asked[-1][1][0]
    assert request.start.x == pytest.approx(2.0, abs=0.03)
    assert request.start.y == pytest.approx(1.0, abs=0.03)
    assert request.goal.y == pytest.approx(4.0, abs=0.03)
    rows = page.locator(".account tbody tr").all_inner_texts()
    # 70 %, 40 % and the exchange of -10 % of 200 J, in this order.
    assert ["140.0 J" in rows[0], "80.0 J" in rows[1], "-20.0 J" in rows[2]] == [True] * 3
    assert "exchange" in rows[2]
    expect(page.locator("#picture .routes polyline").nth(1)).to_be_attached()
    expect(page.locator("#picture svg.map image")).to_have_count(1)
    expect(page.locator("#along svg.chart")).to_have_count(3)
    # The cursor of the charts moves over the map too.
    page.locator("#along svg.chart").first.hover()
    expect(page.locator("#picture .here")).to_have_attribute("visibility", "visible")
    expect(page.locator("#along .readout")).to_contain_text("J so far")


def test_the_page_says_what_was_minimised(page: Any, workers: ScriptedWorkers) -> None:
    found = answer(
        planner=SearchSummary("least-energy", "plane", "time", 0, "Exact solution"),
        baselines={"fastest": answer().baselines["shortest"]},
    )
    workers.work = lambda *_: json.dumps(answered(found))
    click_metres(page, 2.0, 1.0)
    click_metres(page, 8.0, 4.0)
    page.locator("#result tbody tr").nth(1).wait_for()
    rows = page.locator("#result tbody tr").all_inner_texts()
    assert [row.split("\t")[0] for row in rows] == ["route (least time)", "fastest"]


def test_the_keyboard_is_enough(page: Any, workers: ScriptedWorkers) -> None:
    page.get_by_role("group", name="Start").get_by_label("x").fill("1.5")
    page.get_by_role("group", name="Start").get_by_label("y").fill("2")
    page.get_by_role("group", name="Goal").get_by_label("x").fill("9")
    page.get_by_role("group", name="Goal").get_by_label("y").fill("3")
    page.get_by_label("Payload (kg)").fill("5")
    page.get_by_label("Payload (kg)").press("Enter")
    page.get_by_text("200.0 J over").wait_for()
    request = workers.asked[-1][1][0]
    assert (request.start.x, request.goal.x, request.payload.mass) == (1.5, 9.0, 5.0)


def test_coordinates_of_a_survey_are_read_whole(page: Any) -> None:
    for field in ("start-x", "start-y", "goal-x", "goal-y"):
        page.locator(f"#{field}").fill("5423459.02")
        wide, needed = page.locator(f"#{field}").evaluate("e => [e.clientWidth, e.scrollWidth]")
        assert needed <= wide


def test_a_refusal_is_said_and_its_fields_are_marked(page: Any, workers: ScriptedWorkers) -> None:
    def refuse(*_: Any) -> Any:
        raise RequestError("start", "on an obstacle", accepted="free ground")

    workers.work = refuse
    click_metres(page, 2.0, 1.0)
    click_metres(page, 8.0, 4.0)
    page.get_by_role("alert").get_by_text("start: on an obstacle").wait_for()
    expect(page.locator("#start-x")).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#goal-x")).not_to_have_attribute("aria-invalid", re.compile(""))


def test_no_route_says_why(page: Any, workers: ScriptedWorkers) -> None:
    found = answer(status="no_route", reason="a wall", routes=(), baselines={})
    workers.work = lambda *_: json.dumps(answered(found))
    click_metres(page, 2.0, 1.0)
    click_metres(page, 8.0, 4.0)
    page.get_by_text("No route: a wall").wait_for()
    expect(page.locator("#result")).not_to_be_visible()
