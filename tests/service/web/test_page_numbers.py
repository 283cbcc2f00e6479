"""Figures without the noise of floating point, and charts whose words are all there to read."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

from planner.report.workbench import as_html
from planner.search.results import Route
from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, opened
from tests.service.web.reports import answer, answered, reporting, route, workbench_reports
from tests.service.workbench import CSV, Workbench
from tests.telemetry.diagnosis import synthetic_results as results

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

GIVEN_BACK = "#266edc"


def driven(watts: list[float], heights: list[float], step_m: float, first_x: float = 2.0) -> Route:
    """A pose each second along x; ``watts`` between them."""
    made, t = route(200.0), np.arange(float(len(heights)))
    power = np.array([0.0, *watts])
    arrays = {
        "x": first_x + step_m * t,
        "y": np.full(len(t), 5.0),
        "z": np.array(heights),
        "yaw": np.zeros(len(t)),
        "t": t,
        "speed": np.full(len(t), step_m),
        "watts": power,
        "energy_j": np.cumsum(power),
    }
    shares = {"electronics": 0.75 * power, "gravity": 0.25 * power}
    return replace(made, energy_j=float(power.sum()), arrays=arrays, watts_by_effect=shares)


class Bench(Workbench):
    """With a route that a test gives."""

    def __init__(self) -> None:
        super().__init__()
        self.route = route(200.0)
        self.reports: dict[str, str] = {}

    def work(self, job: str, arguments: tuple[Any, ...]) -> Any:
        if job == "plan_route":
            return json.dumps(answered(answer(routes=(self.route,), baselines={})))
        return reporting(self, self.reports)(job, arguments)


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Bench:
    made = Bench()
    workers.work = made.work
    return made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reports")


def plan(page: Any) -> None:
    for field, value in (("start-x", 2), ("start-y", 1), ("goal-x", 8), ("goal-y", 4)):
        page.locator(f"#{field}").fill(str(value))
    page.locator("#plan").click()
    page.locator("#along svg.chart").first.wait_for()


def work(page: Any) -> None:
    """Compare and diagnose a log."""
    file = {"name": "drive.csv", "mimeType": "text/csv", "buffer": CSV}
    page.get_by_label("Log (CSV, Parquet)").set_input_files(file)
    page.get_by_role("button", name="Upload").click()
    page.get_by_text("was read").wait_for()
    ask(page)


def ask(page: Any) -> None:
    for button, said in (("Compare", "Compared."), ("Diagnose", "Diagnosed.")):
        page.get_by_role("button", name=button).click()
        page.get_by_text(said).wait_for()


def words_of(page: Any, place: str) -> list[str]:
    return list(page.locator(f"{place} svg text").all_text_contents())


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers, bench: Bench) -> Iterator[Any]:
    with opened(settings, workers) as made:
        yield made


def colours(page: Any) -> set[str]:
    lines = page.locator("#picture .routes polyline").all()
    return {line.get_attribute("stroke") or "" for line in lines} - {"#fff"}


def test_power_that_is_only_rounding_is_zero(page: Any, bench: Bench) -> None:
    # Braking power that is refused: the sum of the effects is zero but for its rounding.
    watts = [20.0, 88.0, -1.4e-14, -2.8e-14, 1.4e-14, 30.0]
    heights = [1e-15, 0.3, 0.6, 0.3, -4e-17, 0.0, 0.0]
    bench.route = driven(watts, heights, 1.0)
    plan(page)
    expect(page.locator("#along svg.chart")).to_have_count(3)
    assert not [words for words in words_of(page, "#along") if "e-" in words.lower()]
    # The axis of power begins at zero, which is written once.
    power = page.locator("#along svg", has_text="Power along the route")
    assert power.locator("text[text-anchor=end]").all_text_contents().count("0") == 1
    expect(page.locator("#legend")).not_to_contain_text("gives back")
    assert GIVEN_BACK not in colours(page)


def test_power_that_is_given_back_is_said(page: Any, bench: Bench) -> None:
    bench.route = driven([88.0, -12.0, 24.0], [0.0, 1.0, 0.5, 0.0], 1.0)
    plan(page)
    expect(page.locator("#legend")).to_contain_text("gives back")
    assert GIVEN_BACK in colours(page)


def test_nothing_is_written_with_a_sign_or_an_exponent(
    page: Any, bench: Bench, folder: Path
) -> None:
    made = results.material(folder)
    regime = results.regime(bias_w=-1.4e-14, share_of_squared_error=-1e-17)
    flat = {"x": [0.1, 0.4, 0.8], "bias_w": [-1.4e-14, 1e-15, 0.0], "stderr_w": [0.0, 0.0, 0.0]}
    compared = replace(
        results.comparison(made),
        regimes=(regime,),
        curves={"speed": {**flat, "rows": [10, 10, 10]}},
    )
    tiny = results.Estimate(-1.4e-14, 0.01, "m²")
    drag = results.candidate("air_drag", 0.97, parameters={"drag_area": tiny})
    diagnosed = results.diagnosis(made, candidates=(drag,))
    bench.reports = {
        "compare": as_html(compared),
        "diagnose": as_html(diagnosed),
    }
    work(page)
    where = page.locator("#comparison section", has_text="Where the model is wrong")
    where.wait_for()
    cells = where.locator("tbody td").all_inner_texts()
    assert (cells[1], cells[3]) == ("+0.000 W ± 0.20 W", "0.0 %")
    ranking = page.locator("#diagnosis section", has_text="What could be missing")
    expect(ranking).to_contain_text("drag_area = 0 ± 0.01 m²")
    page.locator("#comparison svg.chart").first.wait_for()
    assert not [words for words in words_of(page, "#comparison") if "e-" in words]


# Words of a chart that are cut off by its edge.
CLIPPED = """() => [...document.querySelectorAll('svg.chart')].flatMap((drawing) => {
  const frame = drawing.getBoundingClientRect();
  if (!frame.width) return [];
  const box = (e) => e.getBoundingClientRect();
  const words = [...drawing.querySelectorAll('text')];
  const outside = words.filter((w) => box(w).left < frame.left - 0.5
    || box(w).right > frame.right + 0.5
    || box(w).top < frame.top - 2 || box(w).bottom > frame.bottom + 4);
  return outside.map((w) => `${drawing.querySelector('title').textContent}: ${w.textContent}`);
})"""

# Words so small that nobody reads them; those of upright axes are turned.
SMALL = """() => [...document.querySelectorAll('svg.chart text')].filter((words) => {
  const {width, height} = words.getBoundingClientRect();
  return height > 0 && (words.classList.contains('label') ? Math.min(width, height) : height) < 9;
}).map((words) => words.textContent)"""


@pytest.fixture(scope="module")
def drawn(folder: Path) -> dict[str, str]:
    return workbench_reports(folder)


@pytest.mark.parametrize(
    "width",
    [
        360,
        1300,
        pytest.param(720, marks=pytest.mark.nightly),
        pytest.param(1920, marks=pytest.mark.nightly),
    ],
)
def test_all_words_of_all_charts_are_inside(
    settings: Settings,
    workers: ScriptedWorkers,
    bench: Bench,
    drawn: dict[str, str],
    width: int,
) -> None:
    # Figures as long as they come: high ground, much power, and names of all kinds.
    heights = [12041.26, 12041.31, 12041.22, 12041.3]
    bench.route = driven([10234.5, 1e4, -9876.5], heights, 4.0)
    bench.reports = drawn
    with opened(settings, workers, width=width) as page:
        plan(page)
        work(page)
        page.get_by_role("button", name="Adopt").click()
        page.locator("#versions svg circle").first.wait_for()
        ask(page)
        for place, charts in (("#along", 3), ("#comparison", 6), ("#diagnosis", 6)):
            expect(page.locator(f"{place} svg.chart:visible").nth(charts - 1)).to_be_visible()
        for now in (width, 400):  # the same after the window has become another one
            page.set_viewport_size({"width": now, "height": 850})
            assert page.evaluate(CLIPPED) == []
            assert page.evaluate(SMALL) == []
            assert page.evaluate("document.documentElement.scrollWidth") == now
