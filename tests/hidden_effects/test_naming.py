"""A fast part of the benchmark of naming: what a diagnosis says of logs whose truth is known.

Of every kind some, with effects of different places in the model. `make bench` runs all.
"""

import pytest

from tests.hidden_effects.cases import cases
from tests.hidden_effects.runner import run_case
from tests.hidden_effects.scoring import confidently_wrong
from tests.hidden_effects.tables import failure_text

CASES = {case.name: case for case in cases()}
RIGHT = (
    "one/air_drag/0",
    "none_ar/nothing/3",
    "two/{pair}/0",
    "tied/one_heading:yaw_scrub/0",
    *(
        pytest.param(name, marks=pytest.mark.nightly)
        for name in ("one/wheel_imbalance/1", "outside/resonance/0")
    ),
)
PAIR = sorted(case.group for case in CASES.values() if case.kind == "two")[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of made logs."""
    return tmp_path_factory.mktemp("logs")


@pytest.mark.parametrize("name", RIGHT)
def test_the_answer_is_the_truth(name, folder):
    row = run_case(CASES[name.format(pair=PAIR)], folder=folder)
    assert row["right"], failure_text(row)


@pytest.mark.parametrize(
    "name",
    [
        # A share of the power explains nearly as much, and might come back as a shape's rival.
        pytest.param("one/sinkage/1", marks=pytest.mark.nightly),
        # Beside another effect it explains more, but then fails its own test.
        "hard/ar:wheel_preload/1",
    ],
)
def test_what_lost_a_contest_or_failed_a_test_takes_no_place(name, folder):
    row = run_case(CASES[name], folder=folder)
    assert row["right"], failure_text(row)


def test_what_cannot_be_told_gets_no_confident_name(folder):
    row = run_case(CASES["one/current_ripple/0"], folder=folder)
    assert row["outcome"] != "error", row["traceback"]
    assert not confidently_wrong(row["outcome"]), failure_text(row)


@pytest.mark.parametrize(
    "name", ["hard/slope_offset/0", pytest.param("hard/speed_scale/1", marks=pytest.mark.nightly)]
)
def test_a_sensor_that_is_off_is_no_missing_effect(name, folder):
    row = run_case(CASES[name], folder=folder)
    assert row["outcome"] == "right_sensor", failure_text(row)


def _silent(log, model, *, mapping=None):
    """A diagnosis that never finds anything."""
    return {"verdict": "complete", "selected": [], "candidates": []}


def _eager(log, model, *, mapping=None):
    """A diagnosis that always finds the same."""
    return {"verdict": "missing_effect", "selected": ["wear"], "candidates": []}


@pytest.mark.parametrize(("said", "outcome"), [("_silent", "missed"), ("_eager", "wrong")])
def test_the_benchmark_can_be_failed(said, outcome, folder):
    row = run_case(CASES["one/air_drag/0"], folder=folder, diagnose=f"{__name__}:{said}")
    assert row["outcome"] == outcome
    assert not row["right"]
