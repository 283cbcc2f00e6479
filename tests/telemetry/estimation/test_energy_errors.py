"""Errors of predicted energies: what the parameters leave open, and the noise of one drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from planner.power.catalogue import find_effect
from planner.quantities import INDEX
from planner.telemetry.estimation.energy_errors import PRIOR_RUNS, covered_by, energy_error
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import Nodes, predict, tangent
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import Addition, fit_with
from planner.telemetry.virtual import QUIET, Noise, VirtualRobot
from tests.hidden_effects.logs import VEHICLE, write_robot
from tests.telemetry.rows import measured

NOISE = 0.03


def slopes_of(model, log, rows=slice(None)):
    """(P,) J per unit of every parameter, of a drive along some rows of a log."""
    part = log.take(rows)
    nodes = Nodes.of(part, model)
    _, columns = tangent(model, nodes, range(len(model.parameters)))
    return part.interval @ columns


def place_of(model, slug, name):
    return model.parameter_names.index((slug, name, 0))


def deviation(model, log, covariance, rows=slice(None)):
    """J, of the energy of those rows, from the parameters alone."""
    slopes = slopes_of(model, log, rows)
    return float(np.sqrt(slopes @ covariance.matrix(model.parameter_names) @ slopes))


@pytest.fixture(scope="module")
def fitted(motion, base):
    return fit(measured(motion, base, NOISE, seed=5), base)


@pytest.fixture(scope="module")
def known(motion, base, fitted):
    return energy_error(measured(motion, base, NOISE, seed=5), fitted)


def test_energies_scatter_as_told_when_the_noise_is_drawn_anew(motion, base, known, fitted):
    """Twelve logs of one robot: the fits' energies of one run scatter by what one fit tells."""
    covariance, _ = known
    run = motion.run == 3
    energies = []
    for seed in range(100, 112):
        again = fit(measured(motion, base, NOISE, seed=seed), base)
        part = motion.take(run)
        energies.append(float(predict(again.model, part) @ part.interval))
    told = deviation(fitted.model, motion, covariance, run)
    # A standard deviation from 12 draws is known to a fifth; fixed parameters add a little.
    assert told == pytest.approx(np.std(energies, ddof=1), rel=0.5)
    assert abs(np.mean(energies) - float(predict(base, motion.take(run)).sum() * 0.5)) < told


def test_what_the_fit_makes_up_for_does_not_count_twice(motion, fitted, known):
    """The torque constant is never fitted: resistance stands for it on drives like the log's."""
    covariance, _ = known
    model = fitted.model
    place = place_of(model, "copper_loss", "torque_constant")
    stated = 0.05 * model.parameters[place]
    alone = abs(slopes_of(model, motion)[place]) * stated
    assert covariance.matrix(model.parameter_names)[place, place] == pytest.approx(stated**2)
    assert deviation(model, motion, covariance) < 0.3 * alone


def test_what_a_log_says_nothing_about_is_known_as_declared(base, tmp_path):
    """Without turning, the yaw inertia keeps the spread of its declaration."""
    robot = VirtualRobot("minibalance", seed=4)
    drive = robot.profile("one_heading", runs=6, rows=100)
    robot.drive(drive, noise=QUIET).write_csv(tmp_path / "log.csv")
    log = measured(Telemetry.read(tmp_path / "log.csv"), base, NOISE, seed=1)
    covariance, _ = energy_error(log, fit(log, base))
    place = place_of(base, "inertia", "yaw_inertia")
    spread = np.sqrt(covariance.matrix(base.parameter_names)[place, place])
    assert spread == pytest.approx(0.15 * base.parameters[place], rel=0.05)


def test_white_noise_is_found_as_it_is(motion, known):
    """σ and the rows' interval, no offset of runs, and a scale near 1."""
    _, error = known
    watts = float(np.mean(np.abs(predict_power(motion))))
    assert np.interp(watts, error.powers_w, error.spreads_w) == pytest.approx(
        NOISE * watts, rel=0.2
    )
    assert error.correlation_time_s == pytest.approx(0.5, rel=0.35)
    run = motion.take(motion.run == 2)
    noise = np.sqrt(error.noise_variance(predict_power(run), run.interval))
    assert noise == pytest.approx(NOISE * watts * 0.5 * np.sqrt(len(run)), rel=0.35)
    assert 0.6 < error.scale < 1.6
    assert error.runs == len(motion.run_names)
    assert error.degrees_of_freedom == PRIOR_RUNS + 0.5 * error.runs


