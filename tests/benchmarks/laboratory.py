"""Naming on logs as laboratories write them: the table of what must hold, as Markdown and JSON.

    python -m tests.benchmarks.naming --laboratory --split tuning --nothing 20 --each 1 --outside 10
    python -m tests.benchmarks.naming --laboratory --rows rows.jsonl     tables from kept rows

Robots, drives and instruments are drawn (tests.hidden_effects.laboratory). Floor, in all checks,
is the oracle's held-out error: the same fit, told what is hidden and what the meter does.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.hidden_effects.cases import EFFECTS, TWINS
from tests.hidden_effects.laboratory import MECHANISMS, SPLITS
from tests.hidden_effects.laboratory.examine import Row, examine
from tests.hidden_effects.laboratory.outcomes import OUTCOMES
from tests.hidden_effects.runner import log_folder

METHODS = ("lasso_projected", "bic", "pysindy")
TITLES = {
    "joulepath": "joulepath",
    "lasso_projected": "LASSO after projection",
    "bic": "BIC with refit",
    "pysindy": "PySINDy (STLSQ)",
}
LEAST_RHO = 0.5
"""Effect over floor from which naming is asked for."""
LEAST_CANDIDATES = 150
"""Candidates of a tenth of the probabilities from which it is judged alone."""
KEPT = "benchmarks/laboratory.json"
HEADING = "## Logs as laboratories write them"
WORDS = """
`python -m tests.benchmarks.naming --laboratory` draws a robot, its data sheet, a drive and the
instruments anew for every log. Masses span a factor of 20; wheels are Mecanum, three or four omni
wheels, and a third of the robots have rollers whose drag grows with their speed. Mass and lengths
in the data sheet are up to 8 % off, other values 5 to 20 %. Drives are by hand, by missions or by
test patterns, at 5 to 100 Hz. Meters filter (up to 0.8 s), hold, are late, quantise and clip.
Odometry, IMU and clock have noise, bias, slip, jitter, gaps and drift. One log in ten has rows that
arrive in bunches. Of those at 20 Hz and more, one in five repeats a slower odometry.

*Floor* is the oracle's held-out error: the same fit, told what is hidden and what the meter does;
of the ways to read the motion, that which predicts best. ρ here is the effect after projection
over that floor. *Testable*: the oracle's z is at least 5, and its log-likelihood leads the best
rival's by 8. *Among*: the truth is among those named, beside effects that are not there. Tuning,
validation and final draws never share a seed.
"""
Draw = tuple[str, str, int]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the benchmark's command line."""
    group = parser.add_argument_group("laboratory")
    group.add_argument("--laboratory", action="store_true", help="drawn robots and instruments")
    group.add_argument("--split", choices=list(SPLITS), default="tuning")
    for kind, count in (("nothing", 200), ("each", 8), ("several", 60), ("outside", 60)):
        group.add_argument(f"--{kind}", type=int, default=count, help="logs")
    group.add_argument("--first", type=int, default=0, help="seed of the first log")
    group.add_argument("--minutes", type=float, default=600.0, help="stop after this long")
    group.add_argument("--write", action="store_true", help="to the folder: JSON and Markdown")


def main(options: argparse.Namespace) -> int:
    """Run or read the rows, print the tables, and write them where asked."""
    if options.rows is not None:
        text = options.rows.read_text(encoding="utf-8")
        rows = [json.loads(line) for line in text.splitlines()]
    else:
        counts = options.nothing, options.each, options.several, options.outside
        methods = () if "baselines" in options.without else METHODS
        keep = log_folder() / f"laboratory-{options.split}.jsonl"
        chosen = draws(*counts, first=options.first)
        rows = list(run(chosen, options.split, keep, methods, 60.0 * options.minutes))
    found = summary(rows, options.split)
    print(text_of(found))
    if options.write:
        text = json.dumps(found, indent=2, ensure_ascii=False)
        (options.folder / KEPT).write_text(text + "\n", encoding="utf-8")
        keep_section(options.folder)
    return 0 if all(check["holds"] is not False for check in found["checks"]) else 1


