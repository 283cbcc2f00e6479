"""The laboratory: its instruments alone change the log, by what they say, and draws are apart."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner import diagnose
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.diagnosis.unknown_effect import formula_of
from planner.telemetry.holdout import metered_base_fit, rms
from planner.telemetry.holdout.heldout import heldout_rmse
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Shape
from planner.telemetry.prediction import Readings, predict
from planner.telemetry.sampling import open_source
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import Addition, fit_with
from planner.telemetry.tilt_filter import with_true_tilt
from planner.telemetry.virtual import VirtualRobot
from planner.telemetry.virtual.dynamics import MEANS
from tests.benchmarks.laboratory import (
    HEADING,
    KEPT,
    LEAST_CANDIDATES,
    keep_section,
    probabilities,
    summary,
)
from tests.hidden_effects.laboratory import MECHANISMS, SPLITS, Instruments, Log, Meter, draw
from tests.hidden_effects.laboratory.drives import Conditions, drawn_drive
from tests.hidden_effects.laboratory.instruments import filtered, held_times, sampled
from tests.hidden_effects.laboratory.oracle import Oracle, carried, through_meter
from tests.hidden_effects.laboratory.outcomes import outcome

TIMES = np.arange(400) * 0.01 + 0.005


def test_filter_settles_on_a_constant_and_keeps_the_energy_of_a_pulse() -> None:
    constant = filtered(np.full(400, 7.0), 0.01, 0.3)
    assert constant == pytest.approx(7.0, rel=1e-12)
    pulse = np.zeros(4000)
    pulse[10:20] = 5.0
    assert filtered(pulse, 0.01, 0.3).sum() == pytest.approx(pulse.sum(), rel=1e-9)


def test_filter_follows_a_step_with_its_time_constant() -> None:
    step = np.where(TIMES > 1.0, 1.0, 0.0)
    seen = filtered(step, 0.01, 0.25)
    after = TIMES > 1.02
    assert seen[after] == pytest.approx(1.0 - np.exp(-(TIMES[after] - 1.0) / 0.25), abs=1e-4)


def test_row_means_hold_the_energy_of_the_bins() -> None:
    watts = np.random.default_rng(1).uniform(1.0, 9.0, 400)
    rows = sampled(watts, 0.01, np.arange(1, 21) * 0.2, 0.2)
    assert rows.mean() == pytest.approx(watts.mean(), rel=1e-12)


@pytest.mark.parametrize("window", [0.0, 0.05])
def test_a_late_meter_begins_with_the_first_power(window: float) -> None:
    watts = np.concatenate([np.full(100, 6.0), np.full(100, 2.0)])
    times = np.arange(1, 41) * 0.05
    late = sampled(watts, 0.01, times - 0.12, window)
    assert late[:10] == pytest.approx(6.0)
    assert late[-10:] == pytest.approx(2.0)


def test_a_slow_meter_repeats_its_last_reading() -> None:
    held = held_times(np.array([0.9, 1.0, 1.49, 1.5]), 0.5, 0.0)
    assert held.tolist() == [0.5, 1.0, 1.0, 1.5]


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> tuple[VirtualRobot, Conditions]:
    folder = tmp_path_factory.mktemp("robot")
    log = draw("none", "", 3, "tuning", folder)
    conditions = replace(log.truth.conditions, rate=10.0, lengths=(20.0, 15.0))
    return VirtualRobot(str(log.robot)), conditions


def test_perfect_instruments_show_the_robot(driven: tuple[VirtualRobot, Conditions]) -> None:
    robot, conditions = driven
    drive = drawn_drive(np.random.default_rng(5), robot.vehicle, conditions)
    means, _ = robot.simulate(drive)
    perfect = Instruments(meter=Meter(sampling="mean", motion="mean"))
    columns, clean = perfect.measure(np.random.default_rng(6), drive, means, conditions.lengths)
    power = means[:, :, MEANS.index("power")].reshape(2, -1, 10).mean(axis=2)
    speed = means[:, :, MEANS.index("vx")].reshape(2, -1, 10).mean(axis=2)
    rows = [int(length * 10) for length in conditions.lengths]
    for k, start in ((0, 0), (1, rows[0])):
        part = slice(start, start + rows[k])
        assert clean[part] == pytest.approx(power[k, : rows[k]], rel=1e-9)
        assert columns["power"][part] == pytest.approx(clean[part], abs=1e-5)
        assert columns["vx"][part] == pytest.approx(speed[k, : rows[k]], abs=1e-5)


def test_angles_that_follow_an_accelerometer_take_speeding_up_for_a_slope(
    driven: tuple[VirtualRobot, Conditions],
) -> None:
    """By the acceleration over g, behind the filter; without it they are the floor's."""
    robot, conditions = driven
    drive = drawn_drive(np.random.default_rng(5), robot.vehicle, conditions)
    means, _ = robot.simulate(drive)
    log = {}
    for seconds in (0.0, 0.02, 1.0):
        exact = Instruments(meter=Meter(motion="mean"), angle_filter=seconds)
        exact = replace(exact, columns=frozenset({"pitch", "roll", "ax", "ay"}))
        log[seconds], _ = exact.measure(np.random.default_rng(6), drive, means, conditions.lengths)
    for angle, pull, side in (("pitch", "ax", 1.0), ("roll", "ay", -1.0)):
        prompt, slow = (
            side * STANDARD_GRAVITY * (log[0.0][angle] - log[seconds][angle])
            for seconds in (0.02, 1.0)
        )
        assert np.corrcoef(prompt, log[0.0][pull])[0, 1] > 0.95
        assert 0.0 < np.std(slow) < np.std(prompt)


