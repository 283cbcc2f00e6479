"""What stands on the page answers the question that stands there, or is marked as old."""

from __future__ import annotations

import json
import random
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest
from playwright.sync_api import expect

from planner.report.routes import whole_map
from service.settings import Settings
from tests.report import synthetic
from tests.service.conftest import ScriptedWorkers
from tests.service.web import reports
from tests.service.web.browser import CHROMIUM, opened

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

MAPS = ("warehouse", "hall")
VEHICLES = ("minibalance", "robotino")
# "hall" is twice as large as "warehouse" and of other proportions.
RELIEFS = {
    "warehouse": reports.RELIEF,
    "hall": {"report": whole_map(replace(synthetic.terrain(), cell=(2.0, 4.0)))},
}
ANSWER = reports.answered(reports.answer(200.0, baselines={}))
PLACES = {"start-x": 2, "start-y": 1, "goal-x": 8, "goal-y": 4}


def energy_of(question: dict[str, Any]) -> float:
    """J, of the answer to a question: each question has its own."""
    asked = {k: v for k, v in question.items() if k not in ("time_budget_s", "certify_s")}
    return 100.0 + zlib.crc32(json.dumps(asked, sort_keys=True).encode()) % 8999 / 10


def answered(question: dict[str, Any]) -> dict[str, Any]:
    """That answer."""
    drawn = ANSWER["report"].replace("200.0 J", f"{energy_of(question):.1f} J")
    return {**ANSWER, "report": drawn}


def answering(document: Any, status: int = 200) -> Callable[[Any], None]:
    """What answers a request in the server's place."""
    return lambda asked: asked.fulfill(json=document, status=status)


class Wire:
    """The network between page and service: answers wait until the test lets them through."""

    def __init__(self) -> None:
        self.held: list[Any] = []
        self.holding = True
        self.ended: list[str] = []

    def prepare(self, page: Any) -> None:
        self.page = page
        entries = {"maps": MAPS, "vehicles": VEHICLES}
        for kind, names in entries.items():
            found = [{"name": name, "title": "", "battery_j": None} for name in names]
            page.route(f"**/v1/{kind}", answering(found))
        page.route("**/v1/routes?*", self.hold)
        for name, relief in RELIEFS.items():
            page.route(f"**/v1/maps/{name}/relief?*", answering(relief))
        page.on("requestfailed", lambda request: self.ended.append(request.url))

    def hold(self, asked: Any) -> None:
        self.held.append(asked)
        if not self.holding:
            self.let_through()

    def let_through(self) -> None:
        """Answer all that was asked, each with its own answer, the newest first."""
        while self.held:
            asked = self.held.pop()
            # The page may have hung up.
            with suppress(Exception):
                asked.fulfill(json=answered(json.loads(asked.request.post_data)))


@pytest.fixture
def wire() -> Wire:
    return Wire()


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers, wire: Wire) -> Iterator[Any]:
    """The page with start and goal typed in."""
    workers.work = lambda *_: json.dumps(reports.RELIEF)
    with opened(settings, workers, prepare=wire.prepare) as made:
        for field, value in PLACES.items():
            made.locator(f"#{field}").fill(str(value))
        yield made


def question(page: Any) -> dict[str, Any]:
    """What stands in the form, as a request."""
    value = {
        field: page.locator(f"#{field}").input_value()
        for field in ("map", "vehicle", *PLACES, "payload")
    }
    x0, y0, x1, y1 = (json.loads(value[field]) for field in PLACES)
    return {
        "map": value["map"],
        "vehicle": value["vehicle"],
        "start": {"x": x0, "y": y0},
        "goal": {"x": x1, "y": y1},
        "payload": {"mass": json.loads(value["payload"])},
    }


def plan(page: Any, wire: Wire) -> None:
    """Ask, and wait until the question is under way."""
    with page.expect_request("**/v1/routes?*"):
        page.locator("#request").evaluate("form => form.requestSubmit()")
    if wire.holding:
        expect(page.locator("#answer")).to_have_attribute("aria-busy", "true")


def shown(page: Any) -> str:
    return f"{energy_of(question(page)):.1f} J over"


CHANGES: dict[str, tuple[str, Any]] = {
    "map": ("map", "hall"),
    "vehicle": ("vehicle", "robotino"),
    "start": ("start-x", 3),
    "goal": ("goal-y", 3),
    "payload": ("payload", 5),
    "time": ("budget", 4),
}


def change(page: Any, field: str, value: Any) -> None:
    box = page.locator(f"#{field}")
    if field in ("map", "vehicle"):
        box.select_option(str(value))
    else:
        box.fill(str(value))


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_ends_what_is_planned(page: Any, wire: Wire, what: str) -> None:
    plan(page, wire)
    with page.expect_event("requestfailed", lambda r: "/v1/routes?" in r.url):
        change(page, *CHANGES[what])
    wire.let_through()
    # A new map's relief has to arrive before a route can be asked for on it.
    expect(page.get_by_role("button", name="Plan", exact=True)).to_be_enabled()
    expect(page.locator("#answer")).to_have_attribute("aria-busy", "false")
    if what == "map":
        for field, value in PLACES.items():
            page.locator(f"#{field}").fill(str(value))
    wire.holding = False
    plan(page, wire)
    page.get_by_text(shown(page)).wait_for()
    assert page.locator("#message").inner_text().count("J over") == 1


