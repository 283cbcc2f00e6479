"""What the workbench shows is about the log and the model that are chosen, or marked as old."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from playwright.sync_api import expect

from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, opened
from tests.service.web.reports import reporting
from tests.service.workbench import CSV, Workbench

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

OLD = "What is shown below answers an earlier question: the log or the model was changed."


class TwoVehicles(ScriptedWorkers):
    """Of which one can be changed for the other."""

    async def run(self, job: str, *arguments: Any, **how: Any) -> Any:
        known = await super().run(job, *arguments, **how)
        if job == "catalogues":
            known.vehicles.append({"name": "robotino", "battery_j": None})
        return known


@pytest.fixture
def workers() -> ScriptedWorkers:
    return TwoVehicles()


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Workbench:
    made = Workbench()
    workers.work = reporting(made)
    return made


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers, bench: Workbench) -> Iterator[Any]:
    """The page with two logs, the second one chosen."""

    with opened(settings, workers) as made:
        for name in ("first.csv", "second.csv"):
            content = CSV + f"{name[0]},2,0.5,0,0,12\n".encode()
            file = {"name": name, "mimeType": "text/csv", "buffer": content}
            made.get_by_label("Log (CSV, Parquet)").set_input_files(file)
            made.get_by_role("button", name="Upload").click()
            made.get_by_text(f"{name} was read").wait_for()
        yield made


def choose_log(page: Any, name: str) -> None:
    page.get_by_label("Uploaded log").select_option(label=f"{name}: 1 rows, 1 runs")


def choose_model(page: Any, name: str) -> None:
    page.get_by_label("Start from").select_option(name)


CHANGES = {
    "log": lambda page: choose_log(page, "first.csv"),
    "vehicle": lambda page: choose_model(page, "robotino"),
}


@pytest.mark.parametrize("verb", ["Compare", "Diagnose", "Adopt"])
@pytest.mark.parametrize("what", CHANGES)
def test_a_change_ends_the_job_that_runs(
    page: Any, bench: Workbench, workers: ScriptedWorkers, verb: str, what: str
) -> None:
    if verb == "Adopt":
        page.get_by_role("button", name="Diagnose").click()
        page.get_by_text("Diagnosed.").wait_for()
    bench.hang = True
    page.get_by_role("button", name=verb, exact=True).click()
    page.get_by_text("Starting …").wait_for()
    ended = page.expect_response(lambda r: r.request.method == "DELETE" and "/jobs/" in r.url)
    with ended as response:
        CHANGES[what](page)
    assert response.value.json()["state"] == "cancelled"
    page.get_by_text("Stopped, as the log or the model was changed.").wait_for()
    expect(page.get_by_role("button", name="Compare")).to_be_enabled()
    expect(page.locator("#findings")).to_have_attribute("aria-busy", "false")
    # The next one is about what is chosen now.
    bench.hang = False
    page.get_by_role("button", name="Compare").click()
    page.get_by_text("Compared.").wait_for()
    expect(page.get_by_text(OLD)).not_to_be_visible()
    expect(page.get_by_text("The model lacks air_drag.")).not_to_be_visible()


def test_a_job_that_began_late_is_ended_too(page: Any, bench: Workbench) -> None:
    bench.hang = True
    held: list[Any] = []
    page.route("**/v1/compare?*", lambda asked: held.append(asked))
    with page.expect_request("**/v1/compare?*"):
        page.get_by_role("button", name="Compare").click()
    choose_log(page, "first.csv")
    ended = page.expect_response(lambda r: r.request.method == "DELETE" and "/jobs/" in r.url)
    with ended as response:
        held[0].continue_()
    assert response.value.json()["state"] == "cancelled"
    expect(page.get_by_text("Stopped, as the log or the model was changed.")).to_be_visible()


@pytest.mark.parametrize("what", CHANGES)
def test_findings_of_another_question_are_marked(page: Any, what: str) -> None:
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("The model lacks air_drag.").wait_for()
    expect(page.get_by_role("button", name="Adopt")).to_be_enabled()
    CHANGES[what](page)
    page.get_by_text(OLD).wait_for()
    # What was found elsewhere is not adopted here.
    expect(page.get_by_role("button", name="Adopt")).to_be_disabled()
    expect(page.locator("#diagnosis-card.old")).to_be_visible()
    choose_log(page, "second.csv")
    choose_model(page, "minibalance")
    expect(page.get_by_text(OLD)).not_to_be_visible()
    expect(page.get_by_role("button", name="Adopt")).to_be_enabled()
    # A comparison of something else does not stand beside this diagnosis.
    CHANGES[what](page)
    page.get_by_role("button", name="Compare").click()
    page.get_by_text("Compared.").wait_for()
    expect(page.get_by_text(OLD)).not_to_be_visible()
    expect(page.get_by_text("The model lacks air_drag.")).not_to_be_visible()


def test_remarks_are_those_of_the_log_that_is_chosen(page: Any) -> None:
    held: list[Any] = []
    first = page.locator("#log option").evaluate_all(
        "options => options.find((o) => o.text.startsWith('first')).value"
    )
    page.route(f"**/v1/logs/{first}", lambda asked: held.append(asked))
    with page.expect_request(f"**/v1/logs/{first}"):
        choose_log(page, "first.csv")
    # Those of the log before do not stand under this one's name.
    expect(page.locator("#log-remarks")).not_to_be_visible()
    choose_log(page, "second.csv")
    page.locator("#log-remarks").wait_for()
    late = {"report": [], "derived": [], "assumed": ["of the first log"]}
    with suppress(Exception):
        held[0].fulfill(json=late)
    # A round trip later it would be there.
    page.evaluate("fetch('/v1/logs').then((answer) => answer.json())")
    expect(page.locator("#log-notes li")).to_have_text(["a gap", "Assumed: flat"])


def test_findings_do_not_outlive_a_return_to_an_older_version(page: Any, bench: Workbench) -> None:
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("Diagnosed.").wait_for()
    page.get_by_role("button", name="Adopt").click()
    page.get_by_text("Adopted").wait_for()
    bench.saved = json.dumps(documents.model_document(3))
    page.evaluate(
        "body => fetch('/v1/models', {method: 'POST', body,"
        " headers: {'Content-Type': 'application/json'}})",
        bench.saved,
    )
    page.reload()
    page.get_by_label("Start from").select_option(label="minibalance: version 3, air_drag: 0.52 W")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("The model lacks air_drag.").wait_for()
    page.get_by_role("button", name="Back to it").first.click()
    page.get_by_text("is as version").wait_for()
    expect(page.get_by_text("The model lacks air_drag.")).not_to_be_visible()