@pytest.mark.parametrize("seed", [6730, 6851])
def test_freed_angles_are_those_of_the_floor(seed: int, tmp_path: Path) -> None:
    """Also where rows are long, runs begin by speeding up, and a second is missing in a run."""
    log = draw("none", "", seed, "tuning", tmp_path / "bent")
    true = draw("none", "", seed, "tuning", tmp_path / "true", angle_filter=0.0)
    source = open_source(Telemetry.read(log.path))
    freed = source.freed_tilt(log.truth.instruments.angle_filter)
    floor = Telemetry.read(true.path).rows
    for place in (INDEX["gravity_x"], INDEX["gravity_y"]):
        bent, left = (
            np.std(one.sample.rows[:, place] - floor[:, place]) for one in (source, freed)
        )
        assert left < 0.1 * bent


@pytest.mark.parametrize(
    ("seed", "share"), [(6721, 0.7), pytest.param(6821, 0.9, marks=pytest.mark.nightly)]
)
def test_held_out_runs_show_what_a_bent_model_hides(
    seed: int, share: float, tmp_path: Path
) -> None:
    """Beside a model that is fitted to bent tilts, the power is no likelier by true ones."""
    log = draw("none", "", seed, "tuning", tmp_path)
    true = log.truth.instruments.angle_filter
    assert true > 0.0
    source = open_source(Telemetry.read(log.path, log.mapping))
    start = starting_model(str(log.sheet))
    freed = with_true_tilt(source, start)
    assert freed.tilt_filter == pytest.approx(true, rel=0.4)
    errors = [heldout_rmse(*metered_base_fit(one.sample, start)) for one in (source, freed)]
    assert errors[1] < share * errors[0]


def test_held_out_runs_show_late_tilts_that_a_fitted_model_hides(tmp_path: Path) -> None:
    recorded = {"odometry_period": 0.0, "bunched": False}
    log = draw("none", "", 7758, "tuning", tmp_path, **recorded)
    true = log.truth.instruments.angle_lag
    source = open_source(Telemetry.read(log.path, log.mapping))
    start = starting_model(str(log.sheet))
    earlier = with_true_tilt(source, start)
    assert earlier.tilt_lag == pytest.approx(true, abs=0.05)
    errors = [heldout_rmse(*metered_base_fit(one.sample, start)) for one in (source, earlier)]
    assert errors[1] < 0.8 * errors[0]


