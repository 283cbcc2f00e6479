"""What the findings of all methods add up to: excess over the best known route, and the bars.

    row = row_of(name, asked, findings)        # one question
    told = summary(rows)

Excess is in percent of the best known energy; None where a method found nothing, or nothing that
the robot can drive.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from typing import Any

Row = dict[str, Any]
TIMES = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""CPU s after which a search that goes on is looked at."""
NEAR = 1.0
"""Percent over the best known within which a method counts as there."""


def row_of(name: str, asked: dict[str, Any], findings: Sequence[dict[str, Any]]) -> Row:
    """All findings on one question, as excess over the cheapest of them.

    Args:
        name: of the map.
        asked: start and goal.
        findings: of tests.benchmarks.peers.measure.
    """
    energies = [
        (energy, f"{found['method']}, {kind}" if kind != "as it is" else found["method"])
        for found in findings
        for kind, energy in found["energies"].items()
        if energy is not None
    ]
    best, by = min(energies)
    methods: dict[str, list[dict[str, Any]]] = {}
    for found in findings:
        told = {
            "seconds": round(found["seconds"], 4),
            "percent": {
                kind: None if energy is None else round(100.0 * (energy / best - 1.0), 4)
                for kind, energy in found["energies"].items()
            },
        }
        told |= {key: found[key] for key in ("cost", "wall_s", "broken") if key in found}
        methods.setdefault(found["method"], []).append(told)
    return {"map": name, **asked, "best_known_j": best, "best_by": by, "methods": methods}


def findings_of(row: Row) -> list[dict[str, Any]]:
    """The findings that a row was made of, without their paths."""
    return [
        {key: value for key, value in told.items() if key != "percent"}
        | {
            "method": method,
            "energies": {
                kind: None if percent is None else row["best_known_j"] * (1.0 + 0.01 * percent)
                for kind, percent in told["percent"].items()
            },
        }
        for method, found in row["methods"].items()
        for told in found
    ]


def least(told: Iterable[dict[str, Any]], kinds: Sequence[str] | None = None) -> float | None:
    """The least excess among findings, of some kinds or of all."""
    values = [
        value
        for found in told
        for kind, value in found["percent"].items()
        if value is not None and (kinds is None or kind in kinds)
    ]
    return min(values, default=None)


def time_to(told: Sequence[dict[str, Any]], kinds: Sequence[str]) -> float:
    """CPU seconds until the excess is at most NEAR; infinity where it never is."""
    near = [
        found["seconds"]
        for found in told
        for kind in kinds
        if (value := found["percent"].get(kind)) is not None and value <= NEAR
    ]
    return min(near, default=math.inf)


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """A table by method, and whether the bars hold."""
    names = sorted({name for row in rows for name in row["methods"]})
    return {
        "questions": len(rows),
        "maps": sorted({row["map"] for row in rows}),
        "methods": {name: _method(rows, name) for name in names},
        "bars": bars(rows),
    }


def _method(rows: Sequence[Row], name: str) -> dict[str, Any]:
    told = [row["methods"].get(name, []) for row in rows]
    kinds = sorted({kind for found in told for one in found for kind in one["percent"]})
    result: dict[str, Any] = {}
    for kind in kinds:
        values = [value for found in told if (value := least(found, [kind])) is not None]
        result[kind] = {
            "found": len(values),
            "median_percent": _median(values),
            "worst_percent": max(values, default=None),
        }
    result["median_s"] = _median([found[-1]["seconds"] for found in told if found])
    return result


