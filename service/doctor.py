"""Whether joulepath can work on this machine, and what would fix it: ``joulepath doctor``.

    findings = examine()
    [one.name for one in findings if one.status == "broken"]

Each check looks at what a command or the service needs, in the way in which they use it.
"""

from __future__ import annotations

import os
import platform
import re
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from planner.code_cache import cache_base, code_folder, compiled_modules, is_compiled, state
from planner.errors import InputError
from planner.validation import first_complaint
from service.settings import Settings
from service.store import Store

LEAST_MEMORY_MB = 1024
"""MiB that a plan on a map of a million cells and a diagnosis take together."""
COMPILE = "python -m service.compiling"


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        name: what was looked at.
        status: "odd" works, but less well than it could.
        found: in words.
        fix: what would help; empty where nothing has to.
        seconds: s that it took, of what is timed.
    """

    name: str
    status: Literal["ok", "odd", "broken"]
    found: str
    fix: str = ""
    seconds: float | None = None

    def to_json(self) -> dict[str, Any]:
        """As the command prints it."""
        return asdict(self)


def examine() -> list[Finding]:
    """All checks, in the order in which a user would read them.

    A plan and a diagnosis are not tried where something is broken: without a folder for compiled
    code they would compile for minutes.
    """
    findings = [finding for check in CHECKS for finding in check()]
    if not any(one.status == "broken" for one in findings):
        findings += _trials()
    return findings


def _versions() -> Iterator[Finding]:
    packages = [re.split(r"[^A-Za-z0-9._-]", one)[0] for one in requires("joulepath") or []]
    wanted = [
        one
        for one, line in zip(packages, requires("joulepath") or [], strict=True)
        if "extra ==" not in line
    ]
    there, missing = [f"Python {platform.python_version()}"], []
    for name in ("joulepath", *wanted):
        try:
            there.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    if missing:
        fix = f"pip install {' '.join(missing)}"
        yield Finding("versions", "broken", f"not installed: {', '.join(missing)}", fix)
    else:
        yield Finding("versions", "ok", ", ".join(there))


def _compiled_code() -> Iterator[Finding]:
    modules = compiled_modules()
    folder = cache_base() / "compiled"
    if "NUMBA_CACHE_DIR" in os.environ:
        found = f"kept in NUMBA_CACHE_DIR, {os.environ['NUMBA_CACHE_DIR']}"
        yield Finding("compiled code", "ok", found)
    elif code_folder(min(modules)) is None:
        fix = "set JOULEPATH_CACHE_DIR to a folder that can be written"
        yield Finding("compiled code", "broken", f"{folder} cannot be written", fix)
    else:
        done = sum(map(is_compiled, modules))
        found = f"{done} of {len(modules)} modules in {folder}, state {state()}"
        whole = done == len(modules)
        yield Finding("compiled code", "ok" if whole else "odd", found, "" if whole else COMPILE)


def _machine() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    one = (cores or 1) < 2
    fix = "a second core: searches use two" if one else ""
    yield Finding("cores", "odd" if one else "ok", str(cores or 1), fix)
    free = memory_mb()
    if free is None:
        yield Finding("memory", "ok", "not known on this system")
        return
    little = free < LEAST_MEMORY_MB
    fix = f"{LEAST_MEMORY_MB} MiB for large maps and logs" if little else ""
    yield Finding("memory", "odd" if little else "ok", f"{free:.0f} MiB available", fix)


def memory_mb() -> float | None:
    """MiB that programs may still take; None where the system does not say."""
    try:
        text = Path("/proc/meminfo").read_text()
    except OSError:
        return None
    found = re.search(r"^MemAvailable:\s+(\d+) kB", text, re.MULTILINE)
    return int(found[1]) / 1024 if found else None


def _service() -> Iterator[Finding]:
    try:
        settings = Settings()
    except ValidationError as error:
        first = first_complaint(error.errors(include_url=False))
        name = f"JOULEPATH_{first.place.upper()}"
        yield Finding("settings", "broken", f"{name}: {first.message}", f"unset {name}")
        return
    yield Finding("settings", "ok", f"serve would listen on {settings.host}:{settings.port}")
    try:
        store = Store.open(settings)
    except InputError as error:
        found = f"{error.field}: {error.problem}"
        yield Finding("store and database", "broken", found, error.accepted)
        return
    folder = store.files.folder
    store.close()
    yield Finding("store and database", "ok", str(folder))


def _folders() -> Iterator[Finding]:
    try:
        with tempfile.TemporaryFile():
            pass
    except OSError as error:
        fix = "set TMPDIR to a folder that can be written and is not full"
        yield Finding("temporary folder", "broken", str(error), fix)
    else:
        yield Finding("temporary folder", "ok", tempfile.gettempdir())


def _plan() -> None:
    from planner import plan_route

    plan_route(map="test-bench", start={"x": 2.0, "y": 0.8}, goal={"x": 11.0, "y": 2.3})


def _diagnosis() -> None:
    from planner import diagnose
    from planner.telemetry.virtual import Noise, VirtualRobot

    robot = VirtualRobot("minibalance", hidden={"air_drag": {"size": 0.05}}, seed=1)
    log = robot.drive(robot.profile("rich", runs=4, rows=200), noise=Noise(level=0.02))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.parquet"
        log.write_parquet(file)
        diagnose(file, "minibalance")


TRIALS: dict[str, Callable[[], None]] = {"a plan": _plan, "a diagnosis": _diagnosis}


def _trials() -> Iterator[Finding]:
    for name, trial in TRIALS.items():
        begun = time.perf_counter()
        try:
            trial()
        except Exception as error:
            found = f"{type(error).__name__}: {error}".splitlines()[0]
            fix = f"{COMPILE}, or install joulepath again"
            yield Finding(name, "broken", found, fix)
        else:
            seconds = time.perf_counter() - begun
            yield Finding(name, "ok", f"{seconds:.1f} s", seconds=seconds)


CHECKS = (_versions, _compiled_code, _machine, _service, _folders)
