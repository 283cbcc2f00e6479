"""What a verdict may claim: nothing that the evidence in the same diagnosis contradicts."""

from __future__ import annotations

import gzip
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.diagnosis.results import Diagnosis, NotTestable
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR, Unexplained
from planner.telemetry.diagnosis.verdict import sentence_of
from planner.telemetry.holdout.heldout import LEAST_FORMULA_FALL
from planner.telemetry.quantities_of_motion import motion_axes
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.rows import measured

SHARED = Path(planner.__file__).resolve().parents[2] / "shared" / "data"
FOREIGN = Path(os.environ.get("JOULEPATH_TEST_DATA", SHARED)) / "foreign"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return results.material(tmp_path_factory.mktemp("logs"))


def first_sentence(found: Diagnosis) -> str:
    return found.sentence.split(". ")[0]


def test_the_first_sentence_says_where_the_error_is(made):
    carpet = results.regime(where="on carpet", bias_w=2.63, share_of_squared_error=0.79)
    found = results.diagnosis(
        made,
        **{
            **vars(results.complete(made)),
            "verdict": "not_identifiable",
            "unexplained": Unexplained(3.3, (carpet,)),
        },
    )
    far = replace(found, unexplained=Unexplained(1234.5, (carpet,)))
    assert ", 1,234 times the log's own noise" in sentence_of(far)
    said = sentence_of(found)
    assert "on carpet (2.63 W more than predicted, 79 %" in said.split(". ")[0]
    assert "3.3 times the log's own noise" in said


def test_what_the_data_sheet_may_explain_is_not_called_noise_alone(made):
    found = results.complete(made)
    error = found.after.heldout_rmse_w
    words = "Usual errors of the data sheet and of the sensors"
    for exact, there in ((0.6 * error, True), (0.95 * error, False), (error, False)):
        assert (words in sentence_of(found, exact_w=exact)) is there
    assert words not in first_sentence(found)


def test_an_error_that_is_noise_is_not_called_something_missing(made):
    given = {**vars(results.complete(made)), "verdict": "not_identifiable"}
    alike = ("wheel_preload", "gear_asymmetry")
    said = sentence_of(
        results.diagnosis(made, **{**given, "unexplained": Unexplained(1.02)}), alike
    )
    assert "Something is missing" not in said
    assert "cannot tell whether anything is missing: wheel_preload or gear_asymmetry" in said
    said = sentence_of(results.diagnosis(made, **{**given, "unexplained": Unexplained(1.5)}), alike)
    assert "Something is missing" in said


def test_an_error_near_the_noise_is_not_at_once_called_something_missing(made):
    """A regime that stands out may be what noise of the acceleration does to its rows."""
    fast = results.regime(where="above 1.2 m/s", bias_w=-1.8, share_of_squared_error=0.24)
    given = {**vars(results.complete(made)), "verdict": "not_identifiable"}
    for ratio, said in ((1.04, "Little is missing"), (1.3, "Something is missing")):
        changed = {**given, "unexplained": Unexplained(ratio, (fast,))}
        sentence = sentence_of(results.diagnosis(made, **changed))
        assert sentence.startswith(said)
        assert "above 1.2 m/s (1.80 W less than predicted, 24 % of the squared error)" in sentence


def test_a_claim_says_what_it_leaves(made):
    carpet = results.regime(where="on carpet", share_of_squared_error=0.4)
    for ratio, said in ((1.19, False), (1.3, True)):
        found = results.diagnosis(
            made,
            verdict="missing_effect",
            outside=None,
            sensors=(),
            unexplained=Unexplained(ratio, (carpet,)),
        )
        text = sentence_of(found)
        assert (f"still {ratio} times the log's own noise" in text) is said
        assert ("most of all on carpet" in text) is said


def test_what_the_file_lists_for_planning_is_not_called_missing_without_a_word(made):
    for selected, said in (
        (("air_drag",), ""),
        (("viscous_drag", "air_drag", "driver_loss"), "counts viscous_drag and driver_loss, as"),
        (("sensor_rate",), "counts sensor_rate, as its file says; this diagnosis began without it"),
    ):
        found = results.diagnosis(made, verdict="missing_effect", selected=selected)
        text = sentence_of(found)
        assert ("Planning with the vehicle" in text) is bool(said)
        assert said in text


@pytest.mark.parametrize("verdict", ["missing_effect", "outside_catalogue", "sensor_error"])
def test_no_verdict_hides_a_tie(made, verdict):
    outside = results.outside(made) if verdict == "outside_catalogue" else None
    said = sentence_of(results.diagnosis(made, verdict=verdict, outside=outside))
    assert "air_drag or vibration (this log cannot tell which)" in said


def test_a_near_decision_says_so(made):
    found = results.diagnosis(made, **{**vars(results.complete(made)), "verdict": "complete"})
    assert "near decision" not in sentence_of(found)
    assert "near decision: 1.19 of 1.2" in sentence_of(found, near="1.19 of 1.2")


