"""Effects in charts of routes: which of them show, and the colour of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.arrays import Array

if TYPE_CHECKING:
    from planner.search.results import Route


# Related effects have related colours: electronics grey to blue, resistance of the wheels green,
# drive orange to red, exchange violet, wind and ground teal.
COLOURS = {
    "electronics": "#64748b",
    "sensor_rate": "#94a3b8",
    "converter_efficiency": "#475569",
    "driver_loss": "#3b82c4",
    "wheel_rolling": "#4d9a51",
    "roller_drag": "#8cc152",
    "load_dependent_rolling": "#2f7d4f",
    "surface_rolling": "#b5cc6a",
    "gear_loss": "#f0a63c",
    "copper_loss": "#d9622b",
    "coulomb_drag": "#c2413b",
    "viscous_drag": "#e58a6f",
    "regeneration_limit": "#9c2f6b",
    "gravity": "#7c5cc4",
    "inertia": "#b39ddb",
    "air_drag": "#2a9d8f",
    "com_offset": "#a1887f",
}
_SPARE = ("#8d6e63", "#26a69a", "#ab47bc", "#78909c", "#d4a017", "#5c6bc0")
OTHER = "other"
_OTHER_COLOUR = "#cbd5e1"


def colour_of(effect: str) -> str:
    """Colour of an effect, the same in every chart."""
    if effect == OTHER:
        return _OTHER_COLOUR
    spare = _SPARE[sum(map(ord, effect)) % len(_SPARE)]
    return COLOURS.get(effect, spare)


def main_effects(routes: Sequence[Route], *, least_share: float = 0.012) -> list[str]:
    """Effects that move a visible share of any of the routes' energy, largest first.

    Energy that comes back counts too, so that speeding up and slowing down are seen although they
    cancel over the whole route.
    """
    share: dict[str, float] = {}
    for route in routes:
        steps = np.diff(route.arrays["t"], prepend=0.0)
        moved = {e: float(np.abs(w) @ steps) for e, w in route.watts_by_effect.items()}
        whole = sum(moved.values()) or 1.0
        for effect, value in moved.items():
            share[effect] = max(share.get(effect, 0.0), value / whole)
    return [e for e in sorted(share, key=lambda e: -share[e]) if share[e] >= least_share]


def grouped(values: Mapping[str, Array | float], effects: Sequence[str]) -> dict[str, Array]:
    """The chosen effects' values, and the sum of all others as "other" where it is not zero."""
    result = {effect: np.asarray(values[effect], float) for effect in effects if effect in values}
    rest = [np.asarray(value, float) for effect, value in values.items() if effect not in result]
    other = np.sum(rest, axis=0) if rest else np.zeros(1)
    if np.any(np.abs(other) > 1e-9):
        result[OTHER] = other
    return result
