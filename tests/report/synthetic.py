"""Results made by hand: a climb whose power is known at every pose, a front, a matrix, an area."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import numpy as np

from planner.search.front import Front, FrontPoint
from planner.search.matrix import Matrix
from planner.search.reach import Reach
from planner.search.requests import PoseRequest
from planner.search.results import Answer, Baseline, Route, SearchSummary
from planner.search.results.energy_interval import Contribution, EnergyDistribution
from planner.search.results.route import Battery
from planner.terrain.heightmap import Terrain
from planner.terrain.surface import PLAIN_GROUND

SVG = "{http://www.w3.org/2000/svg}"
MODEL = {"name": "minibalance", "version": 1, "kind": "sound"}


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
        ground_classes=PLAIN_GROUND,
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
        "planner": SearchSummary("least-energy", "plane", "energy", 0, "Exact solution"),
        "routes": (route(),),
        "baselines": {"shortest": Baseline(route(watts=25.0), 0.25)},
        "notes": ("x < y & z",),
    }
    return Answer(**{**given, **changes})


def front() -> Front:
    """Three routes of 16 s; the energies are 400, 320 and 160 J."""
    points = tuple(
        FrontPoint(replace(route(watts=watts), duration_s=duration), prices)
        for watts, duration, prices in (
            (25.0, 12.0, (40.0, math.inf)),
            (20.0, 16.0, (10.0, 40.0)),
            (10.0, 24.0, (0.0, 10.0)),
        )
    )
    return Front("ok", terrain(), MODEL, points)


def reach() -> Reach:
    """A square of 6 m with a hole of 2 m around (10, 5)."""

    def square(half: float) -> np.ndarray:
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
        return np.array([(10 + half * a, 5 + half * b) for a, b in corners], float)

    return Reach(
        terrain=terrain(),
        start=(8.0, 5.0),
        energy_j=150.0,
        and_back=True,
        needed_j=np.zeros((10, 20)),
        origin=(0.5, 0.5),
        cell=(1.0, 1.0),
        area_m2=32.0,
        outlines=(square(3.0), square(1.0)),
        error_share=math.nan,
        checked=7,
    )


def matrix(columns: int = 3) -> Matrix:
    """Energies 100, 200, … J by row, the last one infinite, the first one given back."""
    energies = 100.0 * (1.0 + np.arange(2.0 * columns).reshape(2, columns))
    energies[0, 0], energies[-1, -1] = -50.0, math.inf
    places = tuple(PoseRequest(x=2.0 + k, y=3.0) for k in range(columns))
    return Matrix(places[:2], places, energies, np.isfinite(energies), 0.0)


def drawing(result: Any, name: str) -> ElementTree.Element:
    """One picture of a result, read as XML."""
    return ElementTree.fromstring(result.figure(name).svg)
