"""What tuned constants are worth: each is replaced, and the change of a result is measured.

    python -m tests.benchmarks.ablations                       the whole table, some hours
    python -m tests.benchmarks.ablations --only SURPLUS --questions 4
    python -m tests.benchmarks.ablations --save                also into docs/benchmarks/
    python -m tests.benchmarks.ablations --only DETOURS --seed 5   confirms it on other questions

Constants stand in ablation_table.toml. Every value is measured in a fresh process, by one of
tests.benchmarks.ablation_measures.
"""

from __future__ import annotations

import argparse
import ast
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.benchmarks.ablated_constant import environment, in_compiled_code, replace_when_imported
from tests.benchmarks.ablation_measures import ABLATED_SEED, MEASURES, SEEDED

ROOT = Path(__file__).parents[2]
RIGHT = ("exact", "tied", "complete", "sensor")
"""Outcomes of tests.hidden_effects.laboratory that are as good as the log allows."""
TABLE = Path(__file__).with_name("ablation_table.toml")
KEPT = ROOT / "docs" / "benchmarks" / "ablations.json"


@dataclass(frozen=True)
class Constant:
    """One entry of the table, see there."""

    module: str
    name: str
    value: Any
    unit: str
    decides: str
    measured: str
    ablated: tuple[Any, ...]
    compiled: bool = False

    @property
    def label(self) -> str:
        """Module without its package, and name."""
        return f"{self.module.partition('.')[2]}.{self.name}"


