"""Versions of a model: what adopting writes, what reverting brings back, what is warned of."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planner.errors import Cancelled, ModelError
from planner.power.formulas import custom_effect
from planner.power.model import PowerModel
from planner.telemetry.adoption.adopt_effects import DIAGNOSED, adopt
from planner.telemetry.adoption.versions import history, revert
from planner.telemetry.diagnosis import diagnose_log
from planner.telemetry.quantities_of_motion import motion_axes
from tests.power.states import changed
from tests.telemetry.rows import measured

SCRUB = 3.0


@pytest.fixture(scope="module")
def log(motion, base):
    """A log of a robot that scrubs when it turns."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    return measured(motion, changed(robot, yaw_scrub__scrub_moment=SCRUB), 0.02, seed=41)


@pytest.fixture(scope="module")
def second(log, base):
    """The version with what the log calls for."""
    return adopt("yaw_scrub", log, base)


@pytest.fixture(scope="module")
def third(log, second):
    """A version with something that the log does not call for beside it."""
    return adopt("air_drag", log, second.model)


def parameter(model, slug, name):
    return next(
        model.parameters[k] for k, s in enumerate(model.slots) if (s[0].slug, s[1]) == (slug, name)
    )


def test_what_is_called_for_is_adopted_without_a_warning(log, second):
    assert second.adopted == ("yaw_scrub",)
    assert second.warnings == ()
    assert second.after.heldout_rmse_w < 0.5 * second.before.heldout_rmse_w
    assert parameter(second.model, "yaw_scrub", "scrub_moment") == pytest.approx(SCRUB, rel=0.1)
    scrub = next(p for p in second.parameters if p.effect == "yaw_scrub")
    assert abs(scrub.value - SCRUB) < 4.0 * scrub.stderr


def test_everything_else_keeps_its_place(second, base):
    model = second.model
    assert [e.slug for e in model.effects] == [*(e.slug for e in base.effects), "yaw_scrub"]
    assert parameter(model, "copper_loss", "torque_constant") == parameter(
        base, "copper_loss", "torque_constant"
    )
    assert model.name == base.name


def test_versions_count_and_know_their_parents(base, second, third):
    assert (base.version, second.model.version, third.model.version) == (1, 2, 3)
    assert second.model.parent == f"{base.name} v1"
    assert third.model.parent == f"{base.name} v2"
    entries = history(third.model)
    assert [entry["version"] for entry in entries] == [1, 2, 3]
    assert [entry["action"] for entry in entries] == ["fit", "adopt", "adopt"]
    assert [entry["adopted"] for entry in entries] == [[], ["yaw_scrub"], ["air_drag"]]
    assert [entry["parent"] for entry in entries] == [None, f"{base.name} v1", f"{base.name} v2"]


def test_history_tells_the_data_and_the_errors(log, second):
    first, entry = history(second.model)
    assert entry["log"]["rows"] == len(log)
    assert entry["log"]["runs"] == len(log.run_names)
    assert entry["log"]["sha256"] == log.sha256
    assert "/" not in entry["log"]["source"]
    assert entry["before"]["heldout_rmse_w"] == second.before.heldout_rmse_w
    assert entry["after"]["heldout_rmse_w"] == second.after.heldout_rmse_w
    assert first["after"] == entry["before"]
    assert "yaw_scrub" not in first["effects"]
    assert "snapshot" not in entry


def test_what_the_log_does_not_support_is_adopted_with_warnings(second, third):
    assert third.adopted == ("air_drag",)
    text = " ".join(third.warnings)
    assert "air_drag" in text
    assert "held-out error does not fall" in text
    assert third.after.heldout_rmse_w >= 0.99 * second.after.heldout_rmse_w
    assert history(third.model)[-1]["warnings"] == list(third.warnings)


def test_a_version_survives_its_file(third, tmp_path, motion):
    path = tmp_path / "model.json"
    third.model.save(path)
    read = PowerModel.load(path)
    assert read.document() == third.model.document()
    assert (read.version, read.parent) == (3, third.model.parent)
    assert history(read) == history(third.model)
    np.testing.assert_array_equal(read.parameters, third.model.parameters)
    rows = motion.rows_for(read.surfaces)[:200]
    np.testing.assert_array_equal(read.watts(rows), third.model.watts(rows))


@pytest.mark.parametrize("through_file", [False, True])
def test_reverting_brings_an_earlier_version_back(second, third, through_file, tmp_path):
    model = third.model
    if through_file:
        model.save(tmp_path / "model.json")
        model = PowerModel.load(tmp_path / "model.json")
    back = revert(model, 2)
    assert (back.version, back.parent) == (4, third.model.parent.replace("v2", "v3"))
    assert [e.slug for e in back.effects] == [e.slug for e in second.model.effects]
    np.testing.assert_array_equal(back.parameters, second.model.parameters)
    np.testing.assert_array_equal(back.stderr, second.model.stderr)
    assert back.covariance.names == second.model.covariance.names
    np.testing.assert_array_equal(back.covariance.values, second.model.covariance.values)
    assert back.energy_error == second.model.energy_error
    last = history(back)[-1]
    assert (last["action"], last["reverted_to"]) == ("revert", 2)
    assert last["after"] == history(back)[1]["after"]
    # The base model too, and forwards again.
    first = revert(back, 1)
    assert all(effect.base for effect in first.effects)
    again = revert(first, 3)
    np.testing.assert_array_equal(again.parameters, third.model.parameters)
    assert [entry["version"] for entry in history(again)] == [1, 2, 3, 4, 5, 6]


