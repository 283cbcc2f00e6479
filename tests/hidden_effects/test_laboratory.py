"""The laboratory: its instruments alone change the log, by what they say, and draws are apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.power.vehicles import load_vehicle
from planner.telemetry.logs import Telemetry
from planner.telemetry.virtual import VirtualRobot
from planner.telemetry.virtual.dynamics import MEANS
from tests.hidden_effects.laboratory import MECHANISMS, SPLITS, Instruments, Meter, draw
from tests.hidden_effects.laboratory.drives import Conditions, drawn_drive
from tests.hidden_effects.laboratory.instruments import filtered, held_times, sampled

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


@pytest.mark.parametrize("name", MECHANISMS)
def test_mechanisms_have_their_size(name: str, tmp_path: Path) -> None:
    log = draw("outside", name, 1, "tuning", tmp_path)
    assert 0.015 < log.truth.sizes[name] < 0.13