def draws(nothing: int, each: int, several: int, outside: int, first: int = 0) -> list[Draw]:
    """Kind, effect and seed of every log, kinds interleaved so that a list cut short has all.

    Args:
        nothing, several, outside: numbers of logs.
        each: logs of every effect of the catalogue.
        first: seed of the first.
    """
    lone = [slug for slug in EFFECTS if slug not in TWINS]
    rng = np.random.default_rng(17)
    groups = []
    for _ in range(several):
        count = 2 if rng.random() < 0.7 else 3
        groups.append("+".join(lone[k] for k in rng.permutation(len(lone))[:count]))
    names = list(MECHANISMS)
    kinds: list[list[Draw]] = [
        [("none", "", first + k) for k in range(nothing)],
        [("one", slug, first + k) for k in range(each) for slug in EFFECTS],
        [("several", group, first + k) for k, group in enumerate(groups)],
        [("outside", names[k % len(names)], first + k) for k in range(outside)],
    ]
    placed = [
        ((k + 0.5) / len(kind), number, entry)
        for number, kind in enumerate(kinds)
        for k, entry in enumerate(kind)
    ]
    return [entry for _, _, entry in sorted(placed)]


def run(
    chosen: Sequence[Draw], split: str, keep: Path, methods: Sequence[str], seconds: float
) -> Iterator[Row]:
    """Rows as they come, kept as JSON lines; stops after ``seconds`` of wall time."""
    keep.parent.mkdir(parents=True, exist_ok=True)
    keep.write_text("", encoding="utf-8")
    began = time.perf_counter()
    for kind, effect, seed in chosen:
        if time.perf_counter() - began > seconds:
            print(f"stopped after {seconds:.0f} s", file=sys.stderr)
            return
        row = examine(kind, effect, seed, split, log_folder() / "laboratory", methods=methods)
        with keep.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        print(line_of(row), flush=True)
        yield row


def line_of(row: Mapping[str, Any]) -> str:
    """One line on a log: what was there, what was said, and the errors."""
    if row["outcome"] == "error":
        return f"error      {row['log']}: {row['error']}"
    meter = row["truth"]["instruments"]["meter"]
    said = row["verdict"] + " " + "+".join([*row["selected"], *row["sensor"]])
    said += f" over {'/'.join(row['shape'])}" if row["shape"] else ""
    rho = ", ".join(f"ρ {value:.2f}" for value in row["rho"].values())
    asked = row["rho"] and row["kind"] != "outside"
    state = "" if not asked else ("testable " if row["testable"] else "not testable ")
    before, after = row["baseline"], row["after"]
    return (
        f"{row['outcome']:10} {row['log']}: {said}  [{state}{rho} floor {row['floor_w']:.3g} W, "
        f"held out {before['heldout_rmse_w']:.3g} → {after['heldout_rmse_w']:.3g}, said floor "
        f"{before['noise_floor_w'] or 0.0:.3g}, τ {meter['time_constant']:.2f} s "
        f"{meter['sampling']} at {row['truth']['conditions']['rate']:g} Hz]"
    )


