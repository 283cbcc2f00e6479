"""A service with API keys: the page asks for one once, and works as ever with it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import expect
from pydantic import SecretStr

from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.web.browser import CHROMIUM, browsed, served
from tests.service.web.reports import RELIEF, answer, answered

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt-get install chromium"),
]

ASKED = "This service asks for a key."
READY = "Choose a start and a goal."


def work(job: str, _: tuple[Any, ...]) -> str:
    return json.dumps(RELIEF if job == "relief" else answered(answer()))


def test_the_page_asks_for_a_key_until_it_is_right(
    settings: Settings, workers: ScriptedWorkers
) -> None:
    workers.work = work
    guarded = settings.model_copy(update={"api_keys": SecretStr("right")})
    with served(guarded, workers) as address, browsed(address, ready=ASKED) as page:
        asked = page.get_by_role("dialog", name="API key")
        asked.get_by_label("Key").fill("wrong")
        asked.get_by_role("button", name="Open").click()
        asked.get_by_text("does not know this key").wait_for()
        asked.get_by_label("Key").fill("right")
        asked.get_by_role("button", name="Open").click()
        asked.wait_for(state="hidden")
        page.get_by_text(READY).wait_for()
        page.reload()
        page.get_by_text(READY).wait_for()
        expect(asked).to_have_count(0)
