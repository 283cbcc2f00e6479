"""The comparison as a picture: excess over the best known route against CPU time.

    text = draw(rows)            # SVG

Medians over the questions; a question on which a method found nothing drivable counts as NOTHING.
"""

from __future__ import annotations

import io
import math
import statistics
from collections.abc import Sequence
from typing import Any

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from tests.benchmarks.peers.report import TIMES, Row, least

FLOOR = 0.01
"""Percent below which the picture does not tell excesses apart."""
NOTHING = 300.0
"""Percent at which questions without a drivable path count in a median."""
POINTS = (
    ("ours", "as it is", "this planner", "*", "#c0392b"),
    ("ours, path alone", "as it is", "this planner, path alone", "X", "#e67e73"),
    ("ours, long", "as it is", "this planner, 10 s given", "P", "#c0392b"),
    ("MCP_Geometric", "as it is", "scikit-image, best of four costs", "s", "#2471a3"),
    ("MCP_Geometric", "straightened", "the same, straightened", "D", "#5dade2"),
    ("Dijkstra", "as it is", "scipy's Dijkstra", "^", "#1e8449"),
    ("ttcrpy", "as it is", "ttcrpy, ellipses", "v", "#7d3c98"),
)
CURVES = (
    ("BIT*, energy", "#d68910"),
    ("RRT*, energy", "#7f8c8d"),
    ("Informed RRT*, energy", "#34495e"),
    ("BIT*, work", "#a04000"),
)


def draw(rows: Sequence[Row]) -> str:
    """All maps together, by median over the questions, and each map by itself, as SVG."""
    maps = list(dict.fromkeys(row["map"] for row in rows))
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    FigureCanvasSVG(figure)
    panels = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
    for panel, name in zip(panels, ["all maps", *maps], strict=False):
        _panel(panel, [row for row in rows if name in ("all maps", row["map"])])
        panel.set_title(name, fontsize=10)
    for panel in panels[len(maps) + 1 :]:
        panel.set_visible(False)
    for panel in panels[::3]:
        panel.set_ylabel("over the best known, %", fontsize=9)
    for panel in panels[3:]:
        panel.set_xlabel("CPU time of the search, s", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    figure.suptitle(
        "Energy by method, medians over the questions; nothing drivable counts as the top edge",
        fontsize=10,
    )
    stream = io.StringIO()
    # No date and fixed ids: the same figures give the same file.
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "planning", "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    return "\n".join(lines) + "\n"


def _panel(panel: Any, rows: Sequence[Row]) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_ylim(0.8 * FLOOR, NOTHING)
    panel.grid(visible=True, which="major", alpha=0.25)
    panel.tick_params(labelsize=8)
    panel.yaxis.set_major_formatter(FuncFormatter(_percent))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    panel.axhline(1.0, color="black", lw=0.6, ls=":")
    for method, colour in CURVES:
        for kind, style in (("own yaw", "--"), ("as it is", "-")):
            times, values = _curve(rows, method, kind)
            name = f"OMPL {method}, {'own yaw' if kind == 'own yaw' else 'our yaw'}"
            panel.plot(times, values, style, color=colour, lw=1.2, marker=".", ms=4, label=name)
    for method, kind, name, marker, colour in POINTS:
        found = [row["methods"].get(method, []) for row in rows]
        if not any(found):
            continue
        values = [_height(least(told, [kind])) for told in found]
        seconds = [max(told[0]["seconds"], 1e-3) for told in found if told]
        panel.plot(
            statistics.median(seconds),
            statistics.median(values),
            marker,
            color=colour,
            ms=10 if marker == "*" else 6,
            ls="none",
            label=name,
        )


def _curve(rows: Sequence[Row], method: str, kind: str) -> tuple[list[float], list[float]]:
    """Medians over the questions at the times at which a search was looked at."""
    most = max(
        (found["seconds"] for row in rows for found in row["methods"].get(method, [])), default=0.0
    )
    times = [at for at in TIMES if at <= 1.2 * most]
    medians = []
    for at in times:
        values = []
        for row in rows:
            early = [f for f in row["methods"].get(method, []) if f["seconds"] <= 1.3 * at]
            values.append(_height(least(early, [kind])))
        medians.append(statistics.median(values))
    return times, medians


def _percent(value: float, _place: int) -> str:
    return "≤ 0.01" if value <= FLOOR else f"{value:g}"


def _height(percent: float | None) -> float:
    return NOTHING if percent is None or math.isinf(percent) else max(percent, FLOOR)
