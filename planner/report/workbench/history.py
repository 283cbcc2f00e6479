"""How a model came about: its error version by version against the noise, as a picture and a table.

The entries are those of planner.telemetry.adoption.versions.history, oldest first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from planner.amounts import watts
from planner.report.axes import Axes
from planner.report.drawing import chart, circle, line, rectangle, short, text
from planner.report.markup import Markup, bullets, joined, table

MOST_VERSIONS = 12
"""Of a longer history the picture shows the last ones; the table has all."""


def history_chart(entries: Sequence[Mapping[str, Any]]) -> str:
    """Held-out error version by version against the noise; an arrow is what a version changed."""
    measured = [e for e in entries if _heldout(e, "after") is not None][-MOST_VERSIONS:]
    if not measured:
        return ""
    column, top, height = 136, 18, 200
    values = [v for e in measured for k in ("before", "after") if (v := _heldout(e, k)) is not None]
    floors = [float(e["noise_floor_w"]) for e in measured if e.get("noise_floor_w") is not None]
    most = 1.1 * max(*values, *floors, 1e-9)

    draft = Axes(0, height, (0.0, 1.0), (0.0, most), unit=" W", size=13.0)
    left = math.ceil(max(60.0, draft.left))
    width = left + column * len(measured) + 12
    axes = replace(draft, width=width, inner=(left, top, width, top + height))
    parts, words = [axes.grid()], []
    past: tuple[float, float, Any] | None = None
    for place, entry in enumerate(measured):
        x0 = left + column * place
        x = x0 + column / 2
        after, before = _heldout(entry, "after"), _heldout(entry, "before")
        if entry.get("reverted_to") is not None:
            before = None  # of the version before, perhaps on another log
        assert after is not None  # chosen so
        log = (entry.get("log") or {}).get("sha256")
        end = axes.y(after)
        start = end if before is None else axes.y(before)
        if entry.get("noise_floor_w") is not None:
            floor = axes.y(float(entry["noise_floor_w"]))
            parts.append(rectangle(x0, floor, column, axes.y(0.0) - floor, "noise area"))
            parts.append(line(x0, floor, x0 + column, floor, "noise dashed"))
        # Errors on different logs are not to be compared: no line joins them.
        if past is not None and past[2] == log:
            parts.append(line(past[0], past[1], x, start, "after thin"))
        if before is not None:
            parts.append(line(x, start, x, end, "after line"))
            parts.append(circle(x, start, 5, "before hollow"))
        parts.append(circle(x, end, 6, "after solid"))
        words.append(text(x + 9, end - 6, watts(after), "strong halo"))
        for number, said in enumerate(_what(entry)):
            at = top + height + 20 + 17 * number
            words.append(text(x, at, short(said, 18), "" if number else "strong", "middle"))
        past = (x, end, log)
    lines = max(len(_what(e)) for e in measured)
    said = "; ".join(f"version {e['version']} {watts(_heldout(e, 'after'))}" for e in measured)
    title = "Error on held-out runs, version by version"
    high = top + height + 12 + 17 * lines
    return chart(width, high, joined(*parts, *words), title, f"{said}.", kind="chart bars")


def _heldout(entry: Mapping[str, Any], when: str) -> float | None:
    value = (entry.get(when) or {}).get("heldout_rmse_w")
    return None if value is None else float(value)


def _done(entry: Mapping[str, Any]) -> str:
    if entry.get("reverted_to") is not None:
        return f"back to version {entry['reverted_to']}"
    return " ".join([str(entry.get("action") or ""), ", ".join(entry.get("adopted") or ())]).strip()


def _what(entry: Mapping[str, Any]) -> list[str]:
    """A version in short lines."""
    names = [f"+ {name}" for name in entry.get("adopted") or ()]
    if len(names) > 3:
        names = [*names[:2], f"+ {len(names) - 2} more"]
    return [f"version {entry['version']}", *(names or [_done(entry)])]


def history_table(entries: Sequence[Mapping[str, Any]]) -> Markup:
    """Every version: what was done, on which log, and the error before and after."""
    heads = ["version", "from", "what", "log", "rows", "before", "after", "noise", "when"]
    rows = []
    for entry in entries:
        log = entry.get("log") or {}
        rows.append(
            [
                str(entry["version"]),
                str(entry.get("parent") or ""),
                _done(entry),
                str(log.get("source") or ""),
                f"{log['rows']:,}" if log.get("rows") is not None else "",
                watts(_heldout(entry, "before")),
                watts(_heldout(entry, "after")),
                watts(entry.get("noise_floor_w")),
                str(entry.get("at") or "")[:16].replace("T", " "),
            ]
        )
    warnings = [
        f"Version {entry['version']}: {warning}"
        for entry in entries
        for warning in dict.fromkeys(entry.get("warnings") or ())
    ]
    made = table("Error on held-out runs, W", heads, rows, words=(1, 2, 3, 8))
    return joined(made, bullets(warnings))
