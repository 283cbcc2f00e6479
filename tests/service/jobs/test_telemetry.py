"""Saved models from outside are read by a worker."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

import planner
from planner.errors import ModelError
from planner.power.kernels.compiler import compile_kernel
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from service.jobs.tasks import Task
from service.jobs.telemetry import adopt, check_model
from tests.service import telemetry_documents as documents


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


def test_no_route_waits_for_the_code_of_an_adopted_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"])
    found = SimpleNamespace(to_json=documents.adoption, model=model)
    monkeypatch.setitem(vars(planner), "adopt", lambda *given, **options: found)
    monkeypatch.chdir(tmp_path)
    compile_kernel.cache_clear()
    adopted = adopt(Task(str(tmp_path), "drive.csv", None, "minibalance", effects=("air_drag",)))
    compiled = compile_kernel.cache_info().misses
    again = PowerModel.from_document(json.loads(adopted.model))
    assert again.kernel.name != again.limits_kernel.name
    assert compile_kernel.cache_info().misses == compiled