def test_splits_never_share_a_draw(tmp_path: Path) -> None:
    logs = [draw("none", "", 0, split, tmp_path) for split in SPLITS]
    assert len({log.robot.read_text().partition("\n")[2] for log in logs}) == len(SPLITS)
    first = list(SPLITS.values())
    with pytest.raises(ValueError, match="tuning"):
        draw("none", "", max(first), "tuning", tmp_path)


def test_a_draw_comes_back_and_can_be_read(tmp_path: Path) -> None:
    first, again = (draw("one", "air_drag", 4, "tuning", tmp_path / n) for n in ("a", "b"))
    assert all(np.array_equal(first.columns[n], again.columns[n]) for n in first.columns)
    read = Telemetry.read(first.path)
    assert len(read) == len(first.columns["time"])
    assert load_vehicle(str(first.sheet)).mass != load_vehicle(str(first.robot)).mass


def test_no_wheel_pushes_instead_of_dragging(tmp_path: Path) -> None:
    """Drawn large: without its bound one wheel would have less drag than none."""
    log = draw("one", "wheel_imbalance", 3700, "tuning", tmp_path)
    excess = np.array(log.truth.hidden["wheel_imbalance"]["excess"])
    assert (1.0 + excess - excess.mean()).min() > 0.0
    assert excess.std() > 0.3


def test_an_offset_that_nobody_knows_of_is_not_in_the_log(tmp_path: Path) -> None:
    logs = [draw("one", "com_offset", seed, "tuning", tmp_path) for seed in range(6)]
    unknown = [log.truth.hidden["com_offset"]["gain"] == 0.0 for log in logs]
    assert any(unknown)
    assert not all(unknown)
    measured = ["com_x" in log.columns for log in logs]
    assert any(measured)
    assert not any(np.logical_and(unknown, measured))


@pytest.mark.parametrize("name", MECHANISMS)
def test_mechanisms_have_their_size(name: str, tmp_path: Path) -> None:
    log = draw("outside", name, 1, "tuning", tmp_path)
    assert 0.015 < log.truth.sizes[name] < 0.13


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return draw("one", "air_drag", 4, "tuning", tmp_path_factory.mktemp("hidden"))


def answer(verdict: str, *selected: str, **more: Any) -> dict[str, Any]:
    """A diagnosis with what an outcome depends on."""
    ties = more.pop("ties", {})
    entries = [{"effect": s, "indistinguishable_from": ties.get(s, [])} for s in selected]
    return {"verdict": verdict, "selected": list(selected), "candidates": entries, **more}


def test_a_mechanism_that_does_not_work_in_a_drive_is_not_blown_up(tmp_path: Path) -> None:
    """A cable that never drags: rounding had made its factor 10¹⁶ in the next drive."""
    log = draw("outside", "tether", 8604, "validation", tmp_path, second=True)
    for path in (log.path, log.second_path):
        read = Telemetry.read(path, log.mapping)
        assert np.abs(read.power).max() < 1e3


def test_outcomes_of_a_hidden_effect(hidden: Log) -> None:
    shape = {"quantities": ["speed"]}
    said = {
        "exact": answer("missing_effect", "air_drag"),
        "tied": answer("missing_effect", "vibration", ties={"vibration": ["air_drag"]}),
        "among": answer("outside_catalogue", "air_drag", outside_catalogue=shape),
        "abstained": answer("not_identifiable"),
        "missed": answer("complete"),
        "wrong": answer("outside_catalogue", outside_catalogue=shape),
    }
    assert {name: outcome(hidden, found) for name, found in said.items()} == {n: n for n in said}
    assert outcome(hidden, answer("missing_effect", "wear")) == "wrong"


