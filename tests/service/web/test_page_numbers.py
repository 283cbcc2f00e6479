"""Figures without the noise of floating point, and charts whose words are all there to read."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import expect

from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import ScriptedWorkers
from tests.service.route_documents import answer, route
from tests.service.web.browser import CHROMIUM, RELIEF, opened
from tests.service.workbench import CSV, Workbench

NARROW = re.compile(r"^0 0 [1-3]\d\d(\.\d+)? ")
"""A viewBox less than 400 wide."""

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]


def poses(watts: list[float], heights: list[float], step_m: float) -> list[dict[str, float]]:
    """A pose each second along x; ``watts`` between them."""
    energy, made = 0.0, []
    for k, z in enumerate(heights):
        energy += watts[k - 1] if k else 0.0
        made.append({"x": k * step_m, "y": 1.0, "z": z, "t": float(k), "energy_j": energy})
    return made


class Bench(Workbench):
    """With a route, a comparison and a diagnosis that a test gives."""

    def __init__(self) -> None:
        super().__init__()
        self.route = route(200.0)
        self.comparison = documents.comparison()
        self.curves: dict[str, Any] = {}
        self.diagnosis = documents.diagnosis()

    def __call__(self, job: str, arguments: tuple[Any, ...]) -> Any:
        if job == "relief":
            return json.dumps(RELIEF)
        if job == "plan_route":
            return json.dumps(answer(routes=[self.route]))
        if job == "compare":
            return {**self.comparison, "pictures": {"curves": self.curves, "cloud": {}}}
        if job == "diagnose":
            return self.diagnosis
        return super().__call__(job, arguments)


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Bench:
    made = Bench()
    workers.work = made
    return made


def plan(page: Any) -> None:
    for field, value in (("start-x", 2), ("start-y", 1), ("goal-x", 8), ("goal-y", 4)):
        page.locator(f"#{field}").fill(str(value))
    page.locator("#plan").click()
    page.locator("#profile polyline").first.wait_for()


def work(page: Any) -> None:
    """Compare and diagnose a log."""
    file = {"name": "drive.csv", "mimeType": "text/csv", "buffer": CSV}
    page.get_by_label("Log (CSV, Parquet)").set_input_files(file)
    page.get_by_role("button", name="Upload").click()
    page.get_by_text("was read").wait_for()
    for button, said in (("Compare", "Compared."), ("Diagnose", "Diagnosed.")):
        page.get_by_role("button", name=button).click()
        page.get_by_text(said).wait_for()


def words_of(page: Any, chart: str) -> list[str]:
    return list(page.locator(f"{chart} text").all_text_contents())


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers, bench: Bench) -> Iterator[Any]:
    with opened(settings, workers) as made:
        yield made


def colours(page: Any) -> set[str]:
    return {
        line.get_attribute("stroke") or "" for line in page.locator("#route polyline").all()
    } - {"#fff"}


def test_power_that_is_only_rounding_is_zero(page: Any, bench: Bench) -> None:
    # Braking power that is refused: the sum of the effects is zero but for its rounding.
    watts = [20.0, 88.0, -1.4e-14, -2.8e-14, 1.4e-14, 30.0]
    heights = [1e-15, 0.3, 0.6, 0.3, -4e-17, 0.0, 0.0]
    bench.route = route(138.0, poses=poses(watts, heights, 1.0))
    plan(page)
    assert not [words for words in words_of(page, "#profile") if "e-" in words.lower()]
    # The axis of power begins at zero, which is written once.
    assert words_of(page, "#profile").count("0") == 1
    assert "gives back" not in page.locator("#legend").inner_text()
    assert "rgb(38, 110, 220)" not in colours(page)


def test_power_that_is_given_back_is_said(page: Any, bench: Bench) -> None:
    bench.route = route(100.0, poses=poses([88.0, -12.0, 24.0], [0.0, 1.0, 0.5, 0.0], 1.0))
    plan(page)
    assert "gives back" in page.locator("#legend").inner_text()
    assert "rgb(38, 110, 220)" in colours(page)


def test_nothing_is_written_with_a_sign_or_an_exponent(page: Any, bench: Bench) -> None:
    regime = {**documents.REGIMES[0], "bias_w": -1.4e-14, "share_of_squared_error": -1e-17}
    bench.comparison = documents.comparison(regimes=[regime])
    tiny = {"value": -1.4e-14, "stderr": 0.01, "unit": "m²"}
    bench.diagnosis = documents.diagnosis(
        candidates=[documents.candidate("air_drag", 0.97, parameters={"drag_area": tiny})]
    )
    flat = {"x": [0.1, 0.4, 0.8], "bias_w": [-1.4e-14, 1e-15, 0.0], "stderr_w": [0.0, 0.0, 0.0]}
    bench.curves = {"speed": {**flat, "rows": [10, 10, 10]}}
    work(page)
    cells = page.locator("#regimes tbody td").all_inner_texts()
    assert (cells[1], cells[3]) == ("+0.000 W", "0.0 %")
    assert "drag_area 0 ± 0.01 m²" in page.locator("#ranking tbody").inner_text()
    assert not [words for words in words_of(page, "#curves") if "e-" in words]


NUMBERS = {
    "watts(-1.4e-14)": "0.000 W",
    "watts(-0.041)": "-0.041 W",
    "signedWatts(-1.4e-14)": "+0.000 W",
    "signedWatts(-0.041)": "−0.041 W",
    "joules(-1.4e-14)": "0.0 J",
    "joules(-20)": "-20.0 J",
    "metres(-0)": "0.00 m",
    "seconds(-1e-9)": "0.0 s",
    "percent(-1e-17)": "0.0 %",
    "extraShare(200 - 1e-9, 200)": "+0.0 %",
    "extraShare(150, 200)": "−25 %",
    "estimate(0.2213, 0.0041)": "0.221 ± 0.0041",
    "estimate(1.4e-14, null)": "1.40e-14",
}


def test_the_words_of_figures(page: Any) -> None:
    for call, expected in NUMBERS.items():
        said = page.evaluate(f"import('/static/words.js').then((words) => words.{call})")
        assert (call, said) == (call, expected)


# Words of a chart that are cut off by its edge, and figures of an upright axis in its drawing.
CLIPPED = """() => [...document.querySelectorAll('svg.chart, #profile')].flatMap((drawing) => {
  const frame = drawing.getBoundingClientRect();
  if (!frame.width) return [];
  const box = (e) => e.getBoundingClientRect();
  const words = [...drawing.querySelectorAll('text')];
  const outside = words.filter((w) => box(w).left < frame.left || box(w).right > frame.right
    || box(w).top < frame.top - 1 || box(w).bottom > frame.bottom + 1);
  return outside.map((w) => `${drawing.id}: ${w.textContent}`);
})"""

CURVE = {"bias_w": [-1204.4, 2.0, 3.1], "stderr_w": [0.1, 0.2, 900.0], "rows": [10, 10, 10]}
GROUNDS = ["carpet in the long corridor", "wet concrete of the loading bay", "dry"]


@pytest.mark.parametrize("width", [360, 720, 1300, 1920])
def test_all_words_of_all_charts_are_inside(
    settings: Settings, workers: ScriptedWorkers, bench: Bench, width: int
) -> None:
    # Figures as long as they come: high ground, much power, tiny and long shapes and names.
    bench.route = route(
        2e6, poses=poses([10234.5, 1e4, -9876.5], [12041.26, 12041.31, 12041.22, 12041.3], 4321.0)
    )
    names = ["surface", "slope_along", "time_since_start", "heading"]
    bench.curves = {name: {"x": [-3.1, 0.4, 3.14], **CURVE} for name in names}
    bench.curves["surface"] = {**bench.curves["surface"], "x": GROUNDS}
    bench.diagnosis = documents.diagnosis(
        selected=["air_drag", "viscous_drag", "a_long_name_of_an_effect", "another_of_these"],
        outside_catalogue={
            "name": "shape_of_something",
            "formula": "a·sin(heading)",
            "quantities": ["heading"],
            "shape": [[-3.1, -0.000125], [0.0, 0.00012], [3.1, -0.0000004]],
        },
    )
    with opened(settings, workers, width=width) as page:
        plan(page)
        work(page)
        page.get_by_role("button", name="Adopt").click()
        page.locator("#fall circle").first.wait_for()
        page.get_by_role("button", name="Compare").click()
        page.get_by_text("Compared.").wait_for()
        page.get_by_role("button", name="Diagnose").click()
        page.get_by_text("Diagnosed.").wait_for()
        assert page.evaluate(CLIPPED) == []
        for chart in ("#profile", "#curves", "#errors", "#shape", "#fall"):
            assert len(words_of(page, chart)) >= 3
            size = page.locator(f"{chart} text").first.bounding_box()["height"]
            assert size > 9  # not so small on a telephone that nobody reads it
        assert page.evaluate("document.documentElement.scrollWidth") == width
        # The same after the window has become another one.
        page.set_viewport_size({"width": 400, "height": 850})
        # The page's policy forbids the script that wait_for_function would run.
        expect(page.locator("#profile")).to_have_attribute("viewBox", NARROW)
        assert page.evaluate(CLIPPED) == []
