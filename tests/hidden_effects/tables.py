"""The benchmark's rows as tables: counts by kind and group, and the list of failures."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Sequence
from typing import Any

from tests.hidden_effects.scoring import confidently_wrong

Row = dict[str, Any]

SECTIONS = ("one", "one, twins", "one, hardly visible", "none", "none_ar")
SECTIONS += ("two", "two, hardly visible", "outside", "tied", "hard", "hard, hardly visible")


def section_of(row: Row) -> str:
    """Row of the summary that a result belongs to."""
    kind: str = row["kind"]
    if row["twin"]:
        return f"{kind}, twins"
    hardly = kind in ("one", "two", "hard") and not row["visible"]
    return f"{kind}, hardly visible" if hardly else kind


def summary(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Section → logs, right (count and share), confidently wrong, outcomes, median seconds."""
    found: dict[str, dict[str, Any]] = {}
    for section in SECTIONS:
        mine = [row for row in rows if section_of(row) == section]
        if not mine:
            continue
        right = sum(row["right"] for row in mine)
        found[section] = {
            "logs": len(mine),
            "right": right,
            "share": right / len(mine),
            "confidently_wrong": sum(confidently_wrong(row["outcome"]) for row in mine),
            "outcomes": dict(Counter(row["outcome"] for row in mine).most_common()),
            "median_seconds": round(statistics.median(row["seconds"] for row in mine), 3),
        }
    return found


def summary_text(rows: Sequence[Row]) -> str:
    """The summary as lines of a terminal."""
    lines = [f"{'kind':22}{'logs':>6}{'right':>7}{'share':>8}{'wrong':>7}{'s':>7}  outcomes"]
    for section, entry in summary(rows).items():
        outcomes = ", ".join(f"{count} {name}" for name, count in entry["outcomes"].items())
        lines.append(
            f"{section:22}{entry['logs']:6}{entry['right']:7}{entry['share']:8.1%}"
            f"{entry['confidently_wrong']:7}{entry['median_seconds']:7.2f}  {outcomes}"
        )
    return "\n".join(lines)


def failure_text(row: Row) -> str:
    """One line on a result that was not right: what was there, what was said."""
    rho = ", ".join(f"{slug} {value:.2f}" for slug, value in row.get("rho", {}).items())
    said = row.get("error") or f"{row['verdict']} {'+'.join(row['selected']) or '-'}"
    if row.get("ties"):
        said += "; ties " + ", ".join(f"{s}~{'/'.join(t)}" for s, t in row["ties"].items())
    if row.get("shape"):
        said += f"; shape {'/'.join(row['shape'])}"
    if row.get("sensor_found"):
        said += f"; sensor {'/'.join(row['sensor_found'])}"
    apart = f", apart {row['apart']:.1f} from {row['rival']}" if "apart" in row else ""
    return f"{row['outcome']:14} {row['case']}: {said}   [rho {rho}{apart}, noise {row['level']}]"
