"""Sentences about routes, the same in terminals, pages and notebooks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from planner.amounts import chance, joules, share

Document = Mapping[str, Any]


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
    words = []
    for part in parts[:most]:
        effect, name = str(part["effect"]), str(part["parameter"]).replace("_", " ")
        called = f"{titles.get(effect, effect)} ({name})"
        if effect == "noise":  # as ROUTE.json calls the scatter of one drive
            called = "noise of one drive"
        words.append(f"{called} {100.0 * float(part['share_of_variance']):.0f} %")
    return ", ".join(words)


def compared(document: Document) -> dict[str, Document]:
    """The best route of a ROUTE.json, its alternatives and the baselines, by name."""
    numbered = enumerate(document["routes"])
    routes = {f"alternative {k}" if k else "route": route for k, route in numbered}
    return {**routes, **document.get("baselines", {})}


class AccountRow(NamedTuple):
    """Energy of one effect: the best route's, its share, and that of every other route."""

    effect: str
    exchanged: bool
    """True where energy is stored and given back rather than lost."""
    cells: list[str]


def account(document: Document) -> tuple[list[str], list[AccountRow], list[str]]:
    """Energy by physical effect, largest first, for the routes of a ROUTE.json.

    What is exchanged rather than lost comes last; what rounds to nothing everywhere is left out.

    Returns:
        Headings of the cells, rows, and the cells of the sums.
    """
    # Loaded when asked for: it brings the compiler.
    from planner.power.catalogue import all_effects

    exchanged = {slug for slug, effect in all_effects().items() if effect.exchange}
    routes = {name: r for name, r in compared(document).items() if r.get("breakdown_j")}
    best, *others = routes.values()
    energies, total = best["breakdown_j"], best["energy_j"]
    rows = []
    for slug in sorted(energies, key=lambda e: (e in exchanged, -abs(energies[e]))):
        cells = [joules(route["breakdown_j"].get(slug, 0.0)) for route in routes.values()]
        if set(cells) != {joules(0.0)}:
            share = f"{100 * energies[slug] / total:z.1f} %" if total else ""
            rows.append(AccountRow(slug, slug in exchanged, [cells[0], share, *cells[1:]]))
    sums = [joules(total), "100 %", *(joules(route["energy_j"]) for route in others)]
    return ["route", "share", *[*routes][1:]], rows, sums


def remarks(document: Document, titles: Mapping[str, str]) -> Iterator[str]:
    """What is known of the best route: its energy, the bound, the battery, the notes.

    Args:
        document: ROUTE.json with a route.
        titles: what to call an effect, by slug.
    """
    best = document["routes"][0]
    low, high = best["energy_interval_j"]
    if goal := document.get("goal"):
        yield arrival(goal)
    yield f"Energy of one drive: {joules(low)} … {joules(high)} (95 %)."
    if parts := best.get("sensitivity"):
        yield f"The interval's width comes from {width_from(parts, titles)}."
    steady = document.get("planner", {}).get("bound") == "steadily driven routes"
    kind = "steadily driven" if steady else "feasible"
    yield (
        f"No {kind} route of this motion model costs less than {joules(best['lower_bound_j'])} "
        f"(gap {100 * best['gap']:.1f} % of what is dissipated)."
    )
    if battery := best.get("battery"):
        fits = "fits the battery" if battery["fits"] else "DOES NOT FIT the battery"
        sentence = f"The route {fits}: it takes {of_battery(battery['share'])} of the "
        sentence += f"{joules(battery['available_j'])} in it"
        if "chance" in battery:
            sentence += f"; the chance that it suffices is {chance(battery['chance'])}"
        yield f"{sentence}."
    yield from notes(document)


def notes(document: Document) -> Iterator[str]:
    """What an answer assumed, a sentence each."""
    for note in document.get("notes", ()):
        yield f"Note: {note}" + ("" if note.endswith("?") else ".")


def of_battery(used: float) -> str:
    """A share of the battery as per cent: 180 %, 12 %, 0.42 %."""
    return share(used) if used >= 0.1 else f"{100 * used:.2g} %"


def called(name: str, planner: Mapping[str, Any]) -> str:
    """What to call a route of an answer: the best one with what it was planned for."""
    return f"{name} (least {planner.get('objective', 'energy')})" if name == "route" else name
