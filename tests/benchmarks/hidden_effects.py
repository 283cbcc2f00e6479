"""Naming hidden effects: the whole table, or a part of it, from the command line.

    python -m tests.benchmarks.hidden_effects                      everything
    python -m tests.benchmarks.hidden_effects --kind one two --effect air_drag --seeds 2
    python -m tests.benchmarks.hidden_effects --case one/air_drag/3 --processes 1

The code under test gets a log and, with some, a mapping file. Each result is one line of the file
given by --keep, so that failures can be looked at; made logs stay in a folder for temporary files.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from tests.hidden_effects.cases import KINDS, Case, cases
from tests.hidden_effects.runner import DIAGNOSE, log_folder, run
from tests.hidden_effects.tables import failure_text, summary_text


def chosen_cases(options: argparse.Namespace) -> list[Case]:
    """The cases that the command line asks for."""
    made = cases(options.kind or KINDS, options.seeds)
    if options.effect:
        made = [c for c in made if set(options.effect) & {*c.hidden, c.group, c.sensor}]
    if options.case:
        made = [c for c in cases(KINDS, 5) if any(c.name.startswith(n) for n in options.case)]
    if options.limit:
        # An even choice, so that a short run sees all groups.
        step = max(1.0, len(made) / options.limit)
        made = [made[int(k * step)] for k in range(min(len(made), options.limit))]
    return made


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print counts and failures; 1 where something was confidently wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kind", nargs="*", choices=KINDS, help="parts of the table")
    parser.add_argument("--effect", nargs="*", help="only logs that hide one of these")
    parser.add_argument("--case", nargs="*", help="only cases whose names begin like this")
    parser.add_argument("--seeds", type=int, default=5, help="of five; others in proportion")
    parser.add_argument("--limit", type=int, help="at most so many cases, evenly chosen")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--diagnose", default=DIAGNOSE, help="module:function under test")
    parser.add_argument("--adopting", action="store_true", help="held-out errors, experiments")
    parser.add_argument("--keep", type=Path, default=log_folder() / "results.jsonl")
    parser.add_argument("--quiet", action="store_true", help="print no line for each failure")
    options = parser.parse_args(arguments)
    made = chosen_cases(options)
    before = time.perf_counter()
    rows = []
    for row in run(
        made,
        processes=options.processes,
        diagnose=options.diagnose,
        adopting=options.adopting,
        keep=options.keep,
    ):
        rows.append(row)
        if not row["right"] and not options.quiet:
            print(failure_text(row), flush=True)
        if len(rows) % 50 == 0:
            print(f"… {len(rows)} of {len(made)}", file=sys.stderr, flush=True)
    print(summary_text(rows))
    print(f"{len(rows)} logs in {time.perf_counter() - before:.0f} s; rows in {options.keep}")
    return 1 if any(row["outcome"] in ("wrong", "error") for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
