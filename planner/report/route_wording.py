"""Sentences about routes, the same in terminals, pages and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from planner.amounts import joules

# Energy that goes in and comes out again: signed, and no loss.
EXCHANGE = ("gravity", "inertia")


def extra_cost(energy: float, best: float) -> str:
    """How another route's energy compares with that of the best: "costs 23 % more"."""
    if best <= 0:
        return f"costs {joules(energy - best)} more"
    share = energy / best - 1
    if abs(share) < 0.0005:
        return "costs the same"
    word = "more" if share > 0 else "less"
    digits = 0 if abs(share) >= 0.1 else 1
    return f"costs {100 * abs(share):.{digits}f} % {word}"


def extra_share(energy: float, best: float) -> str:
    """How another route's energy compares with that of the best, for a table: "+23 %"."""
    if best <= 0:
        return f"{'+' if energy >= best else ''}{joules(energy - best)}"
    share = 100 * (energy / best - 1)
    return f"{share:+z.{0 if abs(share) >= 10 else 1}f} %"


def arrival(goal: Mapping[str, float]) -> str:
    """Where a route ends that could choose: "It arrives at x 18.28, y 10.52"."""
    number = f", number {goal['number']} of the places" if "number" in goal else ""
    return f"It arrives at x {goal['x']:.2f}, y {goal['y']:.2f}{number}."


def width_from(parts: Sequence[Mapping[str, Any]], titles: Mapping[str, str], most: int = 3) -> str:
    """Where the width of an energy's interval comes from: "wheel rolling (rolling) 40 %, ...".

    Args:
        parts: ``sensitivity`` of ROUTE.json.
        titles: what to call an effect, by slug.
        most: how many are told.
    """
    told = []
    for part in parts[:most]:
        effect, name = str(part["effect"]), str(part["parameter"]).replace("_", " ")
        called = f"{titles.get(effect, effect)} ({name})"
        if effect == "noise":  # as ROUTE.json calls the scatter of one drive
            called = "noise of one drive"
        told.append(f"{called} {100.0 * float(part['share_of_variance']):.0f} %")
    return ", ".join(told)


def called(name: str, planner: Mapping[str, Any]) -> str:
    """What to call a route of an answer: the best one with what it was planned for."""
    return f"{name} (least {planner.get('objective', 'energy')})" if name == "route" else name
