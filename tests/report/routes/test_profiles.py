"""Charts along a route keep the energy of the route."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from planner.report.routes.profiles import energy_bars, height_chart, mean_power
from tests.report.synthetic import route


def test_mean_power_keeps_the_energy() -> None:
    one = route()
    edges, watts = mean_power(one, most=7)
    times = np.diff(np.interp(edges, one.distance_m, one.arrays["t"]))
    for effect, joules in one.breakdown_j.items():
        assert watts[effect] @ times == pytest.approx(joules, rel=1e-9)


def test_mean_power_counts_what_a_turn_on_the_spot_costs() -> None:
    one = route()
    arrays = {name: np.insert(values, 9, values[8]) for name, values in one.arrays.items()}
    # 4 s of turning at 20 W between two poses at one place.
    arrays["t"] = np.concatenate([arrays["t"][:9], arrays["t"][9:] + 4.0])
    shares = {e: np.insert(w, 9, w[8]) for e, w in one.watts_by_effect.items()}
    turning = replace(one, arrays=arrays, watts_by_effect=shares)
    edges, watts = mean_power(turning, most=7)
    last = np.append(np.diff(turning.distance_m) > 0, True)
    times = np.diff(np.interp(edges, turning.distance_m[last], arrays["t"][last]))
    assert times.sum() == pytest.approx(20.0)
    assert sum(float(w @ times) for w in watts.values()) == pytest.approx(400.0)


def test_bars_of_energy_are_as_long_as_their_energies() -> None:
    one, other = route(), route(watts=25.0)
    drawing = ElementTree.fromstring(
        energy_bars({"best": one, "other": other}, list(one.breakdown_j), {})
    )
    bands = [e for e in drawing.iter("rect") if e.attrib.get("class") == "band"]
    assert len(bands) == len(one.breakdown_j) + len(other.breakdown_j)
    energies = [abs(v) for r in (one, other) for v in r.breakdown_j.values()]
    lengths = [float(band.attrib["width"]) for band in bands]
    assert np.array(lengths) / sum(lengths) == pytest.approx(
        np.array(energies) / sum(energies), abs=1e-3
    )


def test_heights_lie_along_the_path() -> None:
    one = route()
    drawing = ElementTree.fromstring(height_chart({"route": one}))
    x0, x1, y0, y1 = map(float, drawing.attrib["data-range"].split(","))
    left, top, right, bottom = map(float, drawing.attrib["data-inner"].split(","))
    line = next(e for e in drawing.iter("polyline") if e.attrib["class"] == "route")
    places = np.array([p.split(",") for p in line.attrib["points"].split()], float)
    way = x0 + (places[:, 0] - left) / (right - left) * (x1 - x0)
    height = y0 + (bottom - places[:, 1]) / (bottom - top) * (y1 - y0)
    assert way == pytest.approx(one.distance_m, abs=0.02)
    assert height == pytest.approx(one.arrays["z"], abs=0.02)
