"""Chapters of the demonstration.

Each chapter prints what it finds and adds its answers to one page, demo/report.html. The last one
is about a robot that is not as its model says; what its log tells is on demo/diagnosis.html.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from planner import Answer, plan_route
from planner.amounts import joules
from planner.report import write_report
from service.cli import as_tables, grid
from service.demo.closing_the_loop import ERRANDS, ClosedLoop, close_the_loop

REPORT = Path("demo") / "report.html"

DIAGNOSIS = "diagnosis.html"
HIDDEN = "regeneration_limit"

Answers = Mapping[str, Answer]


@dataclass(frozen=True)
class Question:
    """One route to plan: its heading, its introduction and its request."""

    heading: str
    story: str
    request: Mapping[str, Any]


RELIEF = (
    Question(
        "Across measured relief",
        "The Jacksboro fault in Tennessee, reduced 1:100, so that a robot of 12 kg meets real "
        "valleys and ridges at its own size. Straight ahead is short and steep.",
        {"map": "jacksboro-1to100", "start": {"x": 93, "y": 225}, "goal": {"x": 212, "y": 73}},
    ),
    Question(
        "The same fault at its own scale",
        "Kilometres of hills on cells of 75 m by 92 m: is one charge of the battery enough?",
        {"map": "jacksboro", "start": {"x": 18000, "y": 14000}, "goal": {"x": 28000, "y": 26000}},
    ),
)

_DOCK = {"map": "warehouse", "start": {"x": 1.5, "y": 2}, "goal": {"x": 27, "y": 17}}
WAREHOUSE = (
    Question(
        "Through a warehouse, up to the dock",
        "Shelves, a passage narrower than the robot is long, carpet, a wet patch and two ramps of "
        "different steepness.",
        _DOCK,
    ),
    Question(
        "The same with 10 kg on board",
        "The load presses on the wheels, and lifting it up the hill costs its full weight.",
        {**_DOCK, "payload": {"mass": 10}},
    ),
)


def plan_all(console: Console, questions: tuple[Question, ...]) -> Answers:
    """Plan the routes of a chapter and print each with its account."""
    answers = {}
    for question in questions:
        console.rule(f"[bold]{question.heading}")
        console.print(question.story, "\n")
        begun = time.perf_counter()
        answer = plan_route(question.request, seed=1, certify_s=0.5)
        took = time.perf_counter() - begun
        console.print(as_tables("plan", answer.to_json()))
        console.print(f"planned in {took:.1f} s\n", style="dim")
        answers[question.heading] = answer
    return answers


def hidden_effect(console: Console, folder: Path = REPORT.parent) -> Answers:
    """A robot drives, is diagnosed from its log alone, and drives again with what was learnt."""
    console.rule("[bold]The robot is not as its model says")
    console.print(
        "A simulated robot drives four errands over the same relief. It has an effect that the "
        "model lacks. The model plans the routes; only the robot's log is known.\n"
    )
    begun = time.perf_counter()
    story = close_the_loop(ERRANDS, "minibalance", {HIDDEN: {}}, folder)
    console.print(_errands(story), "")
    diagnosis = story.adoption.diagnosis
    console.print(f"What its log tells ({len(diagnosis.corrected):,} rows):", diagnosis.sentence)
    console.print(as_tables("adopt", story.adoption.to_json()), "")
    console.print(summary(story))
    hidden = "is" if story.adoption.adopted == (HIDDEN,) else "is not all of"
    console.print(f"What was named {hidden} what it hid ({HIDDEN}).")
    story.adoption.write_report(folder / DIAGNOSIS, "joulepath: what the robot's log tells")
    took = time.perf_counter() - begun
    console.print(f"driven, diagnosed and planned again in {took:.1f} s\n", style="dim")
    console.print(f"The log: [bold]{story.log}[/]; what it tells: [bold]{folder / DIAGNOSIS}[/]\n")
    first = story.drives[0]
    return {
        f"{first.errand.name}, planned by the base model": first.before,
        f"{first.errand.name}, planned with what the log told": first.after,
    }


def summary(story: ClosedLoop) -> str:
    """Benefit of adopting: smaller errors of the plans, and less energy."""
    old, new = (sum(d.took_before_j for d in story.drives), sum(d.takes_j for d in story.drives))
    said_old = sum(d.before.routes[0].energy_j for d in story.drives)
    said_new = sum(d.said_j for d in story.drives)
    return (
        f"The plans were {_off(old / said_old - 1.0)} and are {_off(new / said_new - 1.0)} now; "
        f"on its routes now the robot takes {joules(new)} instead of {joules(old)}, "
        f"{100 * (1 - new / old):.1f} % less."
    )


def _off(error: float) -> str:
    return f"{100 * abs(error):.1f} % too {'low' if error > 0 else 'high'}"


def _errands(story: ClosedLoop) -> Table:
    both = ("robot takes", "")
    table = grid(
        ("errand", "base model says", *both, "corrected says", *both, "saved"), left=(0, 7)
    )
    for drive in story.drives:
        table.add_row(
            drive.errand.name,
            joules(drive.before.routes[0].energy_j),
            joules(drive.took_before_j),
            f"{100 * drive.error_before:+.1f} %",
            joules(drive.said_j),
            joules(drive.takes_j),
            f"{100 * drive.error_after:+.1f} %",
            "old route" if drive.kept else f"{100 * drive.saved:.1f} %",
        )
    return table


CHAPTERS: tuple[Callable[[Console], Answers], ...] = (
    lambda console: plan_all(console, RELIEF),
    lambda console: plan_all(console, WAREHOUSE),
    hidden_effect,
)


def main(report: Path = REPORT) -> int:
    """Go through all chapters and write the page.

    Returns:
        0, or 1 when a chapter found no route.
    """
    console = Console()
    if not console.is_terminal:
        console = Console(width=110)
    answers: dict[str, Answer] = {}
    for chapter in CHAPTERS:
        answers |= chapter(console)
    write_report(answers, report, "joulepath: where the energy goes")
    console.print(f"Pictures of all this: [bold]{report}[/] (open it in a browser)")
    return 0 if all(answer.status == "ok" for answer in answers.values()) else 1
