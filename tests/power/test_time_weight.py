"""A price of time is power that is always drawn."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle


def test_a_time_weight_adds_its_watts_whatever_the_motion():
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    rows = rows_from(vx=[0.0, 0.5, -0.5], ax=[0.0, 1.0, -3.0])
    priced = replace(model, time_weight=50.0)
    assert priced.watts(rows) == pytest.approx(model.watts(rows) + 50.0)
    assert priced.power_and_limits(rows)[:, 0] == pytest.approx(priced.watts(rows), rel=1e-12)
    assert priced.kernel is model.kernel  # nothing is compiled for it
