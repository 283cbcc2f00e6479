"""A log with another sign, unit or axis than stated is told from a robot that lacks an effect."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from planner.quantities import INDEX
from planner.telemetry.diagnosis.diagnose_log import diagnose
from planner.telemetry.estimation import fit
from planner.telemetry.holdout import overall_error
from planner.telemetry.misread import misread
from planner.telemetry.quantities_of_motion import motion_axes
from planner.telemetry.virtual import Noise, VirtualRobot
from tests.power.states import changed
from tests.telemetry.rows import measured

NOISE = 0.02


@pytest.fixture(scope="module")
def log(motion, robot):
    """A log of a robot that lacks nothing; accelerations were derived."""
    log = measured(motion, robot, NOISE, seed=3)
    return replace(log, present=log.present - {"ax", "ay"})


def written(log, **columns):
    """The log with other values in columns of its rows; each is (n,)."""
    rows = log.rows.copy()
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    return replace(log, rows=rows)


def faster(log):
    """All that is in m/s and m/s² in km/h and km/h/s."""
    names = ("vx", "vy", "ax", "ay", "odometer")
    return written(log, **{name: 3.6 * column(log, name) for name in names})


def column(log, name):
    return log.rows[:, INDEX[name]]


def turned(log, factor):
    """As if its yaw rate were ``factor`` times as large, with accelerations that follow it."""
    vx, vy, wz = (column(log, name) for name in ("vx", "vy", "wz"))
    return written(
        log,
        wz=factor * wz,
        yaw_acceleration=factor * column(log, "yaw_acceleration"),
        ax=column(log, "ax") - (factor - 1.0) * wz * vy,
        ay=column(log, "ay") + (factor - 1.0) * wz * vx,
    )


def exchanged(log):
    """As a log of x to the right and y ahead would be."""
    return written(
        log,
        vx=-column(log, "vy"),
        vy=column(log, "vx"),
        ax=-column(log, "ay"),
        ay=column(log, "ax"),
    )


def mirrored(log):
    """As a log of y to the right would be, with all else of ROS."""
    vx, vy, wz = (column(log, name) for name in ("vx", "vy", "wz"))
    return written(
        log,
        vy=-vy,
        ax=column(log, "ax") + 2.0 * wz * vy,
        ay=-column(log, "ay") + 2.0 * wz * vx,
    )


def swapped(log):
    """As if the headings of vx and vy were exchanged; the accelerations were derived of them."""
    vx, vy, wz = (column(log, name) for name in ("vx", "vy", "wz"))
    return written(
        log,
        vx=vy,
        vy=vx,
        ax=column(log, "ay") - 2.0 * wz * vx,
        ay=column(log, "ax") + 2.0 * wz * vy,
    )


def error_of(log, base):
    return overall_error(log, fit(log, base))


WRONG = {
    "its pitch is positive uphill": lambda log: written(log, gravity_x=-column(log, "gravity_x")),
    "its roll is positive with": lambda log: written(log, gravity_y=-column(log, "gravity_y")),
    "its pitch and its roll are exchanged": lambda log: written(
        log, gravity_x=-column(log, "gravity_y"), gravity_y=-column(log, "gravity_x")
    ),
    "its vx is to the right and its vy ahead": exchanged,
    "its vx and its vy are exchanged": swapped,
    "its vy is positive to the right": mirrored,
    "its wz is in degrees per second": lambda log: turned(log, 180.0 / math.pi),
    "its vx and its vy are in km/h": faster,
}


@pytest.mark.parametrize("said", WRONG)
def test_what_was_written_wrongly_is_said(log, base, said):
    wrong = WRONG[said](log)
    found = misread(wrong, base, error_of(wrong, base))
    assert found is not None
    assert said in found.sentence
    # Read rightly, the noise is left.
    assert found.error_w == pytest.approx(NOISE * np.mean(np.abs(log.power)), rel=0.15)


def test_a_power_that_does_not_vary_says_nothing_of_the_motion(log, base):
    """A meter that stands still: a model of next to no motion errs least, and explains nothing."""
    still = replace(log, power=np.full_like(log.power, log.power.mean()))
    assert misread(still, base, error_of(still, base)) is None


def test_a_log_that_is_read_rightly_stays_as_it_is(log, base):
    assert misread(log, base, error_of(log, base)) is None


def test_a_missing_effect_is_no_wrong_reading(motion, base, robot):
    for axis in ("speed", "heading", "slope_along"):
        values = np.nan_to_num(motion_axes(motion.rows)[axis])
        log = measured(motion, robot, NOISE, seed=4, extra=3.0 * np.sin(3.0 * values))
        assert misread(log, base, error_of(log, base)) is None


def test_a_wrong_sign_comes_before_any_effect(log, base):
    wrong = WRONG["its pitch is positive uphill"](log)
    found = diagnose(wrong, base)
    assert found.verdict == "not_identifiable"
    assert found.selected == ()
    assert found.outside is None
    assert found.experiments == ()
    assert "if its pitch is positive uphill" in found.sentence
    assert found.baseline.noise_floor_w == pytest.approx(
        NOISE * np.mean(np.abs(log.power)), rel=0.15
    )


@pytest.mark.nightly
def test_a_floor_that_a_wrong_reading_raises_hides_it_from_nobody(tmp_path):
    """In a long log many columns follow what a wrong axis does, and so does the floor."""
    robot = VirtualRobot("minibalance", hidden={"regeneration_limit": {}}, seed=1)
    path = tmp_path / "drive.csv"
    robot.drive("rich", noise=Noise(level=NOISE)).split()[0].write_csv(path)
    read = ("run", "time", "vx", "vy", "wz", "power", "roll", "pitch", "payload")
    log = pd.read_csv(path)[list(read)]
    log[["vx", "vy"]] = log[["vy", "vx"]].to_numpy()
    found = diagnose(log, "minibalance")
    assert "if its vx and its vy are exchanged" in found.sentence
    assert found.baseline.noise_floor_w < 0.1 * found.baseline.heldout_rmse_w


def test_a_power_without_its_sign_is_no_limit_of_braking(motion, base, robot):
    """Steep slopes, and electronics that take little, so that braking gives energy back."""
    steep = written(motion, gravity_x=4.0 * column(motion, "gravity_x"))
    start, true = (changed(model, electronics__power=0.5) for model in (base, robot))
    log = measured(steep, true, NOISE, seed=5)
    found = diagnose(replace(log, power=np.abs(log.power)), start)
    assert found.selected == ()
    assert "if its power has lost its sign" in found.sentence
    # Near nil the model's sign is a guess, so that more than the noise is left.
    assert found.baseline.noise_floor_w < 0.5 * found.after.heldout_rmse_w
    # Braking power that is refused is the effect.
    assert "sign" not in diagnose(replace(log, power=np.maximum(log.power, 0.0)), start).sentence