def test_a_likely_effect_is_spoken_of_though_it_is_not_named(made):
    """Nothing may stand in the table that the sentence passes over."""

    def said(probability: float | None, error: float | None, **changes: object) -> str:
        likely = results.candidate("air_drag", probability, heldout_rmse_w=error)
        given = {**vars(results.complete(made)), "candidates": (likely,), **changes}
        return sentence_of(results.diagnosis(made, **given))

    error = results.BEFORE.heldout_rmse_w
    for verdict in ("complete", "not_identifiable"):
        found = said(0.32, 0.9 * error, verdict=verdict)
        assert "The likeliest effect that it may lack is air_drag (32 %)" in found
    for probability, after in (
        (0.1, 0.9 * error),
        (None, 0.9 * error),
        (0.32, None),
        (0.32, error),
    ):
        assert "likeliest" not in said(probability, after)
    named = said(0.9, 0.9 * error, verdict="missing_effect", selected=("air_drag",))
    assert "likeliest" not in named


def test_a_sentence_without_a_proposal_shows_one_error(made):
    found = results.diagnosis(made, **{**vars(results.complete(made)), "verdict": "complete"})
    assert " to " not in first_sentence(found)
    assert "is 2.35 W" in sentence_of(found)


def test_the_first_sentence_is_plain(made):
    """Words that a reader of logs need not know stand further down."""
    changes = {"unexplained": Unexplained(1.02)}
    for verdict in ("missing_effect", "outside_catalogue", "sensor_error", "complete"):
        outside = results.outside(made) if verdict == "outside_catalogue" else None
        sensors = results.diagnosis(made).sensors if verdict == "sensor_error" else ()
        given = {**changes, "verdict": verdict, "outside": outside, "sensors": sensors}
        said = sentence_of(results.diagnosis(made, **given)).split(". ")[0]
        for word in ("held-out", "RMS", "cos(", "residual", "rad"):
            assert word not in said


def test_a_log_that_shows_nothing_says_so(made):
    unseen = tuple(
        NotTestable(effect, "it would go unnoticed", "") for effect in ("wear", "air_drag")
    )
    given = {**vars(results.complete(made)), "candidates": (), "not_testable": unseen}
    assert "too short or too uniform" in sentence_of(results.diagnosis(made, **given))
    seen = (*given["candidates"], results.candidate("stiction", 0.0))
    said = sentence_of(results.diagnosis(made, **{**given, "candidates": seen}))
    assert "1 of 3 effects" in said


@pytest.mark.parametrize("strength", [0.11, 0.14, 0.35])
def test_a_formula_lowers_the_error_clearly_or_is_not_named(motion, base, strength):
    # The weaker two stand out of the noise clearly, and lower the error by about a hundredth:
    # the error is at the noise then, and no regime stands out.
    speed = motion_axes(motion.rows)["speed"]
    extra = strength * np.exp(-(((speed - 0.45) / 0.08) ** 2))
    found = diagnose(measured(motion, base, 0.02, seed=3, extra=extra), base)
    fall = found.after.heldout_rmse_w / found.baseline.heldout_rmse_w
    assert found.verdict == ("outside_catalogue" if strength == 0.35 else "complete")
    assert found.unexplained.little
    assert (found.outside is None) == (fall == 1.0)
    assert found.outside is None or fall <= 1.0 - LEAST_FORMULA_FALL


def test_a_load_that_nobody_logged_is_not_called_noise(motion, base):
    """A computer that works for 7 s at a time: half of the time 6 W more, where the mean is 14."""
    first = np.random.default_rng(5).uniform(0.0, 14.0, 14)
    works = (motion.time + first[motion.run]) % 14.0 < 7.0
    found = diagnose(measured(motion, base, 0.02, seed=7, extra=6.0 * works), base)
    assert found.verdict == "not_identifiable"
    assert found.selected == ()
    assert "lasts for seconds" in found.sentence
    quiet = diagnose(measured(motion, base, 0.02, seed=7), base)
    assert quiet.verdict == "complete"
    assert "lasts for seconds" not in quiet.sentence


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
    ("name", "effect"), [("a05", "surface_rolling"), ("a06", "stiction"), ("a10", "yaw_scrub")]
)
@pytest.mark.nightly
def test_what_the_table_shows_as_certain_is_in_the_verdict(foreign, name, effect):
    found = foreign(name)
    assert found.verdict == "missing_effect"
    assert found.selected == (effect,)
    assert found.candidates[0].effect == effect
    assert found.after.heldout_rmse_w < found.baseline.heldout_rmse_w


def test_a_foreign_log_with_structure_is_not_complete(foreign):
    found = foreign("a11")
    assert found.verdict == "not_identifiable"
    # A fit that does without the noise's weights leaves the standing robot 0.8 W, not 3 W.
    assert "standing still" in [regime.where for regime in found.unexplained.where]
    assert found.unexplained.where[0].where in first_sentence(found)
    # An effect that looks certain in the table would be in the verdict.
    assert all((c.probability or 0.0) < 0.5 for c in found.candidates)
    assert found.unexplained.where
    assert not found.unexplained.little


def test_an_empty_foreign_log_is_complete(foreign):
    found = foreign("a15")
    assert found.verdict == "complete"
    assert found.unexplained.heldout_over_floor <= MOST_OVER_FLOOR
