"""The workbench on the page: upload, compare, diagnose, adopt, plan with it, go back."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from planner.errors import LogError
from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, opened
from tests.service.web.reports import reporting, workbench_reports
from tests.service.workbench import CSV, SAVED, Workbench

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Workbench:
    """What the workers do."""
    made = Workbench()
    workers.work = reporting(made)
    return made


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return workbench_reports(tmp_path_factory.mktemp("reports"))


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers, bench: Workbench) -> Iterator[Any]:
    """The page, opened."""
    with opened(settings, workers) as made:
        yield made


def upload(page: Any) -> None:
    page.get_by_text("Upload a log of measured power to begin.").wait_for()
    expect(page.get_by_role("button", name="Diagnose")).to_be_disabled()
    file = {"name": "drive.csv", "mimeType": "text/csv", "buffer": CSV}
    page.get_by_label("Log (CSV, Parquet)").set_input_files(file)
    page.get_by_role("button", name="Upload").click()


def test_from_a_log_to_a_route_with_what_was_learnt(
    page: Any, bench: Workbench, workers: ScriptedWorkers, drawn: dict[str, str]
) -> None:
    workers.work = reporting(bench, {"compare": drawn["compare"], "diagnose": drawn["diagnose"]})
    upload(page)
    page.get_by_text("drive.csv was read: 1 rows in 1 runs.").wait_for()
    expect(page.locator("#log-notes li")).to_have_text(["a gap", "Assumed: flat"])

    page.get_by_role("button", name="Compare").click()
    page.get_by_text("misses the measured power by 2.36 W rms").wait_for()
    # 48.5 kJ predicted, 50 kJ measured.
    page.get_by_text("3.0 % too low").wait_for()
    regimes = page.locator("#comparison section", has_text="Where the model is wrong")
    expect(regimes.locator("tbody tr")).to_contain_text("faster than 0.4 m/s")
    # A line over speed, a point for each ground.
    speed, ground = (
        page.locator("#comparison svg", has_text=f"Residual over {axis}")
        for axis in ("speed", "ground")
    )
    expect(speed.locator("polyline.before")).to_have_count(1)
    expect(ground.locator("circle")).to_have_count(2)

    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Something is missing:").wait_for()
    ranking = page.locator("#diagnosis section", has_text="What could be missing")
    ranking.wait_for()
    row = ranking.locator("tbody tr").first.inner_text()
    assert ["size = 0.1234 ± 0.0056 m²" in row, "97 %" in row] == [True, True]
    assert ["tied with" in ranking.inner_text(), "vibration" in row] == [True, True]
    untold = page.locator("#diagnosis section", has_text="What this log cannot identify")
    expect(untold).to_contain_text("wear, battery_sag")
    # What was found last stands first.
    expect(page.locator("#findings article:visible > h3")).to_have_text(
        ["What is missing", "Where the model fails"]
    )

    page.get_by_role("button", name="Adopt").click()
    page.get_by_text("held-out error 2.10 W → 0.52 W").wait_for()
    assert bench.tasks[-1][1].effects == ("diagnosed",)
    expect(page.locator("#versions svg circle.solid")).to_have_count(1)

    for field, value in (("start-x", 2), ("start-y", 1), ("goal-x", 8), ("goal-y", 4)):
        page.locator(f"#{field}").fill(str(value))
    page.get_by_role("button", name="Plan with it").click()
    page.get_by_text("200.0 J over").wait_for()
    (request,) = [arguments[0] for job, arguments in workers.asked if job == "plan_route"]
    assert request.vehicle is None
    assert Path(request.model).read_text() == SAVED

    # The next diagnosis starts from the new version.
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Diagnosed.").wait_for()
    assert bench.tasks[-1][1].vehicle is None
    assert Path(bench.tasks[-1][1].model).read_text() == SAVED


def test_another_effect_than_the_diagnosed_one_is_adopted(page: Any, bench: Workbench) -> None:
    upload(page)
    page.get_by_text("was read").wait_for()
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_label("Take into the model").select_option("viscous_drag")
    page.get_by_role("button", name="Adopt").click()
    page.get_by_text("Adopted").wait_for()
    assert bench.tasks[-1][1].effects == ("viscous_drag",)


def test_going_back_makes_a_version(page: Any, bench: Workbench) -> None:
    bench.saved = json.dumps(documents.model_document(3))
    page.evaluate(
        "body => fetch('/v1/models', {method: 'POST', body,"
        " headers: {'Content-Type': 'application/json'}})",
        bench.saved,
    )
    page.reload()
    page.get_by_label("Start from").select_option(label="minibalance: version 3, air_drag: 0.52 W")
    rows = page.locator("#versions tbody").first.locator("tr")
    rows.nth(1).wait_for()
    expect(page.locator("#versions svg circle.solid")).to_have_count(2)
    # To the first of the two; the second is what stands.
    expect(page.get_by_role("button", name="Back to it")).to_have_count(1)
    # What can be done with a version needs no scrolling, on a telephone neither.
    page.set_viewport_size({"width": 390, "height": 800})
    for button in page.locator("#versions tbody :is(button, a)").all():
        box = button.bounding_box()
        assert box["x"] + box["width"] < 390
    rows.nth(0).get_by_role("button", name="Back to it").click()
    page.get_by_text("Version 3 is as version 2 was.").wait_for()
    job, path = bench.tasks[-1]
    assert job == "revert"
    assert Path(path).read_text() == bench.saved
    expect(page.locator("#start-model option[data-kind=model]")).to_have_count(2)


def test_a_log_that_cannot_be_used_says_why(page: Any, bench: Workbench) -> None:
    bench.refusal = LogError("drive.csv", "has no column 'power'", accepted="columns")
    upload(page)
    page.get_by_role("alert").get_by_text("drive.csv: has no column 'power'").wait_for()
    expect(page.locator("#log option")).to_have_count(0)


def test_a_long_job_is_cancelled(page: Any, bench: Workbench) -> None:
    upload(page)
    page.get_by_text("was read").wait_for()
    bench.hang = True
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Starting …").wait_for()
    expect(page.get_by_role("button", name="Compare")).to_be_disabled()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_role("alert").get_by_text("Cancelled.").wait_for()
    expect(page.get_by_role("button", name="Compare")).to_be_enabled()


def test_the_focus_outlives_what_a_key_began(page: Any, bench: Workbench) -> None:
    def press(name: str, said: str) -> None:
        page.get_by_role("button", name=name, exact=True).last.press("Enter")
        page.get_by_text(said).wait_for()

    upload(page)
    page.get_by_text("was read").wait_for()
    press("Diagnose", "Diagnosed.")
    expect(page.locator("#diagnose")).to_be_focused()
    # The button goes with its card; what came of it stands in the message.
    press("Adopt", "Adopted")
    expect(page.locator("#work-message")).to_be_focused()
    for field, value in (("start-x", 2), ("start-y", 1), ("goal-x", 8), ("goal-y", 4)):
        page.locator(f"#{field}").fill(str(value))
    press("Plan", "200.0 J over")
    expect(page.locator("#plan")).to_be_focused()
    press("Plan with it", "200.0 J over")
    expect(page.locator("#vehicle")).to_be_focused()
    bench.hang = True
    press("Compare", "Starting …")
    press("Cancel", "Cancelled.")
    expect(page.locator("#compare")).to_be_focused()


def test_a_log_that_was_uploaded_under_another_name_is_said(page: Any) -> None:
    upload(page)
    page.get_by_text("drive.csv was read: 1 rows in 1 runs.").wait_for()
    again = {"name": "again.csv", "mimeType": "text/csv", "buffer": CSV}
    page.get_by_label("Log (CSV, Parquet)").set_input_files(again)
    page.get_by_role("button", name="Upload").click()
    page.get_by_text("again.csv was uploaded before: drive.csv was read").wait_for()
