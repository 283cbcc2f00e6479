"""Formulas for shapes: what they compute, and what is proposed for devices that are switched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.formulas.custom_parameters import NAMES, read_parameters
from planner.power.formulas.dimensions import UNITS
from planner.power.formulas.formula import check_formula
from planner.quantities import INDEX, QUANTITIES
from planner.telemetry.diagnosis import unknown_effect
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.diagnosis.unknown_effect import formula_of
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Dictionary, Shape
from planner.telemetry.quantities_of_motion import STANDSTILL, motion_axes
from planner.telemetry.selection import ShapeFound
from planner.telemetry.terms import candidate_library
from planner.telemetry.virtual import Noise, VirtualRobot
from tests.telemetry.rows import autoregressive, measured

NOISE = 0.02
WATTS = 3.0
ROW, TIME_CONSTANT = 0.1, 0.5
"""s, of a row and of a meter's filter."""


def test_a_formula_is_its_shape(motion):
    """Where the robot moves; a shape of heading or slope fades out otherwise at standstill."""
    dictionary = Dictionary.of(motion)
    laden = [replace(shape, own_load=2.5) for shape in dictionary.shapes if shape.axis != "load"]
    dictionary = dictionary.only((*dictionary.shapes, *laden, Shape("speed", "moving")))
    rows = motion.rows[motion_axes(motion.rows)["speed"] > 5.0 * STANDSTILL]
    columns = dictionary.columns(rows)
    known = {q.name: rows[:, INDEX[q.name]] for q in QUANTITIES}
    known["speed"] = np.hypot(known["vx"], known["vy"])
    known["heading"] = np.arctan2(known["vy"], known["vx"])
    for k, shape in enumerate(dictionary.shapes):
        harmonic = {"cos": (1.0, 0.0), "sin": (0.0, 1.0)}
        span = dictionary.ranges[shape.axis]
        coefficients = harmonic.get(shape.kind, (1.0,))
        effect, start = formula_of(shape, span, dictionary.temperature, coefficients)
        numbers = {name: p.default for name, p in effect.parameters.items()}
        numbers |= {name: value for (name, _), value in start.items()}
        _, units = read_parameters(effect.definition["parameters"], "parameters")
        text = effect.definition["formula"]
        formula = check_formula(text, {**NAMES, **units}, UNITS["W"])
        # Two ways to fade out at standstill, and a sine for its angle, differ by 2 %.
        nearly = 0.025 * np.abs(columns[:, k]).max()
        assert np.allclose(formula.evaluate({**known, **numbers}), columns[:, k], atol=nearly), (
            shape
        )


def test_a_side_opposite_to_all_headings_that_were_driven_has_a_formula():
    """A robot that only drives forward and to the left still has a side behind."""
    behind = Shape("heading", "lobe", -np.pi, 0.9, times_speed=1)
    _, start = formula_of(behind, (0.0, 1.8), "motor_temp", [3.0])
    assert np.cos(start["centre", 0]) == pytest.approx(-1.0)


