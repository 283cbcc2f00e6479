"""What `joulepath vehicles check` shows: a sanity table, and what is odd, derived and assumed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from service.cli.grids import grid


def vehicle_report(report: Mapping[str, Any]) -> RenderableType:
    """The report of planner.power.sanity as a table and lists."""
    parts: list[RenderableType] = [Text(f"{report['name']}: {report['title']}", "bold")]
    table = grid(
        ("motion", "at", "power", "in windings", "current", "torque", "voltage", "reaches", "lasts")
    )
    for motion in report["motions"]:
        share, hours = motion["torque_share"], motion["hours"]
        table.add_row(
            motion["name"],
            f"{motion['speed_m_s']:.2f} m/s",
            f"{motion['power_w']:z.1f} W",
            f"{motion['winding_w']:.1f} W",
            f"{motion['current_a']:.2f} A",
            "no limit" if share is None else f"{share:.0%}",
            f"{motion['voltage_v']:.1f} V",
            f"{motion['reachable_m_s']:.2f} m/s",
            "" if hours is None else f"{hours:.1f} h",
        )
    parts += ["", table]
    for title, lines in (
        ("odd", report["odd"] or ["nothing"]),
        ("derived or by default", report["derived"]),
        ("assumed", report["assumed"]),
        ("without a source", _joined(report["without_source"])),
    ):
        if lines:
            parts += ["", Text(title, "bold"), *(Text(f"  {line}") for line in lines)]
    return Group(*parts)


def _joined(keys: Sequence[str]) -> list[str]:
    return [", ".join(keys)] if keys else []
