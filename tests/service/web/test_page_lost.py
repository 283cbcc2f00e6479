"""A server that is gone: one sentence, nothing that was typed is lost, and the page finds it again.

Every test fails as well if an error of the page is handled by nobody, see ``browsed``.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, browsed, opened, served
from tests.service.web.reports import RELIEF, answer, answered, reporting
from tests.service.workbench import CSV, Workbench

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

SENTENCE = "The server does not answer. Start it with `joulepath serve` and try again."
PLACES = {"start-x": 2, "start-y": 1, "goal-x": 8, "goal-y": 4}


def work(job: str, _: tuple[Any, ...]) -> str:
    return json.dumps(RELIEF if job == "relief" else answered(answer()))


def fill(page: Any) -> None:
    for field, value in PLACES.items():
        page.locator(f"#{field}").fill(str(value))


def typed(page: Any) -> dict[str, int]:
    return {field: int(page.locator(f"#{field}").input_value()) for field in PLACES}


def test_a_server_that_ended_is_said_and_found_again(
    settings: Settings, workers: ScriptedWorkers
) -> None:
    workers.work = work
    with ExitStack() as before, ExitStack() as browser:
        address = before.enter_context(served(settings, workers))
        page = browser.enter_context(browsed(address))
        fill(page)
        before.close()
        page.get_by_role("button", name="Plan", exact=True).click()
        page.get_by_role("alert").get_by_text(SENTENCE).wait_for()
        assert typed(page) == PLACES
        with served(settings, workers, int(address.rpartition(":")[2])):
            page.get_by_role("button", name="Plan", exact=True).click()
            page.get_by_text("200.0 J over").wait_for()
            browser.close()


@pytest.fixture
def page(settings: Settings, workers: ScriptedWorkers) -> Iterator[Any]:
    workers.work = work
    with opened(settings, workers) as made:
        fill(made)
        yield made


LOSSES: dict[str, Callable[[Any], None]] = {
    "refused": lambda asked: asked.abort("connectionrefused"),
    "broken off": lambda asked: asked.abort("connectionreset"),
    "half an answer": lambda asked: asked.fulfill(
        body='{"status": "ok", "rou', content_type="application/json"
    ),
    "a proxy's page": lambda asked: asked.fulfill(status=502, body="<h1>Bad Gateway</h1>"),
}


@pytest.mark.parametrize("loss", LOSSES)
def test_a_server_that_is_lost_while_it_plans(page: Any, loss: str) -> None:
    page.route("**/v1/routes?*", LOSSES[loss])
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_role("alert").get_by_text(SENTENCE, exact=True).wait_for()
    page.unroute("**/v1/routes?*")
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_text("200.0 J over").wait_for()


def test_a_service_that_is_busy_says_so_itself(page: Any) -> None:
    problem = {"title": "Busy", "status": 503, "detail": "all workers are busy"}
    page.route("**/v1/routes?*", lambda asked: asked.fulfill(status=503, json=problem))
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_role("alert").get_by_text("all workers are busy").wait_for()


def test_a_page_that_was_opened_too_late_fills_when_the_server_is_back(
    settings: Settings, workers: ScriptedWorkers
) -> None:
    workers.work = work
    lost: list[str] = []

    def lose_once(asked: Any) -> None:
        """The first attempt at each of them fails."""
        if asked.request.url in lost:
            asked.continue_()
        else:
            lost.append(asked.request.url)
            asked.abort("connectionrefused")

    with opened(settings, workers, prepare=lambda p: p.route("**/v1/**", lose_once)) as page:
        # Catalogues, models, logs and the relief; a layer of the ground may follow.
        assert sum("/ground" not in url for url in lost) == 6
        fill(page)
        page.unroute("**/v1/**")
        page.get_by_role("button", name="Plan", exact=True).click()
        page.get_by_text("200.0 J over").wait_for()


def test_a_job_is_followed_again_when_the_server_is_back(
    page: Any, workers: ScriptedWorkers
) -> None:
    workers.work = reporting(Workbench())
    file = {"name": "drive.csv", "mimeType": "text/csv", "buffer": CSV}
    page.get_by_label("Log (CSV, Parquet)").set_input_files(file)
    page.get_by_role("button", name="Upload").click()
    page.get_by_text("was read").wait_for()

    page.route("**/v1/jobs/**", LOSSES["refused"])
    page.get_by_role("button", name="Compare").click()
    page.locator("#work-message").get_by_text(SENTENCE).wait_for()
    # Nobody to tell that the job is not wanted: that is said too, and handled.
    page.get_by_role("button", name="Cancel").click()
    page.unroute("**/v1/jobs/**")
    page.get_by_text("misses the measured power by 2.00 W rms").wait_for()

    page.route("**/v1/diagnose?*", LOSSES["refused"])
    page.get_by_role("button", name="Diagnose").click()
    page.locator("#work-message").get_by_text(SENTENCE).wait_for()
    page.unroute("**/v1/diagnose?*")
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_text("The model lacks air_drag.").wait_for()
