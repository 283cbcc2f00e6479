"""One small log for every verdict, and what a diagnosis says beside it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from planner.errors import Cancelled
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.quantities import INDEX
from planner.telemetry.diagnosis.decision import decide
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.logs import Telemetry
from planner.telemetry.quantities_of_motion import motion_axes
from planner.telemetry.selection import find_missing_effects
from planner.telemetry.virtual import QUIET, VirtualRobot
from tests.power.states import changed
from tests.telemetry.rows import measured

NOISE = 0.02
SCRUB = 3.0
BUMP = {"strength": 4.0, "centre": 0.45, "width": 0.08}


@pytest.fixture(scope="module")
def scrubbing(motion, base):
    """A robot that scrubs when it turns."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",))
    robot = changed(robot, yaw_scrub__scrub_moment=SCRUB)
    return diagnose(measured(motion, robot, NOISE, seed=1), base)


@pytest.fixture(scope="module")
def nothing(motion, base):
    """A robot that is as its model says."""
    return diagnose(measured(motion, base, NOISE, seed=2), base)


@pytest.fixture(scope="module")
def resonant(motion, base):
    """A robot that shakes around one speed."""
    speed = motion_axes(motion.rows)["speed"]
    extra = BUMP["strength"] * np.exp(-(((speed - BUMP["centre"]) / BUMP["width"]) ** 2))
    return diagnose(measured(motion, base, NOISE, seed=3, extra=extra), base)


def test_a_missing_effect_is_named(scrubbing):
    assert scrubbing.verdict == "missing_effect"
    assert scrubbing.selected == ("yaw_scrub",)
    assert "yaw_scrub" in scrubbing.sentence
    first = scrubbing.candidates[0]
    assert first.effect == "yaw_scrub"
    assert first.probability > 0.95
    scrub = first.parameters["scrub_moment"]
    assert abs(scrub.value - SCRUB) < 4.0 * scrub.stderr
    assert scrub.stderr < 0.1 * SCRUB
    before, after = scrubbing.baseline, scrubbing.after
    assert after.heldout_rmse_w < 0.5 * before.heldout_rmse_w
    assert after.heldout_rmse_w == pytest.approx(before.noise_floor_w, rel=0.1)


def test_probabilities_and_order_of_candidates(scrubbing):
    told = [c for c in scrubbing.candidates if c.why_not is None]
    assert all(0.0 <= c.probability <= 1.0 for c in told)
    assert [c.effect for c in scrubbing.candidates] == [
        c.effect for c in (*told, *(c for c in scrubbing.candidates if c.why_not is not None))
    ]
    others = [c.probability for c in told if c.effect not in scrubbing.selected]
    assert others == sorted(others, reverse=True)


def test_a_complete_model_is_left_alone(nothing):
    assert nothing.verdict == "complete"
    assert nothing.selected == ()
    assert nothing.proposed == ()
    assert nothing.outside is None
    assert nothing.sensors == ()
    assert nothing.baseline.heldout_rmse_w == pytest.approx(nothing.baseline.noise_floor_w, rel=0.1)


def test_something_outside_the_catalogue_gets_a_formula(resonant):
    assert resonant.verdict == "outside_catalogue"
    outside = resonant.outside
    assert outside.quantities == ("speed",)
    assert "bump(" in outside.formula
    values = {
        name: resonant.model.parameters[place]
        for place, (effect, name, _, _) in enumerate(resonant.model.slots)
        if effect.slug == outside.name
    }
    assert values["centre"] == pytest.approx(BUMP["centre"], abs=0.02)
    assert values["width"] == pytest.approx(BUMP["width"], rel=0.15)
    assert values["strength"] == pytest.approx(BUMP["strength"], rel=0.1)
    x, watts = np.array(outside.curve).T
    assert np.all(np.diff(x) > 0.0)
    assert x[np.argmax(watts)] == pytest.approx(BUMP["centre"], abs=0.05)
    assert watts.max() == pytest.approx(BUMP["strength"], rel=0.15)
    assert resonant.after.heldout_rmse_w == pytest.approx(resonant.baseline.noise_floor_w, rel=0.15)


def test_a_wrong_sensor_is_no_missing_effect(motion, base):
    log = measured(motion, base, NOISE, seed=4)
    rows = log.rows.copy()
    for name in ("vx", "vy"):
        rows[:, INDEX[name]] *= 1.08
    found = diagnose(replace(log, rows=rows), base)
    assert found.verdict == "sensor_error"
    assert found.selected == ()
    (fault,) = found.sensors
    assert fault.kind == "speed_scale"
    assert abs(fault.value - 0.08) < 4.0 * fault.stderr
    assert fault.stderr < 0.03


@pytest.fixture(scope="module")
def narrow(tmp_path_factory) -> Telemetry:
    """A drive that shows little: forwards on one kind of floor, without temperatures."""
    path = tmp_path_factory.mktemp("narrow") / "narrow.csv"
    robot = VirtualRobot("minibalance", seed=5)
    drive = robot.profile("one_heading", runs=6, rows=100)
    absent = ("surface", "motor_temp", "ambient_temp", "wind_x", "wind_y", "sensor_rate")
    robot.drive(drive, noise=QUIET, sensors={"absent": absent}).write_csv(path)
    return Telemetry.read(path)