def table(path: Path = TABLE) -> list[Constant]:
    """All entries; arrays of the file become tuples, as constants are."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["constant"]
    return [Constant(**{key: _tuples(value) for key, value in one.items()}) for one in entries]


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {float(key): _tuples(one) for key, one in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


# What the results say together.


def worth(base: Mapping[str, Any], ablated: Mapping[str, Any]) -> dict[str, float]:
    """Change of a result by an ablation, in the units of the module's head.

    Raises:
        ValueError: the two are of different measures.
    """
    if set(base) != set(ablated):
        raise ValueError("results of different measures")
    if "answers" in base:
        pairs = list(zip(base["answers"].values(), ablated["answers"].values(), strict=True))
        changes = [100.0 * (b / a - 1.0) for a, b in pairs if a and b]
        lost = sum(a is not None and b is None for a, b in pairs)
        return {
            "percent": statistics.fmean(changes) if changes else math.nan,
            "worst_percent": max(changes, default=math.nan),
            "best_percent": min(changes, default=math.nan),
            "cpu_ratio": ablated["cpu_s"] / base["cpu_s"],
            "routes_lost": lost,
        }
    if "gap_percent" in base:
        gaps = zip(base["gap_percent"].values(), ablated["gap_percent"].values(), strict=True)
        changes = [b - a for a, b in gaps if a is not None and b is not None]
        return {"gap_points": statistics.fmean(changes), "worst_points": max(changes)}
    found = {"logs": len(base["outcomes"])}
    for when, one in (("", ablated), ("_before", base)):
        said = list(one["outcomes"].values())
        found[f"right{when}"] = sum(word in RIGHT for word in said)
        found[f"wrong{when}"] = said.count("wrong")
    return found


def in_words(change: Mapping[str, float]) -> str:
    """The change in a cell of the table."""
    if "percent" in change:
        lost = f", {change['routes_lost']:.0f} routes lost" if change["routes_lost"] else ""
        most = f"worst {change['worst_percent']:+.2f}"
        if "best_percent" in change:  # earlier rows do not have it
            most += f", best {change['best_percent']:+.2f}"
        return f"answer {change['percent']:+.3f} % ({most} %), CPU x{change['cpu_ratio']:.2f}{lost}"
    if "gap_points" in change:
        return f"gap {change['gap_points']:+.2f} points (worst {change['worst_points']:+.2f})"
    return (
        f"{change['right']} right, {change['wrong']} wrong of {change['logs']}, "
        f"before {change['right_before']} and {change['wrong_before']}"
    )


def in_fresh_process(
    measured: str,
    count: int,
    constant: Constant | None = None,
    value: Any = None,
    seed: int = ABLATED_SEED,
) -> dict[str, Any]:
    """What a process measures in which a constant has another value; None for the code as it is."""
    command = [sys.executable, "-m", "tests.benchmarks.ablations", "--worker", measured]
    command += ["--questions", str(count), "--seed", str(seed)]
    if constant is None:
        return _result(command, {})
    changed = [*command, "--set", constant.module, constant.name, repr(value)]
    if not (constant.compiled or in_compiled_code(constant.module, constant.name)):
        return _result(changed, {})
    cache = numba_cache()
    if not cache.exists():
        _result(command, {"NUMBA_CACHE_DIR": str(cache)})
    with tempfile.TemporaryDirectory() as folder:
        own = environment(constant.module, cache, Path(folder))
        _result(changed, own)  # compiles, so that the time is not counted
        return _result(changed, own)


def _result(command: Sequence[str], variables: Mapping[str, str]) -> dict[str, Any]:
    done = subprocess.run(
        command,
        cwd=ROOT,
        # Tables on disk follow from the sources, which an ablation leaves as they are.
        env={**os.environ, **variables, "JOULEPATH_KEEP_TABLES": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def numba_cache() -> Path:
    """Folder in which numba keeps what is compiled of the code as it is, by its own rules.

    joulepath's rules go by the text of the sources, which an ablation leaves as it is.
    """
    import planner
    from planner.code_cache import Sources, cache_base

    package = Path(planner.__file__).parent
    return cache_base() / "ablations" / Sources(package).key(package.name)


def rows(
    constants: Sequence[Constant], count: int, seed: int = ABLATED_SEED
) -> Iterator[dict[str, Any]]:
    """One for each value that a constant is given, as they come."""
    base: dict[str, dict[str, Any]] = {}
    command = ("git", "describe", "--always", "--dirty")
    commit = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for one in constants:
        if one.measured not in base:
            in_fresh_process(one.measured, count, seed=seed)  # compiles what is not on disk
            base[one.measured] = in_fresh_process(one.measured, count, seed=seed)
        for value in one.ablated:
            found = in_fresh_process(one.measured, count, one, value, seed)
            yield {
                "constant": one.label,
                "value": one.value,
                "ablated": value,
                "unit": one.unit,
                "decides": one.decides,
                "measured": one.measured,
                "questions": count,
                "commit": commit.strip(),
                **worth(base[one.measured], found),
            }


def page(kept: Sequence[Mapping[str, Any]]) -> str:
    """The table as Markdown."""
    lines = [
        "# What tuned constants are worth",
        "",
        "Written by `python -m tests.benchmarks.ablations --save`. Each constant is given another",
        "value in a fresh process; the last column says how the answer changes: energy,",
        "with `time` duration, with `certificate` the gap, with `naming` and `several` verdicts on",
        "drawn logs. The code may have changed since a row's commit.",
        "",
        "| constant | value | ablated | unit | decides | measured | questions | worth | commit |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in kept:
        cells = (
            row["value"],
            row["ablated"],
            row["unit"],
            row["decides"],
            row["measured"],
            row["questions"],
            in_words(row),
            row["commit"],
        )
        lines.append(f"| `{row['constant']}` | {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def key_of(row: Mapping[str, Any]) -> tuple[str, str, str]:
    """What a row is of: constant, measure and value; arrays read alike from a table and a file."""
    return row["constant"], row["measured"], json.dumps(row["ablated"])


def keys(constants: Sequence[Constant]) -> set[tuple[str, str, str]]:
    """Of all rows that a whole table has."""
    return {
        (one.label, one.measured, json.dumps(value)) for one in constants for value in one.ablated
    }


def save(
    new: Sequence[Mapping[str, Any]],
    place: Path = KEPT,
    of: set[tuple[str, str, str]] | None = None,
) -> None:
    """Write rows beside those that an earlier run kept; with ``of``, only rows with these keys."""
    kept = json.loads(place.read_text(encoding="utf-8")) if place.exists() else []
    merged = {key_of(row): row for row in (*kept, *json.loads(json.dumps(new)))}
    ordered = [merged[key] for key in sorted(merged) if of is None or key in of]
    place.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    place.with_suffix(".md").write_text(page(ordered), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.ablations")
    parser.add_argument("--only", nargs="*", help="names, or parts of module.NAME")
    parser.add_argument("--questions", type=int, default=8, help="or logs, at most 12")
    parser.add_argument("--save", action="store_true", help=f"write {KEPT.relative_to(ROOT)}, .md")
    parser.add_argument(
        "--seed", type=int, default=ABLATED_SEED, help=f"of the questions of {' and '.join(SEEDED)}"
    )
    parser.add_argument("--worker", choices=MEASURES, help=argparse.SUPPRESS)
    parser.add_argument("--set", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args(arguments)
    if asked.worker:
        if asked.worker == "budget":
            # Before planner takes its clock.
            time.perf_counter = time.process_time
        if asked.set:
            module, name, value = asked.set
            replace_when_imported(module, name, ast.literal_eval(value))
        seeds = [asked.seed] if asked.worker in SEEDED else []
        print(json.dumps(MEASURES[asked.worker](asked.questions, *seeds)))
        return 0
    if asked.save and asked.seed != ABLATED_SEED:
        parser.error(f"--save keeps rows of seed {ABLATED_SEED} only")
    whole = table()
    chosen = [c for c in whole if not asked.only or any(word in c.label for word in asked.only)]
    for row in rows(chosen, asked.questions, asked.seed):
        told = f"{row['value']} -> {row['ablated']} {row['unit'] if row['unit'] != '1' else ''}"
        print(f"{row['constant']:<58} {told:<22} {in_words(row)}", flush=True)
        if asked.save:
            save([row], of=keys(whole))
    return 0


if __name__ == "__main__":
    sys.exit(main())
