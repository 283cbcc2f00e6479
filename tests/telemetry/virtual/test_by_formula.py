"""Effects that the robot has no equation for act by the catalogue's formula."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.virtual import VirtualRobot, by_formula
from planner.telemetry.virtual.dynamics import BIN, BOOK, MEANS
from planner.telemetry.virtual.hidden import strengths

SLUGS = ("viscous_drag", "vibration", "air_drag", "sinkage", "sensor_rate", "converter_efficiency")
POWER = MEANS.index("power")


@pytest.fixture(scope="module")
def bare():
    """A robot without hidden effects, a profile, and what it does on it."""
    robot = VirtualRobot("minibalance", seed=4)
    drive = robot.profile("rich", runs=3, rows=40)
    return robot, drive, *robot.simulate(drive)


def added(bare, monkeypatch, slug, **given):
    """Means and energies with one effect added by its formula."""
    robot, drive, means, book = bare
    settings = VirtualRobot("minibalance", hidden={slug: given}).hidden
    means, book = means.copy(), book.copy()
    with monkeypatch.context() as patch:
        patch.setattr(by_formula, "EQUATIONS", frozenset())
        by_formula.add_by_formula(robot.vehicle, settings, drive, means, book)
    return means, book, settings


@pytest.mark.parametrize("slug", SLUGS)
def test_the_formula_adds_what_an_equation_of_motion_does(bare, monkeypatch, slug):
    robot, drive, means, _ = bare
    by_itself, _, settings = added(bare, monkeypatch, slug)
    moved, _ = robot.simulate(drive, settings)
    change, expected = (m[:, :, POWER] - means[:, :, POWER] for m in (by_itself, moved))
    assert change.mean() == pytest.approx(expected.mean(), rel=0.12)
    apart = np.sqrt(np.mean((change - expected) ** 2) / np.mean(expected**2))
    assert apart < 0.25


def test_surfaces_are_told_apart_by_name(bare, monkeypatch):
    _, drive, means, _ = bare
    excess = {"carpet": 0.5}
    by_itself, _, _ = added(bare, monkeypatch, "surface_rolling", excess=excess)
    change = by_itself[:, :, POWER] - means[:, :, POWER]
    carpet = drive.conditions[:, :, 4] == drive.surfaces.index("carpet")
    moving = np.hypot(means[:, :, 0], means[:, :, 1]) > 0.05
    assert np.all(change[carpet & moving] > 0.0)
    assert np.all(change[~carpet] == 0.0)


def test_each_wheel_has_its_own_strength(bare, monkeypatch):
    robot, drive, means, _ = bare
    uneven = [0.4, -0.4, 0.0, 0.0]
    by_itself, _, settings = added(bare, monkeypatch, "wheel_imbalance", excess=uneven)
    moved, _ = robot.simulate(drive, settings)
    change, expected = (m[:, :, POWER] - means[:, :, POWER] for m in (by_itself, moved))
    assert np.corrcoef(change.ravel(), expected.ravel())[0, 1] > 0.9


def test_the_energy_account_still_adds_up(bare, monkeypatch):
    _, _, means, before = bare
    by_itself, book, _ = added(bare, monkeypatch, "vibration")
    change = (by_itself[:, :, POWER] - means[:, :, POWER]).sum(axis=1) * BIN
    supply, body = BOOK.index("supply"), BOOK.index("body")
    np.testing.assert_allclose(book[:, supply] - before[:, supply], change, rtol=1e-9)
    np.testing.assert_allclose(book[:, body] - before[:, body], change, rtol=1e-9)
    np.testing.assert_allclose(book[:, 1:14].sum(axis=1), book[:, supply], rtol=1e-9)


def test_equations_of_motion_come_first(bare):
    robot, drive, means, book = bare
    settings = VirtualRobot("minibalance", hidden={"vibration": {}}).hidden
    untouched = means.copy()
    by_formula.add_by_formula(robot.vehicle, settings, drive, means, book)
    np.testing.assert_array_equal(means, untouched)
    assert strengths(settings, 4, drive.surfaces).shaking_force > 0.0