@pytest.mark.parametrize("what", [what for what in CHANGES if what != "map"])
def test_what_was_shown_before_is_marked_until_it_is_asked_again(
    page: Any, wire: Wire, what: str
) -> None:
    wire.holding = False
    plan(page, wire)
    page.get_by_text(shown(page)).wait_for()
    old = page.get_by_text("This answers an earlier question. Plan again.")
    expect(old).not_to_be_visible()
    field, value = CHANGES[what]
    before = page.locator(f"#{field}").input_value()
    change(page, field, value)
    expect(old).to_be_visible()
    fainter = "s => Number(getComputedStyle(document.querySelector(s)).opacity)"
    for part in ("#message", "#result", ".routes", "#legend", "#along section"):
        assert page.evaluate(fainter, part) < 1
    # Asked as before it is the answer; so is the new one when it is there.
    change(page, field, before)
    expect(old).not_to_be_visible()
    change(page, field, value)
    plan(page, wire)
    page.get_by_text(shown(page)).wait_for()
    expect(old).not_to_be_visible()
    assert page.evaluate(fainter, "#result") == 1


def test_a_refusal_of_another_question_is_marked_too(page: Any, wire: Wire) -> None:
    wire.page.unroute("**/v1/routes?*")
    problem = {"title": "Bad request", "detail": "start: on an obstacle", "field": "start"}
    page.route("**/v1/routes?*", answering(problem, status=422))
    page.locator("#plan").click()
    page.get_by_text("start: on an obstacle").wait_for()
    expect(page.locator("#start-x")).to_have_attribute("aria-invalid", "true")
    page.locator("#start-x").fill("3")
    expect(page.get_by_text("This answers an earlier question")).to_be_visible()
    expect(page.locator("[aria-invalid]")).to_have_count(0)


# Runs in the page after everything that changes it or is typed: what is shown and not marked must
# be the energy of the form. The test gives the page the same sum that it answers with.
WATCH = """() => {
  const crc = Array.from({length: 256}, (_, n) => {
    for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n >>> 0;
  });
  const crc32 = (s) => {
    let c = ~0;
    for (const b of new TextEncoder().encode(s)) c = crc[(c ^ b) & 255] ^ (c >>> 8);
    return (c ^ ~0) >>> 0;
  };
  const $ = (id) => document.getElementById(id);
  const energy = () => {
    const v = (id) => String(Number($(id).value));
    const place = (what) => `{"x": ${v(`${what}-x`)}, "y": ${v(`${what}-y`)}}`;
    const asked = `{"goal": ${place("goal")}, "map": "${$("map").value}", ` +
      `"payload": {"mass": ${v("payload")}}, "start": ${place("start")}, ` +
      `"vehicle": "${$("vehicle").value}"}`;
    return (100 + crc32(asked) % 8999 / 10).toFixed(1);
  };
  window.foreign = [];
  window.right = 0;
  const look = () => {
    const said = /^([0-9.]+) J over/.exec($("message").textContent)?.[1];
    const marked = $("old") && !$("old").hidden;
    if (said === undefined || marked) return;
    if (said === energy()) window.right += 1;
    else window.foreign.push(`${said} J for a question of ${energy()} J`);
  };
  new MutationObserver(look).observe($("answer"), {
    subtree: true, childList: true, characterData: true, attributes: true,
  });
  for (const kind of ["input", "change", "click"]) window.addEventListener(kind, look);
}"""


def test_fifty_changes_at_random_moments_show_no_foreign_answer(page: Any, wire: Wire) -> None:
    page.evaluate(WATCH)
    draw = random.Random(7)
    values = {
        "map": MAPS,
        "vehicle": VEHICLES,
        "start-x": (1, 2, 3),
        "start-y": (1, 2),
        "goal-x": (7, 8, 9),
        "goal-y": (3, 4),
        "payload": (0, 5),
    }
    changed = 0
    while changed < 50:
        field = draw.choice([*values])
        now = page.locator(f"#{field}").input_value()
        value = draw.choice([v for v in values[field] if str(v) != now])
        moment = draw.choice(("before", "under way", "answered", "shown"))
        wire.holding = True
        if moment != "before":
            plan(page, wire)
        if moment == "answered":
            wire.let_through()  # perhaps the page has it already, perhaps not
        if moment == "shown":
            wire.let_through()
            page.get_by_text(shown(page)).wait_for()
        change(page, field, value)
        changed += 1
        if field == "map":
            page.get_by_text("Choose a start and a goal.").wait_for()
            for place, where in PLACES.items():
                page.locator(f"#{place}").fill(str(where))
        if draw.random() < 0.5:
            wire.let_through()  # late, to a page that asks something else
    wire.holding = False
    plan(page, wire)
    page.get_by_text(shown(page)).wait_for()
    assert page.evaluate("foreign") == []
    # It was looked at, and there was something to see.
    assert page.evaluate("right") > 10


def test_the_picture_is_that_of_the_map_that_is_chosen(page: Any, wire: Wire) -> None:
    held: list[Any] = []
    page.unroute("**/v1/maps/hall/relief?*")
    page.route("**/v1/maps/hall/relief?*", lambda asked: held.append(asked))
    with page.expect_request("**/v1/maps/hall/relief?*"):
        page.locator("#map").select_option("hall")
    # The warehouse is not taken for the hall while that one is loaded.
    expect(page.locator("#picture svg.map")).not_to_be_visible()
    page.locator("#stage").click(position={"x": 30, "y": 30})
    expect(page.locator("#start-x")).to_have_value("")
    page.locator("#map").select_option("warehouse")
    page.get_by_text("Choose a start and a goal.").wait_for()
    for asked in held:
        with suppress(Exception):
            asked.fulfill(json=RELIEFS["hall"])
    # What was typed for the warehouse has come back with it.
    for field, value in PLACES.items():
        expect(page.locator(f"#{field}")).to_have_value(str(value))
    wire.holding = False
    plan(page, wire)
    page.get_by_text(shown(page)).wait_for()
    width, height = page.evaluate("[picture.clientWidth, picture.clientHeight]")
    assert width / height == pytest.approx(2.0, rel=0.01)
