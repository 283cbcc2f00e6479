"""Runs the code blocks of a page as its reader would, in a folder of their own."""

from __future__ import annotations

import argparse
import asyncio
import importlib
import os
import re
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import httpx
import uvicorn

from service.cli import run
from service.http import create_app
from service.settings import Settings
from tests.documents.blocks import ROOT, Block
from tests.documents.checks import check_json, check_toml, check_yaml
from tests.documents.given import give

ADDRESS = "http://127.0.0.1:8000"
EXAMPLE_LOG, EXAMPLE_MODEL = "5f2d0c1b7a9e4433", "0d8f54c2a1b3e697"
"""Ids in examples; those of the last upload and of the last adoption stand in for them."""

EFFECTS = "planner/power/effects/"
UNTRIED = {
    r"make \w+": "sets up a machine or takes minutes; tests/test_documented.py knows the targets",
    r"docker (build|run) ": "there is no Docker where the tests run",
    r"python3 -m venv |\.venv/bin/pip install ": "installs; tests/test_packaging.py has the locks",
    r"\.venv/bin/python -m docs\.make_": "writes a page; a test compares it with its source",
    r"\.venv/bin/python -m pytest ": "the tests themselves",
}
"""Commands of the documents that the test does not run, with the reason."""


class WorkersHere:
    """Work of the service in threads of this process, which has everything loaded."""

    async def start(self) -> None:
        """Nothing to start."""

    async def stop(self) -> None:
        """Nothing to stop."""

    async def run(
        self, job: str, *arguments: Any, limited: bool = True, progress: Any = None
    ) -> Any:
        """Result of a function of service.jobs.worker."""
        from service.jobs import worker

        return await asyncio.to_thread(getattr(worker, job), *arguments)

    def state(self) -> dict[str, Any]:
        """Idle."""
        return {"alive": True, "workers": 1, "busy": 0, "waiting": 0}


@contextmanager
def served(store: Path) -> Iterator[str]:
    """Address of a service with a store of its own."""
    app = create_app(Settings(store_dir=store, job_workers=1), WorkersHere())
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="warning"))
    ready = threading.Event()
    begin = server.startup

    async def startup(sockets: Any = None) -> None:
        await begin(sockets)
        ready.set()

    server.startup = startup  # type: ignore[method-assign]
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        # Where nothing is compiled yet this takes minutes.
        while not ready.wait(1.0):
            assert thread.is_alive(), "the service did not start"
        host, port = server.servers[0].sockets[0].getsockname()
        yield f"http://{host}:{port}"
    finally:
        server.should_exit = True
        thread.join()


