"""Compile for this machine, once, in as many processes as there are cores.

    python -m service.compiling         # what `make setup` and the container's build run
    compile_once(show_on_stderr)        # before a command that plans: nothing to do the second time
    compile_for_planning(adopted)       # after an adoption

A first plan in one process compiles for a minute. Here modules with compiled code are imported side
by side, each after those that it imports; then small questions are answered, which compiles what
only a call does. All of it is kept on disk. A file marks that the present content is compiled.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import suppress
from importlib import import_module
from typing import Any

from planner.code_cache import cache_base, compiled_modules, is_compiled, state
from planner.errors import Cancelled
from service.lifetime import end_with_parent

MOST_PROCESSES = 4
"""More processes wait for one another: few modules do not depend on others."""
MANY_MISSING = 0.5
"""Share of modules without compiled code at which a command compiles before it starts."""


def _route() -> None:
    from planner import plan_route

    plan_route(map="test-bench", start={"x": 2.0, "y": 0.8}, goal={"x": 11.0, "y": 2.3})


def _model() -> None:
    from planner.power.model import PowerModel
    from planner.power.vehicles import load_vehicle

    compile_for_planning(PowerModel.from_vehicle(load_vehicle("minibalance")))


QUESTIONS: Mapping[str, tuple[Callable[[], None], str]] = {
    "the power model": (_model, "planner.power.kernels.kernel"),
    "a route": (_route, ""),
}
"""Name → what compiles by being called, and the module it needs first; "" needs all of them."""


def compile_once(say: Callable[[int, int], None], least_missing: float = MANY_MISSING) -> bool:
    """Compile what is not on disk yet.

    Args:
        say: called with the finished steps and all steps.
        least_missing: share of the modules without compiled code from which it is worth while;
            fewer are compiled as they are met.

    Returns:
        whether there was anything to do.
    """
    mark = cache_base() / "compiled" / f"ready-{state()}"
    if mark.exists() or "NUMBA_CACHE_DIR" in os.environ:
        return False
    modules = compiled_modules()
    missing = sum(not is_compiled(module) for module in modules)
    if missing < least_missing * len(modules):
        return False
    run(needs(), say, min(os.cpu_count() or 1, MOST_PROCESSES))
    with suppress(OSError):  # looked at again next time
        mark.touch()
    return True


def compile_for_planning(
    model: Any,
    progress: Callable[[float, str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> None:
    """Compile what the first route of a new model would wait for; it is kept on disk.

    Args:
        model: a PowerModel.
        progress: called with the share done and a sentence.
        cancelled: asked before each kernel and after the last.

    Raises:
        Cancelled: ``cancelled`` said so.
    """
    if progress is not None:
        progress(1.0, "compiling the new model")
    for kernel in ("kernel", "limits_kernel", ""):
        if cancelled is not None and cancelled():
            raise Cancelled("cancelled by the caller")
        if kernel:
            getattr(model, kernel)


def needs() -> dict[str, set[str]]:
    """Steps by name, modules and questions → steps that each one waits for."""
    modules = compiled_modules()
    questions = {name: {first} if first else {*modules} for name, (_, first) in QUESTIONS.items()}
    return modules | questions


def run(waiting: dict[str, set[str]], say: Callable[[int, int], None], processes: int) -> None:
    """Carry out steps, each after those that it waits for."""
    steps, done = len(waiting), set[str]()
    say(0, steps)
    context = multiprocessing.get_context("spawn")
    running: dict[Future[None], str] = {}
    with ProcessPoolExecutor(processes, context, end_with_parent) as pool:
        while waiting or running:
            for name in order(waiting, done, [*running.values()], processes):
                del waiting[name]
                running[pool.submit(step, name)] = name
            for finished in wait(running, return_when=FIRST_COMPLETED).done:
                finished.result()
                done.add(running.pop(finished))
                say(len(done), steps)


def order(
    waiting: Mapping[str, set[str]], done: Collection[str], running: Sequence[str], most: int
) -> list[str]:
    """Steps to begin: those that wait for nothing any more, the long questions first.

    A module brings its whole part of the package along, such as planner.search. So two of one part
    side by side would both compile what a third one has; they follow one another.
    """
    busy = [part_of(name) for name in running]
    begun: list[str] = []
    for name in sorted(waiting, key=lambda name: name not in QUESTIONS):
        room = len(busy) < most and part_of(name) not in busy
        if room and waiting[name].issubset(done):
            begun.append(name)
            busy.append(part_of(name))
    return begun


def part_of(name: str) -> str:
    """Part of the package that a step compiles; a question is one of its own."""
    return name if name in QUESTIONS else ".".join(name.split(".")[:2])


def step(name: str) -> None:
    """One step, in a process of its own or in this one."""
    if name in QUESTIONS:
        QUESTIONS[name][0]()
    else:
        import_module(name)


def show_on_stderr(done: int, steps: int) -> None:
    """A line of progress that overwrites itself on a terminal; elsewhere the first and last."""
    terminal = sys.stderr.isatty()
    if terminal or done in (0, steps):
        start, end = ("\r", "" if done < steps else "\n") if terminal else ("", "\n")
        words = f"compiling for this machine, once: {done} of {steps}"
        print(f"{start}joulepath: {words}", end=end, file=sys.stderr, flush=True)  # noqa: T201


if __name__ == "__main__":
    compile_once(show_on_stderr, least_missing=0.0)
