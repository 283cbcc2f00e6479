"""The pages in a real browser: nothing sticks out, nothing is loaded, light and dark differ."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from planner.report import card, write_report
from planner.report.axes import Axes
from planner.report.markup import document
from tests.report.synthetic import answer
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import RESULTS

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every page, and a card inside somebody else's page."""
    place = tmp_path_factory.mktemp("pages")
    made = results.material(place)
    for name, make in RESULTS.items():
        write_report(make(made), place / f"{name}.html")
    write_report({"there": answer()}, place / "route.html", "A route")
    axes = (
        Axes(350, 215, (0.0, 10_000.0), (-0.00042, 0.0005)),
        Axes(350, 215, (12041.0, 12042.0), (12041.22, 12041.31)),
        Axes(1000, 190, (0.0, 12_500.0), (-1.2e6, 1.3e6)),
        Axes(460, 280, (-180.0, 180.0), (0.0, 1.0), {-180.0: "back", 0.0: "ahead", 180.0: "back"}),
        Axes(
            350,
            215,
            (-0.5, 4.5),
            (-1.0, 1.0),
            dict(enumerate([f"a long name {'of ' * k}" for k in range(5)])),
        ),
    )
    drawn = "".join(
        a.svg(a.frame("distance (m)", "power (W)"), f"axes {k}") for k, a in enumerate(axes)
    )
    (place / "axes.html").write_text(
        document("Axes", f"<section>{drawn}</section>"), encoding="utf-8"
    )
    inserted = card(results.diagnosis(made))
    foreign = "<!DOCTYPE html><meta charset='utf-8'><ul class='legend'><li>theirs</ul>"
    (place / "card.html").write_text(foreign + inserted, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=CHROMIUM,
            args=["--no-sandbox", "--disable-gpu", "--disable-background-networking"],
        )
        yield started
        started.close()


@pytest.fixture
def opened(browser: Any, folder: Path) -> Iterator[Any]:
    """Opens a page; fails if it complains or asks for anything beside itself."""
    complaints: list[str] = []
    contexts = []

    def open_page(name: str, width: int, scheme: str) -> Any:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        address = (folder / f"{name}.html").as_uri()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("dialog", lambda dialog: complaints.append("a name opened a dialog"))
        page.on(
            "request",
            lambda r: None if r.url.startswith((address, "data:")) else complaints.append(r.url),
        )
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


PAPER = "() => getComputedStyle(document.querySelector('section')).backgroundColor"
INK = "() => getComputedStyle(document.querySelector('section')).color"


def brightness(colour: str) -> float:
    return sum(float(part) for part in colour[colour.index("(") + 1 : -1].split(",")[:3]) / 765


@pytest.mark.parametrize("name", [*RESULTS, "route"])
def test_light_and_dark(opened: Any, name: str) -> None:
    for scheme, light in (("light", True), ("dark", False)):
        page = opened(name, 1260, scheme)
        paper, ink = brightness(page.evaluate(PAPER)), brightness(page.evaluate(INK))
        assert (paper > 0.9) is light
        assert abs(paper - ink) > 0.6
        assert page.evaluate("document.documentElement.scrollWidth") == 1260


@pytest.mark.parametrize("name", RESULTS)
def test_nothing_sticks_out_on_a_telephone(opened: Any, name: str) -> None:
    page = opened(name, 420, "light")
    assert page.evaluate("document.documentElement.scrollWidth") == 420


WORDS_OUTSIDE = """() => [...document.querySelectorAll('svg.chart')].flatMap((drawing) => {
  const frame = drawing.getBoundingClientRect();
  return [...drawing.querySelectorAll('text')].filter((words) => {
    const box = words.getBoundingClientRect();
    return box.left < frame.left - 0.5 || box.right > frame.right + 0.5
      || box.top < frame.top - 2 || box.bottom > frame.bottom + 4;
  }).map((words) => drawing.querySelector('title').textContent + ': ' + words.textContent);
})"""


# Words that touch others of the same drawing.
WORDS_TOUCHING = """() => [...document.querySelectorAll('svg.chart')].flatMap((drawing) => {
  const words = [...drawing.querySelectorAll('text')];
  const boxes = words.map((w) => w.getBoundingClientRect());
  const pairs = words.flatMap((_, a) => words.slice(a + 1).map((_, k) => [a, a + 1 + k]));
  return pairs.filter(([a, b]) => boxes[a].left < boxes[b].right && boxes[b].left < boxes[a].right
    && boxes[a].top + 3 < boxes[b].bottom && boxes[b].top + 3 < boxes[a].bottom)
    .map(([a, b]) => `${words[a].textContent} / ${words[b].textContent}`);
})"""


@pytest.mark.parametrize("width", [360, 1260, 1920])
@pytest.mark.parametrize("name", [*RESULTS, "route", "axes"])
def test_words_stay_inside_their_pictures(opened: Any, name: str, width: int) -> None:
    assert opened(name, width, "light").evaluate(WORDS_OUTSIDE) == []


def test_words_of_axes_do_not_touch(opened: Any) -> None:
    assert opened("axes", 1260, "light").evaluate(WORDS_TOUCHING) == []


def test_a_card_leaves_its_notebook_alone(opened: Any) -> None:
    page = opened("card", 900, "dark")
    assert page.evaluate("getComputedStyle(document.querySelector('ul')).display") == "block"
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgba(0, 0, 0, 0)"
    assert page.locator(".joulepath.card svg").count() >= 3