def test_outcomes_outside_the_catalogue(tmp_path: Path) -> None:
    log = draw("outside", "tether", 1, "tuning", tmp_path)
    right = answer("outside_catalogue", outside_catalogue={"quantities": ["heading", "speed"]})
    other = answer("outside_catalogue", outside_catalogue={"quantities": ["load"]})
    assert outcome(log, right) == "exact"
    assert outcome(log, other) == "quantity"
    assert outcome(log, answer("missing_effect", "wheel_imbalance")) == "wrong"


def test_the_true_meter_passes_on_what_it_shows(hidden: Log) -> None:
    read = Telemetry.read(hidden.path)
    watts = np.full((len(read), 1), 5.0)
    meter = Meter(time_constant=0.3, sampling="mean", delay=0.1)
    assert through_meter(read, watts, meter, 0.2) == pytest.approx(5.0, rel=1e-9)
    assert through_meter(read, read.power[:, None], Meter(), 0.2)[:, 0] == pytest.approx(read.power)


def test_what_a_filter_shows_after_a_gap_is_known_but_for_what_it_carries(hidden: Log) -> None:
    read = Telemetry.read(hidden.path)
    row = 1.0 / hidden.truth.conditions.rate
    meter = Meter(time_constant=0.5, sampling="end", motion="end")
    power = read.power[:, None]
    shown = through_meter(read, power, meter, row)
    lost = (read.time > 3.0) & (read.time < 3.0 + 20.0 * row)
    kept = read.take(~lost)
    left = shown[~lost] - through_meter(kept, power[~lost], meter, row)
    rest = left - carried(kept, left, meter.time_constant)
    assert np.abs(rest).max() < 0.05 * np.abs(left).max()


@pytest.mark.nightly
def test_an_oracle_knows_what_a_mechanism_adds(tmp_path: Path) -> None:
    log = draw("outside", "idling_bridge", 3658, "tuning", tmp_path)
    size = np.sqrt(np.mean(log.truth.outside_power**2)) / np.mean(log.truth.clean_power)
    assert size == pytest.approx(log.truth.sizes["idling_bridge"], rel=0.3)
    oracle = Oracle.of(log)
    untold = Oracle.of(
        replace(log, truth=replace(log.truth, outside_power=0.0 * log.truth.outside_power))
    )
    assert oracle.rho["idling_bridge"] > 0.5
    assert oracle.floor_w < 0.9 * untold.floor_w


def test_another_drive_keeps_what_a_formula_promises(tmp_path: Path) -> None:
    """A narrow shape moves far where it is fitted to fewer runs, and is adopted as of all runs."""
    log = draw("outside", "idling_bridge", 3658, "tuning", tmp_path, second=True)
    first, second = (Telemetry.read(path) for path in (log.path, log.second_path))
    first, base = metered_base_fit(first, starting_model(log.sheet))
    bump = Shape("speed", "bump", 0.08, 0.04, 0)
    effect, start = formula_of(bump, (0.0, 0.7), "motor_temp", [1.0])
    fitted = fit_with(base.model, first, [Addition(effect, start)], noise=base.noise)
    promised = heldout_rmse(first, fitted) / heldout_rmse(first, base)
    second = replace(second, meter=first.meter)
    readings = Readings.of(second)
    assert readings is not None
    errors = [
        rms(second.power - readings.shown(predict(model, second)))
        for model in (fitted.model, base.model)
    ]
    kept = errors[0] / errors[1]
    assert kept < 0.95
    assert promised == pytest.approx(kept, abs=0.04)


@pytest.mark.nightly
def test_of_two_effects_neither_stands_in_the_others_way(tmp_path: Path) -> None:
    """Each takes off much, and alone looks like a competing explanation of the other."""
    # Odometry of 6 Hz hides what brakes; at the rate of the rows it shows.
    pair = "regeneration_limit+air_drag"
    log = draw("several", pair, 3645, "tuning", tmp_path, odometry_period=0.0)
    found = diagnose(log.path, str(log.sheet), mapping=log.mapping)
    assert set(found.selected) == {"regeneration_limit", "air_drag"}
    assert found.after.heldout_rmse_w < 0.65 * found.baseline.heldout_rmse_w


