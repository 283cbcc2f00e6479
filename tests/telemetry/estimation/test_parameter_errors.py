"""Standard errors where the slope is not to be trusted: bends, bounds, few rows, mixed units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX
from planner.telemetry.estimation.gauss_newton import problem_of
from planner.telemetry.estimation.model_fit import fit
from planner.telemetry.estimation.parameter_errors import (
    INTERVAL_Z,
    RUN_ERRORS,
    end_of_interval,
    run_errors,
    without_each,
)
from planner.telemetry.other_terms import given_columns
from planner.telemetry.prediction import Nodes, predict
from planner.telemetry.terms import Addition, fit_with
from tests.power.states import changed
from tests.telemetry.rows import measured, plain_log

STDERR = 0.2


def test_where_the_fit_worsens_in_a_straight_line_the_interval_stays():
    asked = []

    def rise(step, others):
        asked.append(others)
        return abs(step) / STDERR

    for room in (-5.0, 5.0):
        end = end_of_interval(rise, STDERR, room)
        assert end == pytest.approx(np.copysign(INTERVAL_Z * STDERR, room))
    assert not any(asked), "fits of the others were not needed"


@pytest.mark.parametrize("room", [-50.0, 50.0])
@pytest.mark.parametrize("power", [0.5, 0.7, 1.5])
def test_along_a_bend_it_ends_where_the_fit_is_as_much_worse(room, power):
    def rise(step, others):
        risen = (abs(step) / (INTERVAL_Z * STDERR)) ** power * INTERVAL_Z * 0.6
        return risen if others else 3.0 * risen

    end = end_of_interval(rise, STDERR, room)
    assert np.sign(end) == np.sign(room)
    assert rise(end, True) == pytest.approx(INTERVAL_Z, rel=0.1)


def test_it_ends_at_the_bound_at_last():
    def rise(step, others):
        return 0.1

    assert end_of_interval(rise, STDERR, -1.0) == -1.0
    assert end_of_interval(rise, STDERR, 0.1) == 0.1


def test_it_is_not_made_shorter():
    def rise(step, others):
        return 5.0 * abs(step) / STDERR

    assert end_of_interval(rise, STDERR, 9.0) == pytest.approx(INTERVAL_Z * STDERR)


@pytest.fixture(scope="module")
def bent(motion, base):
    """A log of a robot whose idle gears drag, and the effect to be fitted with its shape."""
    slug = "light_load_gear_drag"
    declared = load_vehicle("minibalance")
    robot = PowerModel.from_vehicle(declared, effects=(slug,))
    robot = changed(
        robot, light_load_gear_drag__drag_torque=0.09, light_load_gear_drag__fading_torque=0.3
    )
    log = measured(motion, robot, 0.02, seed=3)
    return log, Addition(slug, {("drag_torque", 0): 0.05, ("fading_torque", 0): 0.2})


def test_an_end_of_an_interval_fits_worse_by_as_much_as_it_should(bent, base):
    log, addition = bent
    exact = np.empty((len(log), 0))
    plain, tried = (fit_with(base, log, [addition], unsure=how) for how in (None, exact))
    slots = [(slot[0].slug, slot[1]) for slot in tried.model.slots]
    place = slots.index(("light_load_gear_drag", "drag_torque"))
    number = tried.places.index(place)
    assert tried.model.parameters[place] == plain.model.parameters[place]
    ratio = tried.model.stderr[place] / plain.model.stderr[place]
    assert ratio > 1.1, "size and shape of this drag trade against each other"
    stated = next(p for p in tried.parameters if p.name == "drag_torque")
    assert stated.stderr == tried.model.stderr[place]

    nodes = Nodes.of(log, tried.model)
    problem = problem_of(log, nodes, tried.model, tried.places)
    lowest = problem.cost_of(tried.model, tried.watts, tried.noise, tried.spread)
    value = tried.model.parameters[place]
    rises = []
    for side in (-1.0, 1.0):
        for stderr in (plain.model.stderr[place], tried.model.stderr[place]):
            held = problem.holding(number, value + side * INTERVAL_Z * stderr)
            end = held.solve(
                held.at(tried.model, tried.model.parameters[list(tried.places)]),
                tried.noise,
                tried.spread,
            )
            watts = predict(end.model, nodes)
            rises.append(problem.cost_of(end.model, watts, tried.noise, tried.spread) - lowest)
    # Rows scatter by more than the whitening says, which the slope's word allows for.
    expected = (
        INTERVAL_Z**2 * plain.covariance[number, number] / _told(problem, plain)[number, number]
    )
    near_low, far_low, near_high, far_high = np.array(rises) / expected
    assert min(near_low, near_high) < 0.6, "the slope's word was too sure of itself"
    assert min(far_low, far_high) > 0.7


def _told(problem, found):
    """(p, p) covariance if rows scattered just as the noise says."""
    columns = problem.at(found.model, found.model.parameters[list(found.places)]).columns
    white = found.noise.whiten(problem.log, found.watts, found.spread, columns)
    return np.linalg.inv(white.T @ white + problem.prior.precision)


def test_what_is_not_told_apart_is_not_sure_beside_units_of_another_size(base):
    # Always under way: what the bridges draw while they drive and what the electronics draw is one
    # number. Viscous drag counts in millionths, which once hid that from the inverse.
    log = plain_log([60] * 10)
    rows, random = log.rows.copy(), np.random.default_rng(6)
    for name, largest in (("vx", 0.8), ("vy", 0.8), ("wz", 0.8)):
        low = 0.2 if name == "vx" else -largest
        rows[:, INDEX[name]] = random.uniform(low, largest, len(log))
    rows[:, INDEX["gravity_x"]] = random.uniform(-1.0, 1.0, len(log))
    vehicle = load_vehicle("minibalance")
    robot = PowerModel.from_vehicle(vehicle, effects=("driver_loss", "viscous_drag"))
    robot = changed(
        robot,
        driver_loss__diode_voltage=0.4,
        driver_loss__switching_power=0.2,
        viscous_drag__viscous_torque=3e-6,
    )
    found = fit(measured(replace(log, rows=rows), robot, 0.01, seed=4), robot)
    fitted = {f"{p.effect}.{p.name}": p for p in found.parameters}
    # Neither is better known than before: ten of the declared spreads.
    switching = fitted["driver_loss.switching_power"]
    assert not switching.identifiable
    assert switching.stderr == pytest.approx(10.0 * 0.5 * 0.15, rel=0.1)
    assert fitted["electronics.power"].stderr == pytest.approx(4.0 * switching.stderr, rel=0.1)
    together = np.zeros(len(found.places))
    for number, place in enumerate(found.places):
        _, name, _, _ = found.model.slots[place]
        together[number] = {"power": 1.0, "switching_power": 4.0}.get(name, 0.0)
    assert np.sqrt(together @ found.covariance @ together) < 0.1, "their sum is known"


def test_leaving_a_block_out_changes_what_fitting_without_it_changes():
    # The last block tells most of the second column: the sums of its scores would say little.
    random = np.random.default_rng(11)
    number = np.repeat(np.arange(8), 25)
    columns = random.standard_normal((200, 3)) * [1.0, 1e-4, 1e5]
    columns[number < 7, 1] *= 0.02
    target = columns @ [2.0, -3e3, 1e-5] + random.standard_normal(200)
    prior = np.diag([1e-3, 1e-8, 1e-3])

    def solution(rows):
        return np.linalg.solve(
            columns[rows].T @ columns[rows] + prior, columns[rows].T @ target[rows]
        )

    best = solution(slice(None))
    scores = columns * (target - columns @ best)[:, None]
    found = without_each(columns.T @ columns + prior, columns, scores, number)
    for block, change in enumerate(found):
        expected = solution(number != block) - best
        assert change == pytest.approx(expected, rel=1e-5)


def test_what_is_weighed_once_a_run_makes_less_sure(motion, base):
    log = measured(motion, base, 0.002, seed=9)
    assert {"payload", "com_x"} <= log.present
    sure = fit(replace(log, present=log.present - set(RUN_ERRORS)), base)
    unsure = fit(log, base)
    np.testing.assert_array_equal(sure.model.parameters, unsure.model.parameters)
    more = np.diag(unsure.covariance) - np.diag(sure.covariance)
    assert np.all(more >= 0.0)
    rolling = next(k for k, p in enumerate(sure.parameters) if p.name == "rolling")
    assert more[rolling] > 0.0


def test_an_error_of_the_load_is_that_much_more_load(motion, base):
    nodes = Nodes.of(motion, base)
    column = run_errors(base, nodes, predict(base, nodes), {"payload", "ambient_temp"})
    assert column.shape == (len(motion), 1)  # nothing in the base model reads the air's temperature
    heavier = motion.rows.copy()
    heavier[:, INDEX["payload"]] += RUN_ERRORS["payload"]
    change = predict(base, replace(motion, rows=heavier)) - predict(base, motion)
    assert column[:, 0] == pytest.approx(change, abs=1e-12)


def test_a_wrong_mass_is_in_the_standard_errors(motion, base):
    """A robot 5 % heavier than its data sheet says: friction that grows with the load takes it."""
    heavier = replace(base, vehicle=replace(base.vehicle, mass=1.05 * base.vehicle.mass))
    log = measured(motion, heavier, 0.01, seed=4)
    place = base.parameter_names.index(("wheel_rolling", "rolling", 0))
    off = []
    for unsure in (None, given_columns(log, base, predict(base, log))):
        found = fit(log, base, unsure=unsure).model
        assert found.stderr is not None
        off.append(abs(found.parameters[place] - base.parameters[place]) / found.stderr[place])
    assert off[0] > 3.0
    assert off[1] < INTERVAL_Z
