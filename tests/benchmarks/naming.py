"""The whole benchmark of naming hidden effects, as docs/naming.md, its picture and its JSON.

    python -m tests.benchmarks.naming                     everything, about an hour on two cores
    python -m tests.benchmarks.naming --seeds 1 --without long baselines
    python -m tests.benchmarks.naming --rows rows.jsonl   tables from rows that were kept
    python -m tests.benchmarks.naming --baselines b.jsonl   the same of the other methods
    python -m tests.benchmarks.naming --laboratory          logs as laboratories write them

Parts: logs (tests.hidden_effects), baselines (extra packages: pip install 'joulepath[bench]'),
long (100,000 and 10 million rows), measured (logs of others, where they are).
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tests.benchmarks import laboratory
from tests.benchmarks.long_logs import BARS, measure
from tests.hidden_effects.bars import METHOD_NAMES, checks, method_figures
from tests.hidden_effects.cases import KINDS, Case, cases
from tests.hidden_effects.report import document_text, draw
from tests.hidden_effects.runner import log_folder, run, run_baselines, spread
from tests.hidden_effects.tables import failure_text, summary, summary_text

ROOT = Path(__file__).resolve().parents[2]
PARTS = ("logs", "baselines", "long", "measured")

Row = dict[str, Any]


def compared_cases(seeds: int) -> list[Case]:
    """The logs on which other methods are run too: they take longer than the diagnosis."""
    few = [c for c in cases(["one", "two"], seeds) if c.seed < max(1, seeds - 3)]
    quiet = [c for c in cases(["none", "none_ar"], seeds) if c.seed % 5 == 0]
    return few + quiet


def measured_logs() -> dict[str, Row | None]:
    """Answers on the logs that others measured."""
    from tests.hidden_effects.real_data import contact, robotino

    parts: dict[str, Callable[[], Row | None]] = {
        "robotino": robotino,
        "contact plain": partial(contact, "plain"),
        "contact payload": partial(contact, "payload"),
    }
    found: dict[str, Row | None] = {}
    for name, part in parts.items():
        try:
            found[name] = part()
        except Exception as error:  # one failure must not cost the other results
            traceback.print_exc()
            found[name] = {"error": repr(error), "holds": False}
    return found


def whole(
    *,
    seeds: int = 5,
    processes: int = 2,
    without: Sequence[str] = (),
    kept_rows: Path | None = None,
    kept_baselines: Path | None = None,
    folder: Path = ROOT / "docs",
) -> dict[str, Any]:
    """Run everything, write the documents, and give the summary for ``make bench``.

    Args:
        seeds: of five.
        processes: at a time.
        without: parts to leave out; of the long logs and of those that others measured, what the
            last run found stays.
        kept_rows: rows of an earlier run instead of running the logs again.
        kept_baselines: the same for the other methods, which do not change with the product.
        folder: where naming.md, benchmarks/naming.json and images/naming.svg go.
    """
    before = time.perf_counter()
    kept = kept_rows or log_folder() / "naming.jsonl"
    rows = _rows(kept, seeds, processes, run_them=kept_rows is None and "logs" not in without)
    print(summary_text(rows), flush=True)
    baselines: list[Row] = []
    if kept_baselines is not None:
        baselines = _read(kept_baselines)
    elif "baselines" not in without:
        work = partial(run_baselines, methods=tuple(METHOD_NAMES))
        own = {row["case"] for row in rows}
        compared = [case for case in compared_cases(seeds) if case.name in own]
        baselines = list(spread(work, compared, processes, log_folder() / "baselines.jsonl"))
    kept_file = folder / "benchmarks" / "naming.json"
    last = json.loads(kept_file.read_text(encoding="utf-8")) if kept_file.exists() else {}
    if "long" in without:
        long_logs = last.get("long_logs", [])
    else:
        long_logs = [measure(length) for length in sorted(BARS)]
    measured = last.get("measured", {}) if "measured" in without else measured_logs()
    found = checks(rows, baselines, long_logs, measured)
    document = {
        "python": platform.python_version(),
        "processor_cores_used": processes,
        "minutes": round((time.perf_counter() - before) / 60.0, 1),
        "checks": found,
        "kinds": summary(rows),
        "methods": method_figures(rows, baselines) if baselines else {},
        "long_logs": long_logs,
        "measured": measured,
        "not_right": [failure_text(row) for row in rows if not row["right"]],
    }
    for part in ("benchmarks", "images"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=2, ensure_ascii=False)
    kept_file.write_text(text + "\n", encoding="utf-8")
    (folder / "naming.md").write_text(document_text(document, rows), encoding="utf-8")
    laboratory.keep_section(folder)
    draw(folder / "images" / "naming.svg", rows, document["methods"])
    return {
        "checks": {entry["check"]: entry["found"] for entry in found},
        "bar": "docs/naming.md",
        "holds": all(entry["holds"] is not False for entry in found),
    }


def _rows(kept: Path, seeds: int, processes: int, *, run_them: bool) -> list[Row]:
    if not run_them:
        if not kept.exists():
            return []
        return _read(kept)
    rows = []
    for row in run(cases(KINDS, seeds), processes=processes, adopting=True, keep=kept):
        rows.append(row)
        if not row["right"]:
            print(failure_text(row), flush=True)
        if len(rows) % 50 == 0:
            print(f"… {len(rows)} logs", file=sys.stderr, flush=True)
    return rows


def _read(kept: Path) -> list[Row]:
    return [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, and say which bars do not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5, help="of five")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--without", nargs="*", default=[], choices=PARTS)
    parser.add_argument("--rows", type=Path, help="rows of an earlier run")
    parser.add_argument("--baselines", type=Path, help="the same of the other methods")
    parser.add_argument("--folder", type=Path, default=ROOT / "docs")
    laboratory.add_options(parser)
    options = parser.parse_args(arguments)
    if options.laboratory:
        return laboratory.main(options)
    found = whole(
        seeds=options.seeds,
        processes=options.processes,
        without=options.without,
        kept_rows=options.rows,
        kept_baselines=options.baselines,
        folder=options.folder,
    )
    for check, said in found["checks"].items():
        print(f"{check}: {said}")
    return 0 if found["holds"] else 1


if __name__ == "__main__":
    sys.exit(main())