def test_a_version_knows_the_errors_of_its_own_fit(log, second, third):
    """Of its own parameters, none of those of the version before."""
    for adoption in (second, third):
        model = adoption.model
        names = model.parameter_names
        free = [k for k, stderr in enumerate(model.stderr) if np.isfinite(stderr)]
        assert {names[k] for k in free} <= set(model.covariance.names)
        assert model.energy_error.runs == len(log.run_names)
    assert ("air_drag", "drag_area", 0) not in second.model.covariance.names
    assert ("air_drag", "drag_area", 0) in third.model.covariance.names


def test_documents_are_strict_json(second, third):
    for adoption in (second, third):
        document = adoption.to_json()
        assert json.loads(json.dumps(document, allow_nan=False)) == document
        assert document["history"][-1]["adopted"] == document["adopted"]


def test_everything_diagnosed_is_one_name_and_formulas_survive_a_file(motion, base, tmp_path):
    speed = motion_axes(motion.rows)["speed"]
    shaking = 4.0 * np.exp(-(((speed - 0.45) / 0.08) ** 2))
    found = adopt(DIAGNOSED, measured(motion, base, 0.02, seed=3, extra=shaking), base)
    assert found.adopted == ("unknown_speed",)
    assert parameter(found.model, "unknown_speed", "centre") == pytest.approx(0.45, abs=0.02)
    found.model.save(tmp_path / "model.json")
    read = PowerModel.load(tmp_path / "model.json")
    rows = motion.rows_for(read.surfaces)[:200]
    np.testing.assert_array_equal(read.watts(rows), found.model.watts(rows))
    assert "unknown_speed" not in {effect.slug for effect in revert(read, 1).effects}
    with pytest.raises(ModelError, match="has it already"):
        adopt("unknown_speed", motion, read)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ("perpetual_motion", "perpetual_motion"),
        ("gear_loss", "has it already"),
        ([], "none was given"),
        (["yaw_scrub", "no_such_effect"], "no_such_effect"),
    ],
)
def test_what_cannot_be_adopted_is_refused_before_any_work(log, base, wanted, words):
    with pytest.raises(ModelError, match=words):
        adopt(wanted, log, base, cancelled=lambda: True)


def test_nothing_twice(log, second):
    with pytest.raises(ModelError, match="has it already"):
        adopt("yaw_scrub", log, second.model)


def test_nothing_diagnosed_and_no_such_formula(motion, base):
    quiet = measured(motion, base, 0.02, seed=42)
    with pytest.raises(ModelError, match="proposes nothing"):
        adopt(DIAGNOSED, quiet, base)
    with pytest.raises(ModelError, match="unknown_heading"):
        adopt("unknown_heading", quiet, base)


def test_what_was_diagnosed_is_adopted_without_another_search(motion, base, monkeypatch):
    """The same log and model only: other noise, another model or other rivals are searched."""
    searched = []
    search = diagnose_log.find_missing_effects

    def counted(source, *given, **further):
        searched.append(source)
        return search(source, *given, **further)

    monkeypatch.setattr(diagnose_log, "find_missing_effects", counted)
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    quiet, other = (
        measured(motion, changed(robot, yaw_scrub__scrub_moment=SCRUB), 0.02, seed=seed)
        for seed in (77, 78)
    )
    found = diagnose_log.diagnose(quiet, base)
    once = len(searched)
    assert once > 0
    assert adopt(DIAGNOSED, quiet, base).adopted == found.proposed
    assert adopt("air_drag", quiet, base).diagnosis is found
    assert len(searched) == once
    tow = custom_effect(
        name="tow",
        formula="drag * abs(vx) * vx",
        unit="W",
        parameters={"drag": {"unit": "kg/s", "bounds": [0, 50], "null": 0}},
    )
    less = changed(base, gear_loss__efficiency=0.7)
    for log, start, extra in ((other, base, ()), (quiet, less, ()), (quiet, base, (tow,))):
        before = len(searched)
        diagnose_log.diagnose(log, start, extra=extra)
        assert len(searched) > before


def test_versions_that_do_not_exist(base, second):
    with pytest.raises(ModelError, match="history"):
        revert(base, 1)
    with pytest.raises(ModelError, match="1, 2"):
        revert(second.model, 7)


def test_an_adoption_can_be_stopped(log, base):
    with pytest.raises(Cancelled):
        adopt("yaw_scrub", log, base, cancelled=lambda: True)
