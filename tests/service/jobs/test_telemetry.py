"""Saved models from outside are read by a worker."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from service.jobs.telemetry import check_model


@pytest.mark.parametrize(
    "content",
    [b"", b"null", b"\xff", b"[" * 100_000, b'{"format": "joulepath-model/1"}'],
)
def test_a_hostile_model_is_refused_by_the_worker(content: bytes) -> None:
    with pytest.raises(ModelError):
        check_model(content)


def test_a_saved_model_comes_out_of_the_worker_as_it_went_in(tmp_path: Path) -> None:
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"])
    model.save(tmp_path / "m.json")
    content = (tmp_path / "m.json").read_bytes()
    assert check_model(content) == content.decode()
    for value in (math.nan, 10**400, "\ud800"):
        spoilt = json.loads(content)
        spoilt["effects"]["electronics"]["power"] = value
        with pytest.raises(ModelError):
            check_model(json.dumps(spoilt).encode())
