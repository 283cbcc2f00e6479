"""Explanations fitted in full: what a log gains by an explanation, and what it must not gain."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.model import rows_from
from planner.telemetry.candidates import candidate_library
from planner.telemetry.contest import _Entry, _row_likelihood, _sizes, _ties
from planner.telemetry.examine import Competitors, examine
from planner.telemetry.fit import fit
from planner.telemetry.sensors import SENSORS
from planner.telemetry.shapes import shapes_of
from planner.telemetry.subsets import Member, Rival
from tests.telemetry.rows import STEP, measured, plain_log

NOISE = 0.03


@pytest.fixture(scope="module")
def examined(base):
    """Steady drives of a robot that is as its model says, fitted and summed up."""
    angle = np.repeat(np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False), 50)
    speed = np.repeat(np.tile([0.3, 0.6, 0.9], 4), 50)
    rows = rows_from(vx=speed * np.cos(angle), vy=speed * np.sin(angle))
    log = measured(plain_log([50] * 12, rows), base, NOISE, seed=4)
    fitted = fit(log, base)
    library = candidate_library(fitted.model, log)
    return log, fitted, examine(log, Competitors(library, shapes_of(log), SENSORS))


@pytest.mark.parametrize("rows", [0.5, 0.2])
def test_noise_that_averages_out_between_two_rows_speaks_for_no_delay(examined, rows):
    """Half a row's delay mixes neighbours, whose noise is smaller in the mean: no less error."""
    log, fitted, examination = examined
    number = [s.kind for s in SENSORS].index("power_delay")
    column = examination.competitors.sensor(number)
    delay = Member("power_delay", (column,), sensor=True, atom=None, scanned=False)
    nothing, _ = _row_likelihood(log, fitted, examination, Rival((), (), 0.0, 0.0))
    late = Rival((delay,), (np.array([rows * STEP]),), 0.0, 0.0)
    found, _ = _row_likelihood(log, fitted, examination, late)
    assert found.sum() < nothing.sum() + 3.0


def entry(names: str, by_block) -> _Entry:
    gains = np.asarray(by_block, float)
    return _Entry(Rival((), (), 0.0, 0.0), frozenset(names), float(gains.sum()), gains)


def test_what_explains_as_much_is_a_tie_and_what_trails_in_every_block_is_none():
    even = entry("ab", [10.0] * 20)
    other = entry("ac", 10.0 + np.tile([3.0, -3.0], 10))
    behind = entry("ad", [9.0] * 20)
    assert _ties(even, [even, other, behind]) == {"a": (), "b": ("c",)}


def test_size_of_a_member_is_what_the_others_lack_without_it():
    """Gain G over n rows is that of a column of ρ: G = n·ρ²/2."""
    both, alone = entry("ab", [10.0] * 20), entry("a", [5.0] * 20)
    assert _sizes(both, [both, alone], 5000) == {"b": pytest.approx(np.sqrt(2.0 * 100.0 / 5000))}