def bars(rows: Sequence[Row]) -> dict[str, Any]:
    """Each with what was measured, what is asked for, and whether it holds."""
    isotropic: dict[str, list[float]] = {"as it is": [], "straightened": []}
    for row in rows:
        own = _ours(row)["percent"]["as it is"]
        for kind, values in isotropic.items():
            theirs = least(row["methods"].get("MCP_Geometric", []), [kind])
            if theirs is not None and own is not None:
                values.append(100.0 * ((100.0 + theirs) / (100.0 + own) - 1.0))
    plain = isotropic["as it is"]
    found = {
        "gap to the best known": _gap(rows, "ours"),
        "gap to the best known, given ten seconds": _gap(rows, "ours, long"),
        "MCP_Geometric over ours": {
            "least_percent": min(plain, default=None),
            "median_percent": _median(plain),
            "drivable": len(plain),
            "straightened_least_percent": min(isotropic["straightened"], default=None),
            "straightened_median_percent": _median(isotropic["straightened"]),
            "bar": "never below 0 %, median ≥ 5 %",
            "holds": bool(plain) and min(plain) >= 0.0 and _median(plain) >= 5.0,
        },
        "limits at a tenth of a cell": {
            "broken": _broken(rows),
            "bar": "none",
            "holds": not _broken(rows),
        },
    }
    if any("BIT*, energy" in row["methods"] for row in rows):
        found["time to within 1 %, BIT* over ours"] = _faster(rows)
    return found


def _gap(rows: Sequence[Row], method: str) -> dict[str, Any]:
    told = [least(row["methods"].get(method, []), ["as it is"]) for row in rows]
    gaps = [gap for gap in told if gap is not None]
    return {
        "median_percent": _median(gaps),
        "worst_percent": max(gaps, default=None),
        "within_1_percent": sum(gap <= NEAR for gap in gaps),
        "bar": "median ≤ 0.1 %, worst ≤ 0.5 %",
        "holds": bool(gaps)
        and len(gaps) == len(rows)
        and _median(gaps) <= 0.1
        and max(gaps) <= 0.5,
    }


KINDS = ("own yaw", "as it is", "straightened", "refined")


def table(told: dict[str, Any]) -> str:
    """Methods by median and worst excess, as Markdown: for docs/planning.md.

    Args:
        told: of ``summary``.
    """
    lines = [
        f"| method | CPU s | {' | '.join(KINDS)} |",
        f"|---|---|{'---|' * len(KINDS)}",
    ]
    for name, method in told["methods"].items():
        cells = []
        for kind in KINDS:
            found = method.get(kind)
            if found is None or not found["found"]:
                cells.append("" if found is None else "none")
                continue
            cell = f"{found['median_percent']:.2f} ({found['worst_percent']:.2f})"
            lacking = told["questions"] - found["found"]
            cells.append(cell + (f", none on {lacking}" if lacking else ""))
        lines.append(f"| {name} | {method['median_s']:.3g} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _faster(rows: Sequence[Row]) -> dict[str, Any]:
    """Ratios of CPU time; a search that never came near counts with the time that it had."""
    result: dict[str, Any] = {}
    for name, kinds in (("own yaw", ["own yaw"]), ("our yaw", ["own yaw", "as it is"])):
        ratios, never = [], 0
        for row in rows:
            own = min(
                time_to(row["methods"].get(method, []), ["as it is"])
                for method in ("ours, path alone", "ours", "ours, long")
            )
            curve = row["methods"].get("BIT*, energy")
            theirs = time_to(curve or [], kinds)
            if math.isinf(theirs):
                never += 1
                theirs = row["poses_s"]
            ratios.append(theirs / own)
        result[name] = {
            "median_ratio": round(_median(ratios), 1),
            "least_ratio": round(min(ratios), 2),
            "bit_star_never_near": never,
        }
    result["bar"] = "median ≥ 50"
    result["holds"] = result["own yaw"]["median_ratio"] >= 50.0
    return result


def _ours(row: Row) -> dict[str, Any]:
    found: dict[str, Any] = row["methods"].get("ours", [{"percent": {"as it is": None}}])[0]
    return found


def _broken(rows: Sequence[Row]) -> dict[str, int]:
    total: dict[str, int] = {}
    for row in rows:
        for name in ("ours", "ours, long"):
            for found in row["methods"].get(name, []):
                for limit, times in found.get("broken", {}).items():
                    total[limit] = total.get(limit, 0) + times
    return total


def _median(values: Sequence[float]) -> Any:
    return statistics.median(values) if values else None
