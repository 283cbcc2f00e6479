"""What the page does for a newcomer: an example, progress, the ground, files, a demo log."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import expect

from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, browsed, served
from tests.service.web.reports import GROUND, RELIEF, answer, answered, reporting
from tests.service.workbench import Workbench

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

MAPS = [{"name": name, "title": name} for name in ("jacksboro-1to100", "warehouse")]
FILES = {"csv": "route,x\n0,1.5\n", "geojson": "{}", "nav-path": "{}"}
LINES = "application/x-ndjson"


def lines(*documents: dict[str, Any]) -> str:
    return "".join(json.dumps(document) + "\n" for document in documents)


@pytest.fixture
def address(settings: Settings, workers: ScriptedWorkers) -> Iterator[str]:
    """A service whose map is 20 m × 10 m."""

    def work(job: str, _: tuple[Any, ...]) -> str:
        answers = {"relief": RELIEF, "ground": GROUND}
        return json.dumps(answers.get(job) or {**answered(answer()), "files": FILES})

    workers.work = work
    with served(settings, workers) as made:
        yield made


def with_example(answers: Callable[[Any], None] | None = None) -> Callable[[Any], None]:
    """A page whose service has the example's map; ``answers`` what is planned."""

    def prepare(page: Any) -> None:
        page.route("**/v1/maps", lambda asked: asked.fulfill(json=MAPS))
        page.route("**/v1/maps/*/relief?*", lambda asked: asked.fulfill(json=RELIEF))
        page.route("**/v1/maps/*/ground?*", lambda asked: asked.fulfill(json=GROUND))
        page.route(
            "**/v1/routes?*", answers or (lambda asked: asked.fulfill(json=answered(answer())))
        )

    return prepare


def never(_: Any) -> None:
    """The service is still planning."""


def ask(page: Any) -> None:
    for field, value in {"start-x": 2, "start-y": 1, "goal-x": 8, "goal-y": 4}.items():
        page.locator(f"#{field}").fill(str(value))
    page.get_by_role("button", name="Plan", exact=True).click()


def test_an_example_is_planned_when_the_page_opens(address: str) -> None:
    with browsed(
        address, prepare=with_example(), ready="the shortest route costs 25 % more"
    ) as page:
        expect(page.locator("#start-x")).to_have_value("93")
        # To begin with something else is as ever.
        page.locator("#stage").click(position={"x": 30, "y": 30})
        expect(page.locator("#start-x")).not_to_have_value("93")
        expect(page.locator("#goal-x")).to_have_value("212")
        expect(page.locator("#old")).to_be_visible()


def test_the_first_click_ends_an_example_that_is_still_planned(address: str) -> None:
    with browsed(address, prepare=with_example(never), ready="Planning an example") as page:
        page.locator("#stage").click(position={"x": 30, "y": 30})
        expect(page.locator("#message")).to_have_text("Choose a start and a goal.")
        expect(page.locator("#start-x")).not_to_have_value("")
        expect(page.locator("#goal-x")).to_have_value("")
        expect(page.locator("#planning")).to_be_hidden()


def test_typing_ends_it_too_and_what_was_typed_stays(address: str) -> None:
    with browsed(address, prepare=with_example(never), ready="Planning an example") as page:
        page.locator("#goal-x").fill("7")
        expect(page.locator("#goal-x")).to_have_value("7")
        expect(page.locator("#start-x")).to_have_value("")
        page.locator("#map").select_option("warehouse")
        expect(page.locator("#message")).to_have_text("Choose a start and a goal.")


def test_planning_can_be_cancelled(address: str) -> None:
    with browsed(address, prepare=lambda page: page.route("**/v1/routes?*", never)) as page:
        ask(page)
        page.get_by_role("button", name="Cancel").click()
        expect(page.locator("#message")).to_have_text("Cancelled.")
        expect(page.locator("#planning")).to_be_hidden()
        expect(page.get_by_role("button", name="Plan", exact=True)).to_be_enabled()


def test_progress_is_shown_and_its_last_line_is_the_answer(
    address: str, workers: ScriptedWorkers
) -> None:
    go = asyncio.Event()
    loop: list[asyncio.AbstractEventLoop] = []

    async def work() -> str:
        loop.append(asyncio.get_running_loop())
        workers.tell(0.4, "looking at it")
        await go.wait()
        return json.dumps(answered(answer()))

    with browsed(address) as page:
        plain = workers.work
        workers.work = lambda job, given: work() if job == "plan_route" else plain(job, given)
        ask(page)
        expect(page.locator("#message")).to_have_text("Looking at it …")
        expect(page.locator("#plan-progress")).to_have_attribute("value", "0.4")
        loop[0].call_soon_threadsafe(go.set)
        expect(page.locator("#message")).to_contain_text("the shortest route costs 25 % more")


