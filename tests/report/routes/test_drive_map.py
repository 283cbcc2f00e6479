"""Where a vehicle can go: room, slopes and directions, against what geometry says."""

from __future__ import annotations

import base64
import io
import math
import re

import numpy as np
import pytest
from PIL import Image

from planner.errors import MapError
from planner.power.model import PowerModel
from planner.power.sanity import steepest_slopes
from planner.power.vehicles import load_vehicle
from planner.report.routes import drive_page, ground_layer
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain

VEHICLE = load_vehicle("minibalance")  # 0.86 m by 0.52 m, 0.05 m of clearance


def flat(**layers: np.ndarray) -> Terrain:
    return Terrain.from_arrays(np.zeros((60, 120)), cell=(0.1, 0.1), name="hall", **layers)


def test_open_ground_is_free_but_for_the_rim() -> None:
    page, shares = drive_page(flat(), VEHICLE)
    assert sum(shares.values()) == pytest.approx(1.0)
    # Within half a diagonal of the rim some yaws do not fit; within half a width none does.
    inner = (12.0 - 2 * 0.57) * (6.0 - 2 * 0.57) / 72.0
    assert shares["free"] == pytest.approx(inner, abs=0.04)
    assert shares["too steep"] == 0.0
    assert page.lower().startswith("<!doctype html>")
    assert "hall" in page


def test_a_passage_narrower_than_the_length_has_room_for_some_yaws() -> None:
    obstacles = np.ones((60, 120), bool)
    obstacles[26:34] = False  # 0.8 m wide: wide enough for 0.62 m, not for 0.96 m
    _, shares = drive_page(flat(obstacles=obstacles), VEHICLE)
    assert shares["free"] == 0.0
    assert shares["room for some yaws"] > 0.0
    assert shares["blocked or unknown"] == pytest.approx(52 / 60)


def test_a_slope_above_the_limit_is_too_steep() -> None:
    limit = steepest_slopes(PowerModel.from_vehicle(VEHICLE))
    assert 0.05 < limit["up"] <= limit["down"] < 1.0
    x = 0.1 * np.arange(120)
    for factor, steep in ((0.8, False), (1.3, True)):
        heights = np.tile(factor * max(limit.values()) * x, (60, 1))
        terrain = Terrain.from_arrays(heights, cell=(0.1, 0.1), name="slope")
        _, shares = drive_page(terrain, VEHICLE)
        assert (shares["too steep"] > 0.5) == steep
        assert (shares["free"] > 0.5) != steep


def test_climbing_takes_what_the_torque_allows() -> None:
    # Uphill along x within continuous torque: m·g·(sin + rolling·cos) at most n·torque·ratio·η/r.
    limit = steepest_slopes(PowerModel.from_vehicle(VEHICLE))["up"]
    force = 4 * VEHICLE.limits.continuous_torque * VEHICLE.gear_ratio * 0.8 / VEHICLE.layout.radius
    weight = VEHICLE.mass * 9.80665
    angle = math.atan(limit)
    assert weight * (math.sin(angle) + 0.035 * math.cos(angle)) < 1.02 * force


def test_a_map_that_is_too_large_is_refused() -> None:
    huge = Terrain.from_arrays(np.zeros((2100, 2000)), cell=(0.1, 0.1), name="huge")
    with pytest.raises(MapError, match="too many for this picture"):
        drive_page(huge, VEHICLE)


def test_a_layer_shows_where_a_vehicle_cannot_go_and_leaves_the_rest_clear() -> None:
    """Free ground is transparent: a plain without obstacles differs from it at its edges alone."""
    warehouse = open_map("warehouse")
    layer = ground_layer(warehouse, load_vehicle("minibalance"))
    href = re.search(r"base64,([^\"]+)", layer)
    assert href is not None
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(href[1]))))
    _, shares = drive_page(warehouse, load_vehicle("minibalance"))
    clear = float((picture[..., 3] == 0).mean())
    assert clear == pytest.approx(shares["free"] + shares["blocked or unknown"])
    for name in ("no room for the body", *(kind.name for kind in warehouse.ground_classes)):
        assert name in layer
    # What the map does not have is not explained.
    assert "too steep" not in layer
