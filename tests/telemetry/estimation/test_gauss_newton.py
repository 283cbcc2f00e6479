"""The bounded step: the least of a quadratic form between bounds. Steps at a kink of the power."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.telemetry.estimation.gauss_newton import (
    Problem,
    Solution,
    bounded_step,
    with_values,
)
from planner.telemetry.noise import Noise
from planner.telemetry.parameters import Prior
from planner.telemetry.prediction import Nodes
from planner.telemetry.starting_model import starting_model
from tests.telemetry.rows import plain_log


def problem(seed: int, size: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """A positive definite form, on scales as different as those of parameters, and a score."""
    random = np.random.default_rng(seed)
    scale = 10.0 ** random.uniform(-3.0, 3.0, size)
    design = random.standard_normal((40, size)) * scale
    return design.T @ design, design.T @ random.standard_normal(40)


@pytest.mark.parametrize("seed", range(5))
def test_without_bounds_it_is_the_newton_step(seed: int) -> None:
    full, right = problem(seed)
    wide = np.full(5, np.inf)
    step = bounded_step(full, right, -wide, wide)
    assert step == pytest.approx(np.linalg.solve(full, right), rel=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_between_bounds_no_direction_leads_further_down(seed: int) -> None:
    full, right = problem(seed)
    free = np.abs(np.linalg.solve(full, right))
    low, high = -0.3 * free, 0.6 * free
    step = bounded_step(full, right, low, high)
    # The scale of each parameter is divided out and put back: bounds hold to rounding.
    assert (low - 1e-12 * free <= step).all()
    assert (step <= high + 1e-12 * free).all()
    # Karush, Kuhn and Tucker: the slope is nil inside and points outwards at a bound.
    slope = (full @ step - right) / np.sqrt(np.diag(full))
    at_low, at_high = np.isclose(step, low), np.isclose(step, high)
    assert (at_low | at_high).any()
    assert slope[~at_low & ~at_high] == pytest.approx(0.0, abs=1e-6)
    assert (slope[at_low] >= -1e-6).all()
    assert (slope[at_high] <= 1e-6).all()


def test_what_is_held_takes_its_step_and_the_others_follow() -> None:
    full, right = problem(7)
    low, high = np.full(5, -np.inf), np.full(5, np.inf)
    low[2] = high[2] = 0.25
    step = bounded_step(full, right, low, high)
    assert step[2] == 0.25
    others = [0, 1, 3, 4]
    rest = right[others] - full[others, 2] * 0.25
    expected = np.linalg.solve(full[np.ix_(others, others)], rest)
    assert step[others] == pytest.approx(expected, rel=1e-6)
    assert bounded_step(full, right, step, step) == pytest.approx(step)


class Kinked(Problem):
    """Power |v| of one parameter v."""

    asked = 0

    def at(self, model, value):
        """Counts how often it is asked."""
        Kinked.asked += 1
        rows = np.ones(len(self.log))
        slope = rows if value[0] >= 0.0 else -rows
        return Solution(with_values(model, self.index, value), np.abs(value) * rows, slope[:, None])

    def predicted(self, model):
        """(n,) W."""
        return np.abs(model.parameters[self.index]) * np.ones(len(self.log))


class Ending(Problem):
    """Power v of one parameter v, which has no value beyond 2."""

    def at(self, model, value):
        """The power and its slope."""
        rows = np.where(value[0] <= 2.0, 1.0, np.nan) * np.ones(len(self.log))
        return Solution(with_values(model, self.index, value), value * rows, rows[:, None])

    def predicted(self, model):
        """(n,) W."""
        return self.at(model, model.parameters[self.index]).watts


@pytest.mark.parametrize("begin", [1.0, 0.7, -3.0])
def test_steps_end_in_a_kink_that_no_part_of_one_leads_out_of(begin: float) -> None:
    """A power that cannot be below zero is as near as can be to one that is, where it is zero."""
    Kinked.asked = 0
    found = solved(Kinked, begin, -0.5)
    assert abs(found.model.parameters[0]) <= 0.03
    # Full steps jump from one side to the other, for as long as they are let. Parts of a step need
    # no derivatives before one of them gains something.
    assert Kinked.asked <= 10


@pytest.mark.parametrize("begin", [1.0, 0.7, -3.0])
def test_steps_stay_where_the_power_has_a_value(begin: float) -> None:
    found = solved(Ending, begin, 5.0)
    assert np.all(np.isfinite(found.watts))
    assert begin < found.model.parameters[0] <= 2.0


def solved(kind: type[Problem], begin: float, power_w: float) -> Solution:
    """Where the steps of a problem of one parameter end that is asked for a constant power."""
    log = plain_log([30, 30])
    log = replace(log, power=np.full(len(log), power_w))
    noise = Noise(np.zeros(1), np.ones(1), np.zeros((1, 1)), np.ones(1), np.zeros((2, 2)), 1.0)
    prior = Prior(np.full(1, 1e-6), np.zeros((1, 1)), np.full(1, -10.0), np.full(1, 10.0))
    model, index = starting_model("minibalance"), np.array([0])
    problem = kind(log, Nodes.of(log, model), index, np.array([begin]), prior)
    return problem.solve(problem.at(model, np.array([begin])), noise, np.ones(len(log)))