def test_a_problem_in_the_last_line_is_said(address: str) -> None:
    body = lines(
        {"progress": {"share": 0.1, "sentence": "looking"}},
        {"problem": {"detail": "goal: is on an obstacle", "field": "goal"}},
    )

    def fail(asked: Any) -> None:
        asked.fulfill(body=body, content_type=LINES)

    with browsed(address, prepare=lambda page: page.route("**/v1/routes?*", fail)) as page:
        ask(page)
        expect(page.get_by_role("alert")).to_have_text("goal: is on an obstacle")
        expect(page.locator("#goal-x")).to_have_attribute("aria-invalid", "true")


def test_a_server_that_ends_in_the_middle_is_lost(address: str) -> None:
    body = lines({"progress": {"share": 0.1, "sentence": "looking"}})

    def end(asked: Any) -> None:
        asked.fulfill(body=body, content_type=LINES)

    with browsed(address, prepare=lambda page: page.route("**/v1/routes?*", end)) as page:
        ask(page)
        expect(page.get_by_role("alert")).to_contain_text("The server does not answer.")


def test_the_route_that_is_shown_can_be_downloaded(address: str) -> None:
    with browsed(address) as page:
        ask(page)
        expect(page.locator("#downloads a")).to_have_text(
            ["JSON", "CSV", "GeoJSON", "nav_msgs/Path"]
        )
        with page.expect_download() as began:
            page.get_by_role("link", name="CSV").click()
        assert began.value.suggested_filename == "route.csv"
        assert began.value.path().read_text() == FILES["csv"]
        with page.expect_download() as began:
            page.get_by_role("link", name="JSON", exact=True).click()
        assert json.loads(began.value.path().read_text()) == {"status": "ok"}
        # An answer to another question takes them away.
        page.locator("#map").dispatch_event("change")
        expect(page.locator("#downloads a")).to_have_count(0)


def test_where_the_robot_cannot_go_is_drawn_under_the_routes(address: str) -> None:
    with browsed(address) as page:
        layer = page.locator("#picture .drivable")
        expect(layer).to_be_attached()
        expect(page.locator("#ground-legend")).to_contain_text("room for")
        ask(page)
        expect(page.locator("#picture .drivable ~ .routes")).to_be_attached()
        page.get_by_label("Where this robot cannot go").uncheck()
        expect(layer).to_be_hidden()


def test_one_click_to_a_log_with_a_hidden_effect(address: str, workers: ScriptedWorkers) -> None:
    workers.work = reporting(Workbench())
    with browsed(address) as page:
        page.get_by_role("button", name="Try the demo log").click()
        expect(page.locator("#work-message")).to_contain_text("demo.csv was read")
        expect(page.locator("#log")).to_contain_text("demo.csv")
        page.get_by_role("button", name="Diagnose").click()
        expect(page.locator("#diagnosis")).to_contain_text("The model lacks air_drag.")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_stand_out_from_what_is_behind_them(address: str, scheme: str) -> None:
    """WCAG 2.2, contrast of text: at least 4.5 : 1."""
    contrast = """(selectors) => {
      const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
      const part = (c) => linear(c / 255);
      const light = ([r, g, b]) => 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
      const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
      const behind = (node) => {
        const colour = numbers(getComputedStyle(node).backgroundColor);
        return colour.length === 4 && colour[3] === 0 ? behind(node.parentElement) : colour;
      };
      return selectors.map((selector) => {
        const node = document.querySelector(selector);
        const [one, other] = [light(numbers(getComputedStyle(node).color)), light(behind(node))];
        return [selector, (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05)];
      });
    }"""
    words = ["h1", "header p", "#hint", "label", "#plan", "#cancel-plan", "#map", "#start-x"]
    words += ["#message", "#downloads a", "#demo-log", "#ground label", "#result td", "#key p"]
    with browsed(address, prepare=lambda page: page.emulate_media(color_scheme=scheme)) as page:
        ask(page)
        expect(page.locator("#downloads a").first).to_be_visible()
        page.locator("#message").evaluate("node => node.classList.add('wrong')")
        found = dict(page.evaluate(contrast, words))
        # The route's sentence is said as an alert here, for its colour.
        assert {words: ratio for words, ratio in found.items() if ratio < 4.5} == {}
