"""A price of time is power that is always drawn."""

from __future__ import annotations

import pytest

from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.time_weight import with_time_weight
from planner.power.vehicles import load_vehicle


def test_a_time_weight_adds_its_watts_whatever_the_motion():
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    rows = rows_from(vx=[0.0, 0.5, -0.5], ax=[0.0, 1.0, -3.0])
    priced = with_time_weight(model, 50.0)
    assert priced.watts(rows) == pytest.approx(model.watts(rows) + 50.0)
    assert with_time_weight(model, 0.0).watts(rows) == pytest.approx(model.watts(rows))