def checks(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The table of what must hold: check, bar, found, holds."""
    good = [row for row in rows if row["outcome"] != "error"]
    of = {kind: [r for r in good if r["kind"] == kind] for kind in ("none", "one", "several")}
    outside = [row for row in good if row["kind"] == "outside"]
    seen = [r for r in of["one"] if _seen(r)]
    several = [row for row in of["several"] if row["testable"]]
    ratios = [r["baseline"]["noise_floor_w"] / r["floor_w"] for r in good]
    near = [0.8 <= ratio <= 1.25 for ratio in ratios]
    second = [r["second_w"][0] / r["second_w"][1] <= 1.02 for r in good]
    complete = [r for r in good if r["verdict"] == "complete"]
    above = [r for r in complete if r["after"]["heldout_rmse_w"] > 1.2 * r["floor_w"]]
    claims = [r for r in good if r["verdict"] in ("outside_catalogue", "sensor_error")]
    raised = [r for r in claims if r["after"]["heldout_rmse_w"] > r["baseline"]["heldout_rmse_w"]]
    intervals = [entry["inside"] for row in good for entry in row["intervals"]]
    meters = [m for m in map(meter_found, good) if m is not None]
    return [
        _share("nothing hidden: false effect, formula or sensor", of["none"], ("wrong",),
               "≤", 0.02),
        _share("nothing hidden: complete, or the sensor that is wrong", of["none"],
               ("complete", "sensor"), "≥", 0.85),
        _share("one effect: confidently wrong", of["one"], ("wrong",), "≤", 0.02),
        _share("one effect, testable, ρ ≥ 0.5: exact", seen, ("exact",), "≥", 0.85),
        _share("two or three, testable: exact", several, ("exact",), "≥", 0.80),
        _share("two or three, testable: confidently wrong", several, ("wrong",), "≤", 0.03),
        _share("outside: right quantity", outside, ("exact",), "≥", 0.75),
        _share("outside: a catalogue effect or sensor", outside, ("wrong",), "≤", 0.05),
        _rate("reported noise floor over the oracle's in 0.8 to 1.25", near, "≥", 0.90),
        _rate("meter's time constant within 15 % or in its interval", meters, "≥", 0.95),
        _rate("base fit on a second drive ≤ 1.02 of the stated vehicle", second, "≥", 1.0),
        _count("complete above 1.2 × floor", above, len(complete)),
        _count("named formula or sensor that raises the held-out error", raised, len(claims)),
        _rate("95 % intervals of named effects hold the truth", intervals, "90–98", 0.90),
    ]  # fmt: skip


def meter_found(row: Mapping[str, Any]) -> bool | None:
    """Whether the filter of a meter was found; None where there is none of at least one row."""
    true = row["truth"]["instruments"]["meter"]["time_constant"]
    if true * row["truth"]["conditions"]["rate"] < 1.0:
        return None
    said = (row["meter"] or {}).get("time_constant_s")
    if not said:
        return False
    off = abs(said["value"] - true)
    return bool(off <= 0.15 * true or off <= 1.96 * (said["stderr"] or 0.0))


def _share(
    check: str, rows: Sequence[Row], outcomes: tuple[str, ...], side: str, bar: float
) -> dict[str, Any]:
    return _rate(check, [row["outcome"] in outcomes for row in rows], side, bar)


def _rate(check: str, hits: Sequence[bool], side: str, bar: float) -> dict[str, Any]:
    share = sum(hits) / len(hits) if hits else None
    said = "none" if share is None else f"{sum(hits)} of {len(hits)} ({share:.0%})"
    if side == "90–98":
        limit, holds = "90–98 %", None if share is None else 0.90 <= share <= 0.98
    else:
        limit = f"{side} {bar:.0%}"
        holds = None if share is None else (share >= bar if side == "≥" else share <= bar)
    return {"check": check, "bar": limit, "found": said, "holds": holds}


def _count(check: str, rows: Sequence[Row], of: int) -> dict[str, Any]:
    return {"check": check, "bar": "0", "found": f"{len(rows)} of {of}", "holds": not rows}


def by_kind(rows: Sequence[Row]) -> list[tuple[Any, ...]]:
    """Outcomes of every kind: kind, logs, one count for each of OUTCOMES."""
    outside = [row for row in rows if row["kind"] == "outside"]
    sections = {
        "nothing hidden": [r for r in rows if r["kind"] == "none"],
        f"one, testable, ρ ≥ {LEAST_RHO}": [r for r in rows if r["kind"] == "one" and _seen(r)],
        "one, others": [r for r in rows if r["kind"] == "one" and not _seen(r)],
        "two or three": [r for r in rows if r["kind"] == "several"],
        f"outside the catalogue, ρ ≥ {LEAST_RHO}": [r for r in outside if _clear(r)],
        "outside the catalogue, others": [r for r in outside if not _clear(r)],
    }
    lines = []
    for section, mine in sections.items():
        count = Counter(row["outcome"] for row in mine)
        lines.append((section, len(mine), *(count[name] or "" for name in OUTCOMES)))
    return lines


def _seen(row: Row) -> bool:
    return bool(row.get("testable")) and _clear(row)


def _clear(row: Row) -> bool:
    return min(row.get("rho", {}).values(), default=0.0) >= LEAST_RHO


def probabilities(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """By tenths of the stated probability: candidates, mean stated, share that is there.

    Tenths with fewer than LEAST_CANDIDATES are joined with the next one.
    """
    pairs = sorted((p, there) for row in rows for _, p, there, *_ in row.get("probabilities", ()))
    tenths: list[list[tuple[float, bool]]] = []
    for k in range(10):
        mine = [e for e in pairs if min(int(10.0 * e[0]), 9) == k]
        if tenths and len(tenths[-1]) < LEAST_CANDIDATES:
            tenths[-1] += mine
        else:
            tenths.append(mine)
    if len(tenths) > 1 and len(tenths[-1]) < LEAST_CANDIDATES:
        last = tenths.pop()
        tenths[-1] += last
    found = []
    for mine in tenths:
        if mine:
            stated = float(np.mean([p for p, _ in mine]))
            there = float(np.mean([t for _, t in mine]))
            numbers = {"from": mine[0][0], "to": mine[-1][0], "stated": stated, "there": there}
            within = abs(stated - there) <= 0.08
            found.append({"candidates": len(mine), **numbers, "holds": within})
    return found


def compared(rows: Sequence[Row]) -> list[tuple[Any, ...]]:
    """Method, exact and wrong of the logs that all methods saw, false alarms."""
    shared = [row for row in rows if row.get("methods") and row["kind"] != "outside"]
    names = sorted({name for row in shared for name in row["methods"]}, key=METHODS.index)
    lines = []
    for name in ("joulepath", *names):
        said = [(r, r["outcome"] if name == "joulepath" else r["methods"][name]["outcome"])
                for r in shared]  # fmt: skip
        some = [o for r, o in said if r["kind"] != "none"]
        none = [o for r, o in said if r["kind"] == "none"]
        exact = f"{some.count('exact')} of {len(some)}"
        wrong = f"{some.count('wrong')} of {len(some)}"
        lines.append((TITLES[name], exact, wrong, f"{none.count('wrong')} of {len(none)}"))
    return lines if names else []


def summary(rows: Sequence[Row], split: str) -> dict[str, Any]:
    """All tables, ready for JSON."""
    good = [row for row in rows if row["outcome"] != "error"]
    ratios = [row["baseline"]["noise_floor_w"] / row["floor_w"] for row in good]
    times = [row["cpu_seconds"] for row in good]
    seeds = [int(row["log"].rpartition("/")[2]) for row in rows]
    return {
        "split": split,
        "seeds": [min(seeds, default=0), max(seeds, default=0)],
        "logs": len(rows),
        "median_cpu_seconds": round(float(np.median(times)), 2) if times else None,
        "noise_floor_over_oracle": [
            round(float(q), 3) for q in np.quantile(ratios, [0.05, 0.5, 0.95])
        ] if ratios else [],
        "checks": checks(rows),
        "kinds": [list(line) for line in by_kind(rows)],
        "probabilities": probabilities(good),
        "methods": [list(line) for line in compared(good)],
        "not_right": [line_of(r) for r in rows if r["outcome"] in ("wrong", "quantity", "error")],
    }  # fmt: skip


def text_of(found: Mapping[str, Any]) -> str:
    """The tables as Markdown."""
    mark = {True: "yes", False: "**no**", None: "not run"}
    parts = [
        _table(
            ["check", "bar", "found", "holds"],
            [(c["check"], c["bar"], c["found"], mark[c["holds"]]) for c in found["checks"]],
        ),
        _table(["kind", "logs", *OUTCOMES], found["kinds"]),
        _table(
            ["stated probability", "candidates", "mean stated", "there"],
            [
                (f"{p['from']:.2f}–{p['to']:.2f}", p["candidates"], f"{p['stated']:.2f}",
                 f"{p['there']:.2f}")
                for p in found["probabilities"]
            ],
        ),
    ]  # fmt: skip
    if found["methods"]:
        head = ["method", "exact", "confidently wrong", "false alarms, nothing hidden"]
        parts.append(_table(head, found["methods"]))
    return "\n".join(parts)


def _table(head: Sequence[str], lines: Sequence[Sequence[Any]]) -> str:
    rows = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    rows += ["| " + " | ".join(str(cell) for cell in line) + " |" for line in lines]
    return "\n".join(rows) + "\n"


def section_of(found: Mapping[str, Any]) -> str:
    """The section of docs/naming.md."""
    low, middle, high = found["noise_floor_over_oracle"]
    first, last = found["seeds"]
    wrong = "".join(f"{line}\n" for line in found["not_right"])
    listed = f"Logs with a wrong answer:\n\n```text\n{wrong}```" if wrong else "No answer is wrong."
    return (
        f"{HEADING}\n{WORDS}\n"
        f"{found['logs']} logs of the split `{found['split']}`, seeds {first} to {last}; "
        f"a diagnosis\ntakes {found['median_cpu_seconds']} s of processor time (median).\n"
        "The reported noise floor over the oracle's is "
        f"{low:.2f}, {middle:.2f} and {high:.2f} at 5, 50 and 95 %.\n\n"
        f"{text_of(found)}\n{listed}\n"
    )


def keep_section(folder: Path) -> None:
    """Put what the last run found at the end of naming.md, in the place of an earlier section."""
    kept, path = folder / KEPT, folder / "naming.md"
    if not kept.exists():
        return
    found = json.loads(kept.read_text(encoding="utf-8"))
    before = path.read_text(encoding="utf-8").partition(f"\n{HEADING}")[0].rstrip("\n")
    path.write_text(f"{before}\n\n{section_of(found)}", encoding="utf-8")
