"""A standing robot's power on a slope is unsure, and how near to rest friction is complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.holdout import heldout_residual, rms
from planner.telemetry.other_terms import given_columns
from planner.telemetry.prediction import predict
from planner.telemetry.selection.selection_loop import investigate
from planner.telemetry.selection.unsure_power import holding, sided_sooner, unsure_power
from tests.power.states import changed
from tests.telemetry.rows import TRUTH, measured

SCRUB = {"yaw_scrub__scrub_moment": 3.0}
MOTION = [INDEX[name] for name in ("vx", "vy", "wz", "ax", "ay", "yaw_acceleration")]


def standing(log, pitch):
    """The rows at rest on slopes; ``pitch`` (n,) rad."""
    rows = log.rows.copy()
    rows[:, MOTION] = 0.0
    rows[:, INDEX["gravity_x"]], rows[:, INDEX["gravity_y"]] = -9.81 * np.sin(pitch), 0.0
    return replace(log, rows=rows)


@pytest.fixture(scope="module")
def stops(motion):
    """The varied drive; for a sixth of its rows the robot stands on slopes up to 0.2 rad."""
    still = np.arange(len(motion)) % 60 < 10
    pitch = np.random.default_rng(4).uniform(-0.2, 0.2, len(motion))
    rows = np.where(still[:, None], standing(motion, pitch).rows, motion.rows)
    return replace(motion, rows=rows)


def test_holding_takes_the_slope_s_force_and_no_friction(motion, base):
    log = standing(motion.take(slice(0, 3)), np.array([0.0, 0.1, 0.2]))
    watts = predict(base, log)
    level, gentle, steep = holding(log, base, watts)
    assert level == pytest.approx(0.0, abs=1e-9)
    pulled = log.rows.copy()
    pulled[:, INDEX["vx"]] = 0.05
    upwards = predict(base, replace(log, rows=pulled))
    # Driven up the slope it needs as much for the slope, and more for friction.
    assert 0.0 < gentle < steep
    assert watts[1] + gentle < upwards[1]
    assert watts[2] + steep < upwards[2]


def test_where_a_robot_drives_nothing_is_unsure(motion, base):
    moving = motion.rows.copy()
    moving[:, INDEX["vx"]] = 0.3
    log = replace(motion, rows=moving)
    assert not np.any(holding(log, base, predict(base, log)))


def test_a_robot_that_holds_without_friction_leaves_noise(stops, robot, base):
    extra = holding(stops, robot, predict(robot, stops))
    log = measured(stops, robot, 0.02, seed=6, extra=extra)
    fitted = fit(log, base)
    given = given_columns(log, fitted.model, fitted.watts)
    columns = unsure_power(log, fitted, given)
    assert columns is not None
    left = rms(heldout_residual(log, fitted, columns))
    assert left < 0.5 * rms(heldout_residual(log, fitted, given))


def test_a_robot_that_friction_helps_leaves_nothing_unsure(stops, robot, base):
    log = measured(stops, robot, 0.02, seed=6)
    fitted = fit(log, base)
    given = given_columns(log, fitted.model, fitted.watts)
    columns = unsure_power(log, fitted, given)
    assert columns is not None
    standing_still = np.all(log.rows[:, MOTION] == 0.0, axis=1)
    # Of the widths of friction, which come last, a robot at rest knows nothing.
    assert columns.shape == given.shape or not np.any(columns[standing_still, -1])


def test_what_makes_unseen_runs_worse_explains_nothing_of_a_claim(motion, robot, base):
    """It predicted better beside the model alone; that does not make it better beside an effect."""
    log = measured(motion, robot, 0.02, seed=1)
    found = investigate(log, base, (), lambda _share, _what: None)
    plain = rms(heldout_residual(log, found.base))
    useless = np.random.default_rng(3).standard_normal((len(log), 40))
    misled = rms(heldout_residual(log, found.base, useless))
    assert misled > 1.005 * plain
    found.__dict__["given"] = useless
    assert rms(found.heldout(found.base)) == pytest.approx(plain)


@pytest.fixture(scope="module")
def creeps(motion):
    """The varied drive; for a sixth of its rows the robot creeps, at up to 3 cm/s."""
    slow = np.arange(len(motion)) % 60 < 10
    rows = motion.rows.copy()
    rows[np.ix_(slow, MOTION)] = 0.0
    rows[slow, INDEX["vx"]] = np.random.default_rng(5).uniform(-0.03, 0.03, slow.sum())
    return replace(motion, rows=rows)


def test_friction_that_is_complete_nearer_to_rest_needs_more_while_creeping(creeps, robot):
    more = sided_sooner(creeps, robot)
    speed = np.abs(creeps.rows[:, [INDEX["vx"], INDEX["vy"]]])
    creeping = (speed[:, 0] > 0.001) & (speed[:, 0] < 0.02) & (speed[:, 1] == 0.0)
    fast = speed.min(axis=1) > 0.2
    assert np.all(more[creeping] > 0.0)
    assert np.abs(more[fast]).max() < 0.02 * more[creeping].max()
    # Rollers have no friction at rest, so that only the rims' and the motors' share is told.
    sharp = predict(replace(robot, sliding_speed=0.25 * robot.sliding_speed), creeps)
    narrower = sharp - predict(robot, creeps)
    assert np.all(more[creeping] > 0.95 * narrower[creeping])


@pytest.mark.parametrize(("sticks", "least", "most"), [(False, 1.0, 1.05), (True, 1.2, np.inf)])
def test_widths_of_friction_explain_themselves_and_no_stiction(
    creeps, robot, base, sticks, least, most
):
    if sticks:
        stuck = PowerModel.from_vehicle(base.vehicle, effects=("stiction",))
        real = changed(stuck, **TRUTH, stiction__strength=1.0, stiction__stiction_speed=0.03)
    else:
        real = replace(robot, sliding_speed=0.25 * robot.sliding_speed)
    log = measured(creeps, real, 0.01, seed=8)
    noise = rms(log.power - predict(real, log))
    fitted = fit(log, base)
    given = given_columns(log, fitted.model, fitted.watts)
    plain = rms(heldout_residual(log, fitted, given))
    columns = unsure_power(log, fitted, given)
    left = rms(heldout_residual(log, fitted, columns))
    assert least * noise < left < min(most * noise, plain / 1.1)


@pytest.mark.parametrize("helps", [False, True])
def test_a_usual_error_explains_beside_a_claim_what_it_did_not_beside_the_model(
    motion, base, helps
):
    """A missing effect may hide that a sensor errs; nothing hides it from the effect's claim.

    Beside the model, friction nearer to rest helps or not; its place is no reason either.
    """
    watts = predict(base, motion)
    off = given_columns(motion, base, watts)
    number = int(np.argmax(np.var(off, axis=0)))
    robot = changed(PowerModel.from_vehicle(base.vehicle, effects=("yaw_scrub",)), **SCRUB)
    log = measured(motion, robot, 0.02, seed=1, extra=2.0 * off[:, number])
    found = investigate(log, base, (), lambda _share, _what: None)
    assert "yaw_scrub" in [member.name for member in found.selection.members]
    found.__dict__["given"] = sided_sooner(log, base)[:, None] if helps else None
    claimed = rms(heldout_residual(found.log, found.fitted))
    assert rms(found.heldout(found.fitted)) < 0.98 * claimed
