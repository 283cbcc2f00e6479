"""What joulepath does, shown in a minute: run by ``make demo``.

Each chapter prints what it finds and adds its answers to one page, demo/report.html.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from planner import Answer, plan_route
from planner.power.catalogue import all_effects
from planner.report import write_report
from service import tables

REPORT = Path("demo") / "report.html"

Answers = Mapping[str, Answer]


@dataclass(frozen=True)
class Question:
    """One route to plan: what to call it, what to say first, what to ask."""

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
        "Kilometres of hills on cells of 75 m by 92 m: does one charge of the battery last?",
        {"map": "jacksboro", "start": {"x": 18000, "y": 14000}, "goal": {"x": 28000, "y": 26000}},
    ),
)

WAREHOUSE = (
    Question(
        "Through a warehouse, up to the dock",
        "Shelves, a passage narrower than the robot is long, carpet, a wet patch and two ramps of "
        "different steepness.",
        {"map": "warehouse", "start": {"x": 1.5, "y": 2}, "goal": {"x": 27, "y": 17}},
    ),
    Question(
        "The same with 10 kg on board",
        "The load presses on the wheels, and the hill takes it at its full price.",
        {
            "map": "warehouse",
            "start": {"x": 1.5, "y": 2},
            "goal": {"x": 27, "y": 17},
            "payload": {"mass": 10},
        },
    ),
)


def plan_all(console: Console, questions: tuple[Question, ...]) -> Answers:
    """Plan the routes of a chapter and print each with its account."""
    titles = {slug: effect.title for slug, effect in all_effects().items()}
    answers = {}
    for question in questions:
        console.rule(f"[bold]{question.heading}")
        console.print(question.story, "\n")
        begun = time.perf_counter()
        answer = plan_route(question.request, seed=1)
        took = time.perf_counter() - begun
        console.print(tables.report(answer.to_json(), titles))
        console.print(f"planned in {took:.1f} s\n", style="dim")
        answers[question.heading] = answer
    return answers


CHAPTERS: tuple[Callable[[Console], Answers], ...] = (
    lambda console: plan_all(console, RELIEF),
    lambda console: plan_all(console, WAREHOUSE),
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


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(status)
