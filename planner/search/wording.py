"""How quantities of a route are written for people, the same in terminals, pages and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

# Energy that goes in and comes out again: signed, and no loss.
EXCHANGE = ("gravity", "inertia")
NOISE = "noise"
"""Stands beside the effects for what one measured drive scatters by, whatever the parameters."""


def joules(value: float) -> str:
    """Energy with a unit that keeps three to five digits: 812.0 J, 12.30 kJ, 1.24 MJ."""
    value = 0.0 if abs(value) < 0.05 else value  # no "-0.0 J"
    for scale, unit in ((1e6, "MJ"), (1e3, "kJ")):
        if abs(value) >= (scale if unit == "MJ" else 10 * scale):
            return f"{value / scale:,.2f} {unit}"
    return f"{value:,.0f} J" if abs(value) >= 1000 else f"{value:.1f} J"


def seconds(value: float) -> str:
    """A duration as a person says it: 42.0 s, 3 min 05 s, 2 h 14 min."""
    if value < 60:
        return f"{value:z.1f} s"
    minutes, rest = divmod(round(value), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min"


def metres(value: float) -> str:
    """A length: 12.30 m, 1,204 m."""
    return f"{value:z.2f} m" if value < 100 else f"{value:,.0f} m"


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
    """The same for a table: "+23 %"."""
    if best <= 0:
        return f"{'+' if energy >= best else ''}{joules(energy - best)}"
    share = 100 * (energy / best - 1)
    return f"{share:+z.{0 if abs(share) >= 10 else 1}f} %"


def arrival(goal: Mapping[str, float]) -> str:
    """Where a route ends that could choose: "It arrives at x 18.28, y 10.52"."""
    number = f", number {goal['number']} of the places" if "number" in goal else ""
    return f"It arrives at x {goal['x']:.2f}, y {goal['y']:.2f}{number}."


def chance(probability: float) -> str:
    """A probability as a person says it: 97 %, 99.98 %, over 99.99 %, under 0.01 %."""
    percent = 100.0 * probability
    if percent > 99.99 or percent < 0.01:
        return "over 99.99 %" if percent > 50.0 else "under 0.01 %"
    doubt = min(percent, 100.0 - percent)
    return f"{percent:.{0 if doubt >= 1.0 else 1 if doubt >= 0.1 else 2}f} %"


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
        if effect == NOISE:
            called = "noise of one drive"
        told.append(f"{called} {100.0 * float(part['share_of_variance']):.0f} %")
    return ", ".join(told)


def called(name: str, planner: Mapping[str, Any]) -> str:
    """What to call a route of an answer: the best one with what it was planned for."""
    return f"{name} (least {planner.get('objective', 'energy')})" if name == "route" else name