class Reader:
    """Works through a page.

    Attributes:
        folder: where the reader stands.
        address: of the service.
        namespace: of the page's programs.
        printed: by the last block that ran.
        effects: folder of effects that the page adds; what follows runs in processes that have it.
    """

    def __init__(self, folder: Path, address: str) -> None:
        self.folder, self.address = folder, address
        self.namespace: dict[str, Any] = {}
        self.printed = ""
        self.effects: Path | None = None
        self._ids: dict[str, str] = {}

    def read(self, block: Block) -> None:
        """Do what a block says; fails where it does not work.

        Raises:
            AssertionError: a command fails or prints something else than the page shows.
            Exception: what a program of the page raised.
        """
        os.chdir(self.folder)
        file = self.folder / block.title
        file.parent.mkdir(parents=True, exist_ok=True)
        give(file.parent if block.title else self.folder, block.text)
        if block.title and not (ROOT / block.title).exists():
            file.write_text(block.text, "utf-8")
            if block.title.startswith(EFFECTS):
                self.effects = file.parent
        match block.language:
            case "python":
                self._run_program(block)
            case "sh":
                self.printed = "".join(map(self._run_command, commands(block.text)))
            case "output":
                expect_output(block.text, self.printed)
            case "json":
                check_json(block.text)
            case "toml":
                check_toml(block.text, file)
            case "yaml":
                check_yaml(block.text, file)
            case "text":
                check_usage(block.text)
            case other:
                raise AssertionError(f"no fence with a known language: {other}")

    def _run_program(self, block: Block) -> None:
        space = self.namespace
        if block.title and (ROOT / block.title).exists():
            # Lines for a module of the repository: they see what that module has.
            name = block.title.removesuffix(".py").replace("/", ".")
            space = dict(vars(importlib.import_module(name)))
        text = block.text.replace(ADDRESS, self.address)
        if self.effects is not None and not block.title:
            self.printed = with_effects(self.effects, text)
            return
        out = StringIO()
        with redirect_stdout(out):
            exec(compile(text, block.place, "exec", dont_inherit=True), space)
        self.printed = out.getvalue()

    def _run_command(self, command: str) -> str:
        if any(re.match(pattern, command) for pattern in UNTRIED):
            return ""
        words = shlex.split(command, comments=True)
        words, target = (words[:-2], words[-1]) if words[-2:-1] == [">"] else (words, None)
        os.chdir(self.folder)
        match Path(words[0]).name:
            case "joulepath" if words[1:] == ["serve", "&"]:
                return ""  # one runs already
            case "joulepath":
                printed = self._joulepath(words[1:])
            case "curl":
                printed = self._curl(words[1:])
            case "python":
                assert words[1:2] != ["-m"], command
                program = Path(words[1])
                self._run_program(Block(words[1], 1, "python", "", program.read_text("utf-8")))
                printed = self.printed
            case other:
                raise AssertionError(f"no such command in these tests: {other}")
        if target is not None:
            Path(target).write_text(printed, "utf-8")
            return ""
        return printed

    def _joulepath(self, arguments: list[str]) -> str:
        if self.effects is None:
            return joulepath(arguments)
        program = f"import sys\nfrom service.cli import run\nsys.exit(run({arguments}))"
        return with_effects(self.effects, program)

    def _curl(self, words: list[str]) -> str:
        """What curl would print; the options that the documents use."""
        parser = argparse.ArgumentParser(exit_on_error=False)
        parser.add_argument("url")
        parser.add_argument("-s", action="store_true")
        parser.add_argument("-H", action="append", default=[])
        parser.add_argument("-d")
        parser.add_argument("-F")
        asked = parser.parse_args(words)
        sent: dict[str, Any] = {"headers": dict(line.split(": ", 1) for line in asked.H)}
        if asked.d:
            for example, real in self._ids.items():
                asked.d = asked.d.replace(example, real)
            sent["content"] = asked.d
        if asked.F:
            field, path = asked.F.split("=@")
            sent["files"] = {field: (path, (self.folder / path).read_bytes())}
        method = "POST" if asked.d or asked.F else "GET"
        url = asked.url.replace(ADDRESS, self.address)
        answer = httpx.request(method, url, timeout=300, **sent)
        while answer.is_success and answer.json().get("state") in ("queued", "running"):
            answer = httpx.get(f"{self.address}/v1/jobs/{answer.json()['id']}?wait=60", timeout=300)
        assert answer.is_success, answer.text
        self._remember(answer)
        return answer.text

    def _remember(self, answer: httpx.Response) -> None:
        if answer.url.path == "/v1/logs":
            self._ids[EXAMPLE_LOG] = answer.json()["id"]
        elif model := (answer.json().get("result") or {}).get("model_id"):
            self._ids[EXAMPLE_MODEL] = model


def commands(text: str) -> list[str]:
    """Commands of a shell block, continued lines joined."""
    lines = text.replace("\\\n", " ").splitlines()
    return [line for line in lines if line.strip() and not line.startswith("#")]


def joulepath(arguments: list[str]) -> str:
    """What the command prints; it must succeed."""
    out, said = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(said):
        status = run(arguments)
    assert status == 0, said.getvalue()
    return out.getvalue()


def with_effects(folder: Path, program: str) -> str:
    """What a program prints in a process whose catalogue has one more folder of effects."""
    head = f"import planner.power.effects\nplanner.power.effects.__path__.append({str(folder)!r})\n"
    done = subprocess.run(
        [sys.executable, "-c", head + program], capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def check_usage(text: str) -> None:
    """Every command and option of a usage exists; other text is for the eye."""
    usage = re.sub(r"\n +", " ", text)
    for line in re.findall(r"^joulepath (.+)$", usage, re.MULTILINE):
        names = re.match(r"\S+", line)
        assert names is not None
        shown = joulepath([names[0], "--help"])
        for option in re.findall(r"--[a-z-]+", line):
            assert option in shown, f"joulepath {names[0]} has no {option}"


NUMBER = re.compile(r"-?\d+(?:,\d{3})*(?:\.\d+)?")
TOLERANCE = 0.05
"""Share by which a printed number may differ: a time limit or a processor may change a route."""


def expect_output(shown: str, printed: str) -> None:
    """Every line that a page shows was printed, in order; numbers may differ a little.

    A line of three dots stands for lines that the page leaves out.
    """
    left = printed.splitlines()
    for line in filter(str.strip, shown.splitlines()):
        if line.strip() in ("…", "..."):
            continue
        at = next((n for n, other in enumerate(left) if same_line(line, other)), None)
        assert at is not None, f"not printed: {line!r}\nin\n{printed}"
        del left[: at + 1]


def same_line(shown: str, printed: str) -> bool:
    """Whether two lines have the same words and nearly the same numbers."""
    words = [NUMBER.sub("#", " ".join(line.split())) for line in (shown, printed)]
    if words[0] != words[1]:
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return all(_close(one, other) for one, other in pairs)


def _close(shown: str, printed: str) -> bool:
    one, other = (float(number.replace(",", "")) for number in (shown, printed))
    last_digit = 10.0 ** -len(shown.partition(".")[2])
    return abs(one - other) <= max(TOLERANCE * abs(one), last_digit) * (1 + 1e-9)