@pytest.mark.parametrize("axis", ["temperature", "time_since_start", "speed"])
def test_what_is_switched_along_an_axis_gets_a_step(motion, base, axis):
    values = motion_axes(motion.rows)[axis]
    low, high = np.nanpercentile(values, [1, 99])
    threshold = low + 0.55 * (high - low)
    log = measured(motion, base, NOISE, seed=6, extra=WATTS * (values > threshold))
    found = diagnose(log, base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == (axis,)
    assert "tanh" in found.outside.formula
    fitted = {
        name: value
        for (effect, name, _, _), value in zip(
            found.model.slots, found.model.parameters, strict=True
        )
        if effect.slug == found.outside.name
    }
    assert fitted["threshold"] == pytest.approx(threshold, abs=0.05 * (high - low))
    assert fitted["strength"] == pytest.approx(WATTS, rel=0.15)


def test_rows_that_a_threshold_misses_move_it_however_far_out_they_are(motion, base):
    """Little noise: 3 W on the wrong side of a step are far beyond where residuals are cut."""
    values = motion_axes(motion.rows)["temperature"]
    low, high = np.nanpercentile(values, [1, 99])
    threshold = low + 0.47 * (high - low)
    extra = WATTS * (values > threshold)
    found = diagnose(measured(motion, base, 0.3 * NOISE, seed=6, extra=extra), base)
    slots = zip(found.model.slots, found.model.parameters, strict=True)
    (fitted,) = (value for (_, name, _, _), value in slots if name == "threshold")
    assert fitted == pytest.approx(threshold, abs=0.008 * (high - low))


def test_what_fades_with_speed_is_no_stiction(motion, base):
    """Losses of a bridge that idles at low speed start with the motion, as stiction does."""
    speed = motion_axes(motion.rows)["speed"]
    extra = WATTS * np.tanh(speed / 0.02) / (1.0 + (speed / 0.12) ** 2)
    found = diagnose(measured(motion, base, NOISE, seed=7, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("speed",)
    assert found.after.heldout_rmse_w < 1.15 * found.baseline.noise_floor_w


@pytest.mark.parametrize("place", [0.4, pytest.param(0.55, marks=pytest.mark.nightly)])
def test_what_rises_from_a_speed_on_is_no_air(motion, base, place):
    """A resonance that sets in, or a fan behind the motors: a bump and a drag would follow it."""
    speed = motion_axes(motion.rows)["speed"]
    threshold = place * np.percentile(speed, 99)
    extra = 6.0 * WATTS * np.maximum(speed - threshold, 0.0) / (speed.max() - threshold)
    found = diagnose(measured(motion, base, NOISE, seed=8, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.selected == ()
    assert found.outside.quantities == ("speed",)
    assert found.outside.formula == "strength * hinge(speed - threshold)"
    slots = zip(found.model.slots, found.model.parameters, strict=True)
    (fitted,) = (value for (_, name, _, _), value in slots if name == "threshold")
    assert fitted == pytest.approx(threshold, abs=0.1 * threshold)


@pytest.mark.parametrize(
    ("order", "power"),
    [
        (4, 0),
        *(pytest.param(*both, marks=pytest.mark.nightly) for both in ((1, 0), (1, 1), (4, 1))),
    ],
)
def test_a_harmonic_of_the_heading_gets_its_own_formula(motion, base, order, power):
    """Its order and the power of the speed: cosine and sine are weighed together."""
    axes = motion_axes(motion.rows)
    heading = np.nan_to_num(axes["heading"])
    moving = np.tanh(axes["speed"] / STANDSTILL) if power == 0 else axes["speed"]
    extra = WATTS * np.sin(order * heading + 0.4) * moving
    found = diagnose(measured(motion, base, NOISE, seed=10, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert f"cos({order} * heading)" in found.outside.formula
    assert found.outside.formula.endswith("* speed" if power else "* tanh(speed / standstill)")
    assert found.after.heldout_rmse_w < 1.15 * found.baseline.noise_floor_w


def test_what_drags_on_one_side_is_no_uneven_wheel(motion, base):
    """A cable that pulls to one side: a cosine pushes on the other, wheels differ on both."""
    axes = motion_axes(motion.rows)
    heading = np.nan_to_num(axes["heading"])
    extra = 3.0 * WATTS * np.maximum(np.cos(heading - 2.2), 0.0) * axes["speed"]
    found = diagnose(measured(motion, base, NOISE, seed=11, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.selected == ()
    assert found.outside.quantities == ("heading", "speed")
    assert found.after.heldout_rmse_w < 1.15 * found.baseline.noise_floor_w


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_resists_turning_to_one_side(motion, base, side):
    turning = np.maximum(side * motion.rows[:, INDEX["wz"]], 0.0)
    found = diagnose(measured(motion, base, NOISE, seed=12, extra=WATTS * turning), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("yaw_rate",)
    assert "hinge" in found.outside.formula
    assert found.after.heldout_rmse_w < 1.15 * found.baseline.noise_floor_w


def test_what_works_in_turns_is_no_load_at_rest(motion, base):
    """A servo that hunts in slow turns: its formula leaves the electronics their power."""
    rate = np.abs(motion.rows[:, INDEX["wz"]]) / 0.25
    extra = WATTS * rate * np.exp(1.0 - rate)
    found = diagnose(measured(motion, base, NOISE, seed=13, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("yaw_rate",)
    power = {p.name: p.value for p in found.fitted.parameters if p.effect == "electronics"}["power"]
    known = dict(zip(base.parameter_names, base.parameters, strict=True))
    assert power == pytest.approx(known["electronics", "power", 0], rel=0.1)


def test_what_lasts_for_a_run_is_found_in_few_runs(motion, base):
    """Runs differ a little anyhow: no test within the log is sure of six; unseen runs are."""
    log = motion.take(motion.run < 6)
    cold = np.array([3.0, 24.0, 11.0, 29.0, 7.0, 18.0])[log.run]
    usual = np.array([0.3, -0.3, -0.45, 0.3, 0.15, -0.3])[log.run]
    rows = log.rows.copy()
    rows[:, INDEX["motor_temp"]], rows[:, INDEX["ambient_temp"]] = np.nan, cold
    log = replace(log, rows=rows, present=log.present - {"motor_temp"} | {"ambient_temp"})
    extra = usual + 0.04 * WATTS * np.maximum(20.0 - cold, 0.0)
    found = diagnose(measured(log, base, NOISE, seed=14, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("temperature",)


def test_a_threshold_that_predicts_no_new_runs_stays_where_it_was(motion, base):
    """A fan runs in warm runs alone; slow noise within a cool one looks as if it began there."""
    log = motion.take(motion.run < 6)
    _, begin, count = np.unique(log.run, return_index=True, return_counts=True)
    within = (np.arange(len(log)) - begin[log.run]) / count[log.run]
    warm = np.array([77.0, 62.0, 71.0, 22.0, 32.0, 21.0])[log.run] + 3.0 * within
    rows = log.rows.copy()
    rows[:, INDEX["motor_temp"]] = warm
    log = replace(log, rows=rows, present=log.present | {"motor_temp"})
    kept, rng = np.exp(-1.0 / 40.0), np.random.default_rng(6)
    slow = np.concatenate([autoregressive(rows, kept, rng) for rows in count])
    log = measured(log, base, NOISE, seed=17, extra=0.8 * (warm > 50.0) + 0.5 * slow)
    library = candidate_library(fit(log, base).model, log)
    examination = examine(log, DesignColumns(library, Dictionary.of(log)))
    shape = ShapeFound(0, 0, 9.0, 1.0, True, ())
    found = unknown_effect.propose(examination, "temperature", shape, log, base, (), ())
    slots = zip(found.fit.model.slots, found.fit.model.parameters, strict=True)
    (threshold,) = (value for (_, name, _, _), value in slots if name == "threshold")
    assert 35.0 < threshold < 62.0


def test_what_is_switched_on_during_a_run_is_no_slow_meter(tmp_path, base):
    """A step in every run, behind a filter: the longest filter would take it for its own."""
    robot = VirtualRobot("minibalance", seed=2)
    path = tmp_path / "late.csv"
    profile = robot.profile("rich", runs=20, rows=120, row=ROW)
    robot.drive(profile, noise=Noise(level=0.01)).write_csv(path)
    log = Telemetry.read(path)
    power = log.power + WATTS * (log.rows[:, INDEX["time_since_start"]] > 3.5)
    for k in range(1, len(power)):
        if log.run[k] == log.run[k - 1]:
            gain = 1.0 - np.exp(-ROW / TIME_CONSTANT)
            power[k] = power[k - 1] + gain * (power[k] - power[k - 1])
    found = diagnose(replace(log, power=power), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("time_since_start",)
    assert found.meter is not None
    assert found.meter.time_constant_s == pytest.approx(TIME_CONSTANT, rel=0.3)


def test_the_heat_of_the_air_is_told_from_that_of_the_motors(motion, base):
    """A heater that follows the air, in a log that knows both."""
    air = np.random.default_rng(3).uniform(0.0, 30.0, 14)[motion.run]
    rows = motion.rows.copy()
    rows[:, INDEX["ambient_temp"]] = air
    log = replace(motion, rows=rows, present=motion.present | {"ambient_temp"})
    assert np.isfinite(rows[:, INDEX["motor_temp"]]).all()
    extra = 0.1 * WATTS * np.maximum(20.0 - air, 0.0)
    found = diagnose(measured(log, base, NOISE, seed=15, extra=extra), base)
    assert found.verdict == "outside_catalogue", found.sentence
    assert found.outside.quantities == ("temperature",)
    assert "ambient_temp" in found.outside.formula


@pytest.mark.parametrize("laden", [True, False])
def test_a_strength_goes_with_the_load_where_runs_show_it(motion, base, monkeypatch, laden):
    """What rubs in turns, by the weight upon it or not; most of a heavy robot's losses are."""
    turning, load = (motion.rows[:, INDEX[name]] for name in ("wz", "payload"))
    extra = 2.0 * np.abs(turning) * (load + 1.0 if laden else load.mean() + 1.0)
    log = measured(motion, base, NOISE, seed=14, extra=extra)
    fitted = fit(log, base)
    library = candidate_library(fitted.model, log)
    examination = examine(log, DesignColumns(library, Dictionary.of(log)))

    def proposed(model, log, additions, **_):
        raise InterruptedError(additions[-1].declaration, additions[-1].start)

    monkeypatch.setattr(unknown_effect, "fit_with", proposed)
    shape = ShapeFound(0, 0, 9.0, 1.0, True, ())
    with pytest.raises(InterruptedError) as asked:
        unknown_effect.propose(examination, "yaw_rate", shape, log, base, (), ())
    effect, start = asked.value.args
    assert ("payload" in effect.definition["formula"]) is laden
    assert ("load" in effect.title) is laden
    if laden:
        assert start["strength", 0] == pytest.approx(2.0, rel=0.2)
        assert start["own_load", 0] == pytest.approx(1.0, abs=1.0)


def test_what_is_the_same_in_every_direction_is_no_effect_over_the_heading(motion, base):
    """Brakes that are held open while the robot moves; a wide lobe would describe them as well."""
    axes = motion_axes(motion.rows)
    moving = np.tanh(axes["speed"] / STANDSTILL)
    aside = moving * np.maximum(np.cos(np.nan_to_num(axes["heading"]) - 0.4), 0.0)
    shape = ShapeFound(0, 0, 9.0, 1.0, True, ())
    for extra, axis in ((moving, "speed"), (aside, "heading")):
        log = measured(motion, base, NOISE, seed=16, extra=2.0 * WATTS * extra)
        library = candidate_library(fit(log, base).model, log)
        examination = examine(log, DesignColumns(library, Dictionary.of(log)))
        found = unknown_effect.propose(examination, "heading", shape, log, base, (), ())
        assert found.outside.quantities == (axis,)
