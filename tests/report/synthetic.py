"""An answer made by hand: a straight climb whose power is known at every pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.search.energy_interval import Contribution, EnergyDistribution
from planner.search.route import Answer, Baseline, Battery, Route
from planner.terrain.heightmap import Terrain
from planner.terrain.surface import PLAIN_GROUND


def terrain() -> Terrain:
    """20 m × 10 m, rising by 0.1 to the east, with one obstacle and one hole."""
    heights = np.tile(0.1 * np.arange(0.5, 20.0), (10, 1))
    known = np.ones(heights.shape, bool)
    obstacles = np.zeros(heights.shape, bool)
    known[1, 1] = False
    obstacles[8, 18] = True
    return Terrain(
        name="ramp <1>",
        heights=heights,
        known=known,
        obstacles=obstacles,
        ground=np.zeros(heights.shape, np.uint8),
        ground_classes=(PLAIN_GROUND,),
        origin=(0.5, 0.5),
        cell=(1.0, 1.0),
        crs=None,
        source="made by the test",
    )


def route(*, end_x: float = 18.0, watts: float = 20.0) -> Route:
    """From (2, 5) eastwards at 1 m/s in steps of 0.5 m; a quarter of the power climbs."""
    x = np.arange(2.0, end_x + 0.25, 0.5)
    t = x - 2.0
    power = np.where(t > 0, watts, 0.0)
    energy = np.cumsum(power * np.diff(t, prepend=0.0))
    shares = {"electronics": 0.75 * power, "gravity": 0.25 * power}
    return Route(
        energy_j=float(energy[-1]),
        lower_bound_j=float(0.8 * energy[-1]),
        gap=0.27,
        duration_s=float(t[-1]),
        length_m=float(t[-1] * np.sqrt(1.01)),
        # 95 % within a tenth.
        known=lambda: EnergyDistribution(
            float(energy[-1]),
            float(0.1 * energy[-1] / 1.959964),
            sensitivity=(
                Contribution("electronics", "power", float(0.04 * energy[-1]), 0.6, 0.75),
                Contribution("noise", "one drive", float(0.03 * energy[-1]), 0.4, None),
            ),
        ),
        breakdown_j={e: float(w @ np.diff(t, prepend=0.0)) for e, w in shares.items()},
        arrays={
            "x": x,
            "y": np.full(len(x), 5.0),
            "z": 0.1 * x,
            "yaw": np.zeros(len(x)),
            "t": t,
            "speed": np.ones(len(x)),
            "energy_j": energy,
            "watts": power,
        },
        watts_by_effect=shares,
        battery=Battery(available_j=1000.0, share=float(energy[-1] / 1000.0), fits=True),
    )


def answer(**changes: Any) -> Answer:
    """That route, with a baseline that costs a quarter more."""
    given: dict[str, Any] = {
        "status": "ok",
        "terrain": terrain(),
        "model": {"name": "minibalance", "version": 1, "kind": "sound", "effects": {}},
        "planner": {"name": "tube"},
        "routes": (route(),),
        "baselines": {"shortest": Baseline(route(watts=25.0), 0.25)},
        "notes": ("x < y & z",),
    }
    return Answer(**{**given, **changes})