@pytest.mark.nightly
def test_a_third_effect_is_seen_beside_the_other_two(tmp_path: Path) -> None:
    """Around a model that lacks three effects the third one gains less than it costs.

    The recorder repeats the odometry, which is half as fast as the log.
    """
    log = draw("several", "gear_asymmetry+air_drag+yaw_scrub", 4889, "tuning", tmp_path)
    found = diagnose(log.path, str(log.sheet), mapping=log.mapping)
    assert set(found.selected) == {"gear_asymmetry", "air_drag", "yaw_scrub"}


@pytest.mark.nightly
def test_usual_errors_do_not_spoil_a_right_pair(tmp_path: Path) -> None:
    """Fitted to few runs, errors of the data sheet made the right pair predict badly."""
    log = draw("several", "surface_rolling+stiction", 4006, "tuning", tmp_path)
    found = diagnose(log.path, str(log.sheet), mapping=log.mapping)
    assert set(found.selected) == {"surface_rolling", "stiction"}
    assert found.after.heldout_rmse_w < 0.7 * found.baseline.heldout_rmse_w


def test_joined_tenths_hold_every_candidate() -> None:
    rows = [{"probabilities": [("a", k / 100.0, k > 50, 0.0)]} for k in range(100)] * 4
    found = probabilities(rows)
    assert sum(entry["candidates"] for entry in found) == 400
    assert all(entry["candidates"] >= LEAST_CANDIDATES for entry in found)


def test_a_page_keeps_one_section(tmp_path: Path) -> None:
    page, kept = tmp_path / "naming.md", tmp_path / KEPT
    page.write_text("# Page\n\nTidy logs.\n", encoding="utf-8")
    keep_section(tmp_path)
    assert HEADING not in page.read_text(encoding="utf-8")
    kept.parent.mkdir()
    found = summary([], "tuning") | {"noise_floor_over_oracle": [0.5, 1.0, 1.5]}
    kept.write_text(json.dumps(found), encoding="utf-8")
    for _ in range(2):
        keep_section(tmp_path)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Page\n\nTidy logs.\n")
    assert text.count(HEADING) == 1


@pytest.mark.nightly
def test_nothing_is_named_that_raises_the_error_of_who_adopts_it(tmp_path: Path) -> None:
    """Nothing is hidden here; stiction lowers only what usual errors of the robot leave."""
    log = draw("none", "", 8256, "validation", tmp_path)
    found = diagnose(log.path, str(log.sheet), mapping=log.mapping)
    assert "stiction" in [one.effect for one in found.candidates]
    assert found.selected == ()
    assert found.after.heldout_rmse_w <= found.baseline.heldout_rmse_w


@pytest.mark.nightly
def test_what_the_data_sheet_and_sensors_may_explain_is_gone_without_their_errors(
    tmp_path: Path,
) -> None:
    said = "data sheet and of the sensors are a part of this error: without them it may be "
    log = draw("none", "", 5379, "tuning", tmp_path)
    found = diagnose(log.path, str(log.sheet), mapping=log.mapping)
    promised = float(found.sentence.partition(said)[2].split(" W")[0])
    assert promised < found.after.heldout_rmse_w / 1.2
    exact: dict[str, Any] = dict.fromkeys(("speed_scale", "sideways_scale", "slip"), 0.0)
    exact |= dict.fromkeys(("pitch_offset", "roll_offset", "clock_rate"), 0.0)
    exact["acceleration_bias"] = (0.0, 0.0)
    log = draw("none", "", 5379, "tuning", tmp_path / "exact", **exact)
    found = diagnose(log.path, str(log.robot), mapping=log.mapping)
    assert found.after.heldout_rmse_w == pytest.approx(promised, rel=0.15)
    assert said not in found.sentence
