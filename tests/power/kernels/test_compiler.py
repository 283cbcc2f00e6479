"""Kernels are compiled once, in a process and on a disk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner.power.catalogue import all_effects
from planner.power.kernels.compiler import cache_folder, compile_kernel
from planner.power.kernels.specialise import KernelSpec
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle


def test_a_kernel_is_compiled_once() -> None:
    effects = tuple(all_effects()[slug] for slug in load_vehicle("minibalance").active)
    first, second = (
        compile_kernel(KernelSpec(effects, wheel_count=4, surface_count=1, number="float64"))
        for _ in range(2)
    )
    assert first is second


def test_models_share_code_where_no_parameter_counts_wheels_or_surfaces() -> None:
    four, three = load_vehicle("minibalance"), load_vehicle("robotino")
    models = [
        PowerModel.from_vehicle(four, effects=[]),
        PowerModel.from_vehicle(four, effects=[], surfaces=("hard", "carpet")),
        PowerModel.from_vehicle(three, effects=[]),
    ]
    assert len({model.limits_kernel.name for model in models}) == 1


START = """
import time
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["vibration"])
before = time.perf_counter()
print(model.watts(rows_from(vx=0.5))[0], time.perf_counter() - before)
"""


def test_a_model_seen_before_starts_without_compiling(tmp_path: Path) -> None:
    environment = {**os.environ, "JOULEPATH_CACHE_DIR": str(tmp_path)}
    answers = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", START],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        answers.append(done.stdout.split())
    files = sorted(path.name for path in (tmp_path / "kernels").glob("*.py"))
    assert len(files) == 1
    assert answers[0][0] == answers[1][0]
    assert float(answers[1][1]) < 1.0


FORMULAS = """
import sys
from planner.compiled_code import njit_once
from planner.power.effects.gravity import Gravity
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
PowerModel.from_vehicle(load_vehicle("minibalance"), effects=sys.argv[1:]).kernel
stats = njit_once(Gravity.body_force).stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def test_a_model_seen_first_finds_the_formulas_of_others(tmp_path: Path) -> None:
    environment = {**os.environ, "JOULEPATH_CACHE_DIR": str(tmp_path)}
    found = []
    for effects in ([], ["vibration"]):
        done = subprocess.run(
            [sys.executable, "-c", FORMULAS, *effects],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        found.append(done.stdout.split())
    assert found == [["0", "1"], ["1", "0"]]


def test_a_cache_that_cannot_be_written_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "file"))
    folder = cache_folder()
    assert folder.is_dir()
    assert os.access(folder, os.W_OK)
