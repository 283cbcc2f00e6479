"""What is worked out once for each log."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from planner.telemetry.logs import Meter
from planner.telemetry.prediction import Nodes, Readings
from planner.telemetry.prediction.per_log import per_log
from tests.power.states import random_columns
from tests.telemetry.rows import base_model, plain_log


def test_it_is_worked_out_once_and_goes_with_its_log() -> None:
    log, other = plain_log([5, 5]), plain_log([5, 5])
    times: list[int] = []
    for each in (log, log, other):
        assert per_log(each, "rows", lambda each=each: times.append(len(each)) or len(each)) == 10
    assert len(times) == 2
    gone = weakref.ref(log)
    del log, each
    gc.collect()
    assert gone() is None


def test_another_meter_or_other_wheels_get_readings_and_nodes_of_their_own() -> None:
    log, model = plain_log([20, 20]), base_model()
    slow = replace(log, meter=Meter(time_constant_s=0.7))
    slower = replace(log, meter=Meter(time_constant_s=1.4))
    kept = [Readings.of(each).keep.max() for each in (slow, slower, slow)]
    assert kept[0] == kept[2] < kept[1]
    assert Nodes.of(log, model).readings is None
    assert Nodes.of(slow, model).readings is Readings.of(slow)
    assert Nodes.of(log, model).rows is Nodes.of(log, model).rows
    # Other wheels pass through rest in other rows.
    columns = {**random_columns(200, seed=3), "surface": -1.0}
    moving = replace(plain_log([200]), rows=rows_from(**columns))
    three = PowerModel.from_vehicle(load_vehicle("robotino"), effects=())
    counts = [len(Nodes.of(moving, each).rows) for each in (model, three, model)]
    assert counts[0] == counts[2] != counts[1]