def predict_power(log):
    from tests.telemetry.rows import base_model

    return predict(base_model(), log)


def test_runs_that_differ_widen_the_interval(motion, base):
    """A gain of 3 % that every run draws anew: one run's energy is known to about 3 %."""
    log = measured(motion, base, 0.01, seed=6)
    gains = 0.03 * np.random.default_rng(7).standard_normal(len(log.run_names))
    log = replace(log, power=log.power + predict_power(log) * gains[log.run])
    fitted = fit(log, base)
    _, error = energy_error(log, fitted)
    run = log.run == 4
    watts, seconds = fitted.watts[run], log.interval[run]
    told = error.scale * np.sqrt(error.noise_variance(watts, seconds))
    assert told == pytest.approx(0.03 * float(watts @ seconds), rel=0.5)


def test_one_run_says_little_about_the_next(motion, base):
    """A log of one run leaves wide tails, and no held-out run is claimed."""
    log = measured(motion, base, NOISE, seed=8)
    log = log.take(log.run == 0)
    _, error = energy_error(log, fit(log, base))
    assert error.runs == 0
    assert error.degrees_of_freedom < PRIOR_RUNS + 1.0
    assert error.scale > 0.0


HIDDEN = {
    "viscous_drag": {"viscous_torque": 2e-5},
    "driver_loss": {"diode_voltage": 0.4, "switching_power": 0.2},
    "sinkage": {},
}
"""A few robots of python -m tests.benchmarks.energy_intervals, told what they hide."""


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """Errors over predicted deviation, limits of that, and half widths over the energy."""
    folder = tmp_path_factory.mktemp("drives")
    found = []
    for number, (slug, settings) in enumerate(HIDDEN.items()):
        write_robot(folder / "robot.toml", np.random.default_rng(number))
        robot = VirtualRobot(str(folder / "robot.toml"), hidden={slug: settings}, seed=number)
        noise = Noise(level=(0.01, 0.03, 0.05)[number], autocorrelated=(0.0, 0.5, 0.5)[number])
        whole = robot.drive(robot.profile("rich", runs=32, rows=200), noise=noise)
        parts = []
        for runs in (range(12), range(12, 32)):
            whole.select([f"run{k:02d}" for k in runs]).write_csv(folder / "log.csv")
            parts.append(Telemetry.read(folder / "log.csv"))
        log, later = parts
        start = starting_model(VEHICLE)
        fitted = fit_with(start, log, [Addition.usual(find_effect(slug), start)])
        covariance, error = energy_error(log, fitted)
        for run in np.unique(later.run):
            rows = later.run == run
            one = later.take(rows)
            watts = predict(fitted.model, one)
            parameters = deviation(fitted.model, later, covariance, rows)
            noisy = error.noise_variance(watts, one.interval)
            spread = error.scale * np.hypot(parameters, np.sqrt(noisy))
            limit = stats.t.ppf(0.975, error.degrees_of_freedom)
            miss = (one.power - watts) @ one.interval / spread
            found.append((miss, limit, limit * spread / (watts @ one.interval)))
    return np.array(found)


def test_intervals_hold_on_drives_that_nobody_fitted(drives):
    """60 drives of three robots that are not as their file says: about 57 within 95 %."""
    miss, limit, _ = drives.T
    assert np.mean(np.abs(miss) <= limit) >= 0.88
    # Nor is the interval far too wide.
    assert np.sqrt(np.mean(miss**2)) > 0.5


def test_intervals_are_no_wider_than_they_need_to_be(drives):
    """Drives of 100 s at 1 to 5 % noise are known to a few percent."""
    assert np.median(drives[:, 2]) < 0.03


def test_what_the_log_covers_is_kept_without_its_single_rows(motion, base):
    rows = motion.rows.copy()
    rows[0, INDEX["vx"]] = 50.0
    rows[:, INDEX["payload"]] = np.where(np.arange(len(rows)) % 2, 3.0, 8.0)
    covered = covered_by(replace(motion, rows=rows))
    speeds = np.hypot(rows[1:, INDEX["vx"]], rows[1:, INDEX["vy"]])
    assert 0.9 * speeds.max() < covered.speed_mps <= speeds.max()
    assert covered.payload_kg == 8.0
    level = rows.copy()
    level[:, [INDEX["gravity_x"], INDEX["gravity_y"]]] = 0.0
    assert covered_by(replace(motion, rows=level)).slope_rad == pytest.approx(0.0, abs=1e-12)
