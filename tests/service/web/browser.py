"""The page in a real browser, served by an application whose workers follow a script."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import uvicorn

from service.http import create_app
from service.settings import Settings
from tests.service.conftest import ScriptedWorkers

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@contextmanager
def served(settings: Settings, workers: ScriptedWorkers, port: int = 0) -> Iterator[str]:
    """A server on this machine, with its address; port 0 picks one."""
    config = uvicorn.Config(create_app(settings, workers), port=port, log_level="error")
    server = uvicorn.Server(config)
    ready = threading.Event()
    startup = server.startup

    async def tell(*arguments: Any, **named: Any) -> None:
        await startup(*arguments, **named)
        ready.set()

    server.startup = tell  # type: ignore[method-assign]
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        assert ready.wait(timeout=20)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join(timeout=20)


@contextmanager
def browsed(
    address: str,
    *,
    width: int = 1300,
    prepare: Callable[[Any], None] = lambda page: None,
    ready: str = "Choose a start and a goal.",
) -> Iterator[Any]:
    """The page at an address; fails if it complains or asks anyone else for anything.

    Args:
        address: of the server.
        width: of the window, pixels.
        prepare: called with the page before it is loaded.
        ready: what it says once it is loaded.
    """
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM,
            args=["--no-sandbox", "--disable-gpu", "--disable-background-networking"],
        )
        page = browser.new_page(viewport={"width": width, "height": 850})
        complaints: list[str] = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda m: complaints.append(m.text) if "Policy" in m.text else None)
        foreign: list[str] = []
        page.on(
            "request",
            lambda r: None if r.url.startswith((address, "data:")) else foreign.append(r.url),
        )
        prepare(page)
        page.goto(address)
        page.get_by_text(ready).wait_for()
        yield page
        browser.close()
    assert complaints == []
    assert foreign == []


@contextmanager
def opened(settings: Settings, workers: ScriptedWorkers, **how: Any) -> Iterator[Any]:
    """The page, served; ``how`` as of ``browsed``."""
    with served(settings, workers) as address, browsed(address, **how) as page:
        yield page
