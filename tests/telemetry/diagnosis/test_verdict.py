"""What a verdict may claim: nothing that the evidence in the same diagnosis contradicts."""

from __future__ import annotations

import gzip
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.diagnosis.results import Diagnosis
from planner.telemetry.diagnosis.verdict import (
    LEAST_STRUCTURE,
    never_complete_with_structure,
    sentence_of,
)
from planner.telemetry.quantities_of_motion import motion_axes
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.rows import measured

SHARED = Path(planner.__file__).resolve().parents[2] / "shared" / "data"
FOREIGN = Path(os.environ.get("JOULEPATH_TEST_DATA", SHARED)) / "foreign"

CLEAR_FALL = 0.98
"""Held-out error with a formula over that without; a formula has to do as well as this."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return results.material(tmp_path_factory.mktemp("logs"))


def first_sentence(found: Diagnosis) -> str:
    return found.sentence.split(". ")[0]


def test_a_model_with_a_large_regime_is_not_complete(made):
    carpet = results.regime(where="on carpet", bias_w=2.63, share_of_squared_error=0.79)
    small = results.regime(where="climbing", share_of_squared_error=0.05)
    found = results.complete(made)
    doubted = never_complete_with_structure(
        results.diagnosis(made, **{**vars(found), "regimes": (small, carpet)})
    )
    assert doubted.verdict == "not_identifiable"
    assert doubted.proposed == ()
    assert "on carpet: +2.6 W, 79 %" in first_sentence(doubted)


@pytest.mark.parametrize(
    ("share", "verdict"),
    [(LEAST_STRUCTURE, "not_identifiable"), (0.99 * LEAST_STRUCTURE, "complete")],
)
def test_a_tenth_of_the_squared_error_decides(made, share, verdict):
    regimes = (results.regime(share_of_squared_error=share),)
    found = results.diagnosis(made, **{**vars(results.complete(made)), "regimes": regimes})
    assert never_complete_with_structure(found).verdict == verdict


def test_other_verdicts_stay_whatever_the_regimes(made):
    found = results.diagnosis(made, verdict="missing_effect", outside=None, sensors=())
    assert never_complete_with_structure(found) is found
    nothing = results.complete(made)
    assert never_complete_with_structure(nothing) is nothing


def test_a_sentence_without_a_proposal_shows_one_error(made):
    found = results.diagnosis(made, **{**vars(results.complete(made)), "verdict": "complete"})
    assert "→" not in sentence_of(found)
    assert "2.35 W" in sentence_of(found)


@pytest.mark.parametrize("strength", [0.11, 0.14, 0.3])
def test_a_formula_takes_off_a_fiftieth_of_the_error_or_is_not_named(motion, base, strength):
    # The weaker two stand out of the noise clearly, and lower the error by about a hundredth.
    speed = motion_axes(motion.rows)["speed"]
    extra = strength * np.exp(-(((speed - 0.45) / 0.08) ** 2))
    found = diagnose(measured(motion, base, 0.02, seed=3, extra=extra), base)
    fall = found.after.heldout_rmse_w / found.baseline.heldout_rmse_w
    assert found.verdict == ("outside_catalogue" if strength == 0.3 else "not_identifiable")
    assert (found.outside is None) == (fall == 1.0)
    assert found.outside is None or fall <= CLEAR_FALL


@pytest.fixture
def foreign(tmp_path):
    """Diagnoses a log of another simulator by its name."""
    if not FOREIGN.is_dir():
        pytest.skip("the logs of other simulators are not here")

    def diagnosed(name: str) -> Diagnosis:
        path = tmp_path / f"{name}.csv"
        with gzip.open(FOREIGN / f"{name}.csv.gz") as packed, path.open("wb") as plain:
            shutil.copyfileobj(packed, plain)
        return diagnose(path, "minibalance")

    return diagnosed


@pytest.mark.parametrize(
    ("name", "where"),
    [
        pytest.param("a05", "on carpet", marks=pytest.mark.nightly),
        ("a11", "standing still"),
    ],
)
def test_foreign_logs_with_structure_are_not_complete(foreign, name, where):
    found = foreign(name)
    assert found.verdict == "not_identifiable"
    assert where in first_sentence(found)


def test_a_foreign_log_gets_no_formula_that_raises_the_error(foreign):
    found = foreign("a06")
    assert found.outside is None
    assert found.after.heldout_rmse_w <= found.baseline.heldout_rmse_w


def test_an_empty_foreign_log_is_complete(foreign):
    assert foreign("a15").verdict == "complete"
