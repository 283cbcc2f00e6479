"""How a model came about: its error version by version against the noise, as a picture and a table.

The entries are those of planner.telemetry.adopt.history, oldest first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from planner.report.bars import short, text
from planner.report.drawing import chart, nice_ticks, tick_words, width_of
from planner.report.markup import Markup, bullets, table
from planner.telemetry.wording import watts

MOST_VERSIONS = 12
"""Of a longer history the picture shows the last ones; the table has all."""


def history_chart(entries: Sequence[Mapping[str, Any]]) -> str:
    """Held-out error version by version against the noise; an arrow is what a version changed."""
    told = [e for e in entries if _heldout(e, "after") is not None][-MOST_VERSIONS:]
    if not told:
        return ""
    column, top, height = 136, 18, 200
    values = [v for e in told for k in ("before", "after") if (v := _heldout(e, k)) is not None]
    floors = [float(e["noise_floor_w"]) for e in told if e.get("noise_floor_w") is not None]
    most = 1.1 * max(*values, *floors, 1e-9)

    def y(value: float) -> float:
        return top + height * (1.0 - value / most)

    ticks = nice_ticks(0.0, most, count=4)
    numbers = [f"{number} W" for number in tick_words(ticks)]
    left = max(60, 12 + math.ceil(max(width_of(number, 13.0) for number in numbers)))
    width = left + column * len(told) + 12
    parts, words = [], []
    for value, number in zip(ticks, numbers, strict=True):
        parts.append(
            f'<line x1="{left}" x2="{width}" y1="{y(value):.1f}" y2="{y(value):.1f}" '
            f'class="{"zero" if value == 0 else "grid"}"/>'
        )
        parts.append(text(left - 8, y(value) + 4, number, anchor="end"))
    past: tuple[float, float, Any] | None = None
    for place, entry in enumerate(told):
        x0 = left + column * place
        x = x0 + column / 2
        after, before = _heldout(entry, "after"), _heldout(entry, "before")
        if entry.get("reverted_to") is not None:
            before = None  # of the version before, perhaps on another log
        assert after is not None  # chosen so
        log = (entry.get("log") or {}).get("sha256")
        floor = entry.get("noise_floor_w")
        if floor is not None:
            parts.append(
                f'<rect x="{x0}" y="{y(floor):.1f}" width="{column}" '
                f'height="{y(0.0) - y(floor):.1f}" class="noise area"/>'
                f'<path d="M{x0} {y(floor):.1f}h{column}" class="noise dashed"/>'
            )
        # Errors on different logs are not to be compared: no line joins them.
        if past is not None and past[2] == log:
            parts.append(
                f'<line x1="{past[0]:.1f}" y1="{past[1]:.1f}" x2="{x:.1f}" '
                f'y2="{y(before if before is not None else after):.1f}" class="after thin"/>'
            )
        if before is not None:
            parts.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y(before):.1f}" y2="{y(after):.1f}" '
                f'class="after line"/><circle cx="{x:.1f}" cy="{y(before):.1f}" r="5" '
                'class="before hollow"/>'
            )
        parts.append(f'<circle cx="{x:.1f}" cy="{y(after):.1f}" r="6" class="after solid"/>')
        words.append(text(x + 9, y(after) - 6, watts(after), "strong halo"))
        for line, said in enumerate(_what(entry)):
            at = top + height + 20 + 17 * line
            words.append(text(x, at, short(said, 18), "" if line else "strong", "middle"))
        past = (x, y(after), log)
    lines = max(len(_what(e)) for e in told)
    said = "; ".join(f"version {e['version']} {watts(_heldout(e, 'after'))}" for e in told) + "."
    title = "Error on held-out runs, version by version"
    high = top + height + 12 + 17 * lines
    return chart(width, high, "".join(parts + words), title, said, kind="chart bars")


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
    return Markup(made + bullets(warnings))
