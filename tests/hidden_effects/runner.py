"""Runs the diagnosis on the logs of the benchmark in processes of their own; keeps each result.

    rows = run(cases(["one"]), processes=2)      # one dictionary a case, also as JSON lines

A row holds what was hidden, how visible it is, what the diagnosis said, what that is worth, and how
long it took. Logs are kept in a folder for temporary files and made once.
"""

from __future__ import annotations

import importlib
import json
import multiprocessing
import os
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tests.hidden_effects.cases import SMALLEST_RHO, TWINS, Case
from tests.hidden_effects.logs import VEHICLE, Made, make
from tests.hidden_effects.scoring import RIGHT, aliases_of, not_testable, score, sensors_of

DIAGNOSE = "planner.telemetry.diagnosis.diagnose_log:diagnose"
APART = 5.0  # standard deviations below which a rival of the truth counts as its twin on this log

ADOPTED = ("one", "two", "outside")

Row = dict[str, Any]


def log_folder() -> Path:
    """Where made logs are kept between runs."""
    return Path(tempfile.gettempdir()) / "joulepath-hidden-effects"


def function_of(path: str) -> Callable[..., Any]:
    """The function that ``module:name`` says."""
    module, _, name = path.partition(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return found


def run_case(
    case: Case, *, diagnose: str = DIAGNOSE, folder: Path | None = None, adopting: bool = False
) -> Row:
    """Make one log, diagnose it, and say what the answer is worth.

    Args:
        case: what to hide.
        diagnose: ``module:function``.
        folder: of made logs.
        adopting: also adopt the answer and test it on held-out runs, and drive what is recommended
            to break a tie.
    """
    made = make(case, folder or log_folder())
    row: Row = {
        "case": case.name,
        "kind": case.kind,
        "group": case.group,
        "truth": list(case.truth),
        "outside": case.outside,
        "sensor": case.sensor,
        "design": case.design,
        "noise": case.noise,
        **made.truth,
        "log": str(made.log),
        "mapping": made.mapping and str(made.mapping),
    }
    row["visible"], row["twin"] = _visible(case, made.truth), _twin(case, made.truth)
    before = time.perf_counter()
    try:
        answer = function_of(diagnose)(made.log, VEHICLE, mapping=made.mapping)
        found = answer if isinstance(answer, dict) else answer.to_json()
    except Exception as error:  # a benchmark goes on and shows what failed
        row |= {"outcome": "error", "error": repr(error), "traceback": traceback.format_exc()}
        return row | {"right": False, "seconds": time.perf_counter() - before}
    row["seconds"] = time.perf_counter() - before
    row["outcome"] = score(case, found)
    row["right"] = row["outcome"] in RIGHT["twins" if row["twin"] else case.kind]
    if not row["visible"] and case.kind != "tied":
        # Not naming what hardly shows is no fault; in a tied design it must be said.
        row["right"] |= row["outcome"] in ("tied", "part", "not_testable", "missed")
    row |= {key: found.get(key) for key in ("verdict", "selected", "baseline", "after")}
    row["sensor_found"] = sensors_of(found)
    row["ties"] = {
        slug: sorted(tie)
        for slug, tie in aliases_of(found).items()
        if tie and (slug in found["selected"] or slug in case.truth)
    }
    row["shape"] = (found.get("outside_catalogue") or {}).get("quantities")
    row["truth_not_testable"] = sorted(not_testable(found) & set(case.truth))
    row["candidates"] = [
        {k: c.get(k) for k in ("effect", "probability", "evidence", "parameters")}
        for c in found.get("candidates", ())[:4]
    ]
    row["experiments"] = found.get("experiments")
    if adopting:
        try:
            row |= _followed(case, made, answer, found, diagnose)
        except Exception:  # counted where the adoption is judged
            row["following_failed"] = traceback.format_exc()
    return row


def _followed(case: Case, made: Made, answer: Any, found: Row, diagnose: str) -> Row:
    """What comes of doing as told: adopting, and driving what is recommended."""
    followed: Row = {}
    if case.kind in ("one", "tied"):
        from tests.hidden_effects.second_drive import tie_broken

        followed["again"] = tie_broken(case, made, found, function_of(diagnose))
    if case.hidden and case.kind in ADOPTED:
        from tests.hidden_effects.adoption import after_adopting

        followed |= after_adopting(case, made, answer)
    return followed


def _visible(case: Case, truth: Row) -> bool:
    seen = truth.get("beside", {})
    return all(rho >= SMALLEST_RHO for rho in seen.values())


def _twin(case: Case, truth: Row) -> bool:
    if case.kind != "one":
        return False
    return case.group in TWINS or truth.get("apart", APART) < APART


def run_baselines(case: Case, *, methods: Sequence[str], folder: Path | None = None) -> Row:
    """What other methods name on the log of a case."""
    from tests.hidden_effects.baselines import METHODS, MissingLibrary, as_diagnosis, prepare

    made = make(case, folder or log_folder())
    row: Row = {"case": case.name, "kind": case.kind, "methods": {}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of iterations that did not converge
        task = prepare(made.log, made.mapping)
        for method in methods:
            before = time.perf_counter()
            try:
                selected = METHODS[method](task)
            except MissingLibrary as error:
                row["methods"][method] = {"skipped": str(error)}
                continue
            row["methods"][method] = {
                "selected": selected,
                "outcome": score(case, as_diagnosis(selected)),
                "seconds": time.perf_counter() - before,
            }
    return row


def run(
    chosen: Iterable[Case],
    *,
    processes: int = 2,
    diagnose: str = DIAGNOSE,
    adopting: bool = False,
    keep: Path | None = None,
) -> Iterator[Row]:
    """Rows of the chosen cases as they come.

    Args:
        chosen: what to run.
        processes: how many at a time; 1 runs here.
        diagnose: ``module:function`` that is called as planner's diagnose is.
        adopting: as run_case.
        keep: file that gets a JSON line for every row.
    """
    work = partial(run_case, diagnose=diagnose, adopting=adopting)
    return spread(work, chosen, processes, keep)


def spread(
    work: Callable[[Case], Row], chosen: Iterable[Case], processes: int, keep: Path | None = None
) -> Iterator[Row]:
    """``work`` on every case, in several processes, as the rows come."""
    cases = list(chosen)
    if keep is not None:
        keep.parent.mkdir(parents=True, exist_ok=True)
        keep.write_text("", encoding="utf-8")
    if processes == 1:
        yield from (_kept(row, keep) for row in map(work, cases))
        return
    # Linear algebra on small tables is several times faster on one thread, and two processes
    # with two threads each would fight for the same cores.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from (_kept(row, keep) for row in pool.imap_unordered(work, cases))


def _kept(row: Row, keep: Path | None) -> Row:
    if keep is not None:
        with keep.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    return row