def test_what_a_log_cannot_tell_is_listed_with_what_would_help(narrow, base):
    found = diagnose(measured(narrow, base, NOISE, seed=6), base)
    assert found.verdict == "complete"
    hidden = {entry.effect: entry for entry in found.not_testable}
    # Nothing turns, nothing is known of heat, ground or the battery's own resistance.
    expected = {
        *("yaw_scrub", "motor_heating", "surface_rolling", "sensor_rate"),
        *("battery_sag", "current_ripple", "converter_efficiency"),
    }
    assert expected <= set(hidden)
    assert "motor_temp" in hidden["motor_heating"].why
    assert "source" in hidden["battery_sag"].what_would_help
    for entry in hidden.values():
        assert entry.why
        assert entry.what_would_help.endswith(".")
    named = {c.effect: c for c in found.candidates}
    for slug in expected:
        assert named[slug].why_not == hidden[slug].why
        assert named[slug].probability == 0.0
    # The rest could be told if there were more of it, and says from when on.
    for slug in set(hidden) - expected:
        known = named[slug].why_not or hidden[slug].why
        assert known == hidden[slug].why
        if named[slug].why_not is None:
            assert "unnoticed up to" in known or "hints at it" in known


def test_what_would_go_unnoticed_shrinks_with_the_noise(narrow, base):
    def untold(noise):
        found = diagnose(measured(narrow, base, noise, seed=6), base)
        return {e.effect: e.why for e in found.not_testable if "unnoticed up to" in e.why}

    much, little = untold(3.0 * NOISE), untold(0.1 * NOISE)
    assert len(little) < len(much)

    def watts(why):
        return float(why.split("up to ")[1].split(" W")[0])

    for slug in set(much) & set(little):
        assert watts(little[slug]) < 0.5 * watts(much[slug])


@pytest.fixture(scope="module")
def twins(motion, base):
    """Viscous drag, where no temperature is known: cold grease is the same formula then."""
    robot = PowerModel.from_vehicle(base.vehicle, effects=("viscous_drag",))
    robot = changed(robot, viscous_drag__viscous_torque=1.2e-5)
    rows = motion.rows.copy()
    for name in ("motor_temp", "ambient_temp"):
        rows[:, INDEX[name]] = np.nan
    known = motion.present - {"motor_temp", "ambient_temp"}
    log = replace(motion, rows=rows, present=known)
    return diagnose(measured(log, robot, NOISE, seed=7), base)


def test_effects_that_do_the_same_are_a_tie(twins):
    assert twins.verdict == "missing_effect"
    (selected,) = twins.selected
    pair = {"viscous_drag", "cold_grease"}
    assert selected in pair
    first = twins.candidates[0]
    assert pair - {selected} <= set(first.indistinguishable_from)
    (rival,) = pair - {selected}
    assert rival in twins.sentence
    assert any(pair <= set(experiment.separates) for experiment in twins.experiments)


def test_advice_for_a_tie_asks_for_the_quantity_that_tells_it(twins):
    (experiment,) = twins.experiments
    assert "motor_temp" in experiment.run


@pytest.mark.parametrize("turns", [False, True])
def test_where_all_follows_the_speed_no_single_effect_is_sure(motion, base, turns):
    """Straight ahead on level ground, motors as warm as they are fast: curves over speed alone."""
    rows = motion.rows.copy()
    speed = np.hypot(rows[:, INDEX["vx"]], rows[:, INDEX["vy"]])
    if not turns:
        rows[:] = rows_from(vx=speed, motor_temp=25.0 + 60.0 * speed)
    robot = PowerModel.from_vehicle(base.vehicle, effects=("viscous_drag",))
    robot = changed(robot, viscous_drag__viscous_torque=1.2e-5)
    log = measured(replace(motion, rows=rows), robot, NOISE, seed=7)
    found = diagnose(log, base)
    (selected,) = found.selected
    others = found.candidates[0].indistinguishable_from
    assert {"viscous_drag", "cold_grease", "air_drag"} <= {selected, *others} or turns
    assert others == () or not turns


def test_documents_are_strict_json(scrubbing, nothing, resonant):
    for diagnosis in (scrubbing, nothing, resonant):
        document = diagnosis.to_json()
        assert json.loads(json.dumps(document, allow_nan=False)) == document
        assert document["verdict"] == diagnosis.verdict
        assert {"baseline", "candidates", "not_testable", "outside_catalogue"} <= set(document)


def test_a_diagnosis_can_be_stopped(motion, base):
    log = measured(motion, base, NOISE, seed=21)
    with pytest.raises(Cancelled):
        diagnose(log, base, cancelled=lambda: True)
    heard: list[float] = []
    with pytest.raises(Cancelled):
        diagnose(
            log,
            base,
            progress=lambda share, _: heard.append(share),
            cancelled=lambda: len(heard) >= 3,
        )
    assert len(heard) == 3
    assert heard == sorted(heard)


@pytest.mark.parametrize(("over", "searches"), [(1.0, [False]), (1.5, [False, True])])
def test_a_search_that_is_lost_is_repeated_around_the_stated_values(
    motion, base, monkeypatch, over, searches
) -> None:
    """A strong effect bends the fit, and around a bent fit it may look like nothing."""
    module, asked = "planner.telemetry.diagnosis.diagnose_log", []

    def search(*given, as_stated=False, **further):
        asked.append(as_stated)
        return find_missing_effects(*given, as_stated=as_stated, **further)

    def with_much_left(found, floor):
        decision = decide(found, floor)
        assert not decision.answer.claims
        left = replace(decision.unexplained, heldout_over_floor=over)
        return replace(decision, unexplained=left)

    monkeypatch.setattr(f"{module}.find_missing_effects", search)
    monkeypatch.setattr(f"{module}.decide", with_much_left)
    # A log that is known already is not searched again.
    diagnose(measured(motion, base, NOISE, seed=17 + len(searches)), base)
    assert asked == searches
