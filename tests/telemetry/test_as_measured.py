"""Arrival times and held speeds are undone; uneven rows and set-points stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.as_measured import as_measured
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import LogSource, open_source
from tests.telemetry.sampling.test_even_clock import bunched

RUNS, ROWS, ROW = 6, 500, 0.05
HELD = 4


@pytest.fixture(scope="module")
def table(robot):
    """Rows of 50 ms of a drive that swings, with 2 % of noise of the power."""
    random = np.random.default_rng(8)
    time = np.round(ROW * np.arange(1.0, ROWS + 1.0), 6)

    def wave(size: float) -> np.ndarray:
        periods, phases = random.uniform(3.0, 15.0, (RUNS, 4)), random.uniform(0.0, 6.3, (RUNS, 4))
        waves = np.sin(2.0 * np.pi * time[:, None, None] / periods + phases).mean(axis=2)
        return size * waves.T.ravel()

    drive = pd.DataFrame({"run": np.repeat(np.arange(RUNS), ROWS), "time": np.tile(time, RUNS)})
    drive = drive.assign(vx=wave(0.8), vy=wave(0.5), wz=wave(0.5), power=0.0)
    watts = predict(robot, Telemetry.read(drive))
    return drive.assign(power=watts * (1.0 + 0.02 * random.standard_normal(len(drive))))


def test_arrival_times_are_undone(table, base):
    arrival = table.groupby("run")["time"].transform(lambda t: bunched(t.to_numpy(), 1))
    late = open_source(table.assign(time=np.round(arrival, 6)))
    found = as_measured(late, base)
    assert found.even
    assert any(finding.kind == "arrival times" for finding in found.sample.report)
    true, column = Telemetry.read(table), INDEX["ax"]
    wrong = np.abs(late.sample.rows[:, column] - true.rows[:, column])
    assert np.abs(found.sample.rows[:, column] - true.rows[:, column]).mean() < 0.05 * wrong.mean()
    streamed = replace(found, complete=False)
    rows = np.concatenate([chunk.rows for chunk in streamed.chunks()])
    assert np.allclose(rows, found.sample.rows, equal_nan=True)
    assert found.content != late.content


@pytest.mark.parametrize(("unit", "found"), [(1.0, set()), (STANDARD_GRAVITY, {"unit", "derived"})])
def test_bunches_are_no_gaps_and_no_other_unit(table, base, unit, found):
    arrival = table.groupby("run")["time"].transform(lambda t: bunched(t.to_numpy(), 1))
    lengthwise = Telemetry.read(table).rows[:, INDEX["ax"]]
    columns = table.assign(time=np.round(arrival, 6), ax=lengthwise / unit)
    late = open_source(columns)
    assert "unit" not in {finding.kind for finding in late.sample.report}
    kinds = {finding.kind for finding in as_measured(late, base).sample.report}
    assert kinds == found | {"arrival times"}


def test_gaps_that_stay_on_the_even_clock_are_found(table, base):
    arrival = table.groupby("run")["time"].transform(lambda t: bunched(t.to_numpy(), 1))
    lost = table.assign(time=np.round(arrival, 6)).drop(index=range(200, 230))
    found = as_measured(open_source(lost), base)
    assert [finding.rows for finding in found.sample.report if finding.kind == "gap"] == [1]


def test_an_even_log_stays(table, base):
    source = open_source(table)
    assert as_measured(source, base) is source


@pytest.mark.parametrize(("unit", "found"), [(1.0, set()), (STANDARD_GRAVITY, {"unit"})])
def test_rows_that_were_measured_unevenly_stay(table, base, unit, found):
    kept = np.sort(np.random.default_rng(3).choice(len(table), 7 * len(table) // 10, replace=False))
    columns = table.assign(ax=Telemetry.read(table).rows[:, INDEX["ax"]] / unit)
    source = open_source(columns.iloc[kept])
    stays = as_measured(source, base)
    assert not stays.even
    assert stays.sample.time is source.sample.time
    assert {finding.kind for finding in stays.sample.report} & {"unit"} == found


def held(table, rows):
    """The table with speeds that a recorder repeats until the next ones come."""
    first = np.arange(len(table)) // rows * rows
    speeds = {name: table[name].to_numpy()[first] for name in ("vx", "vy", "wz")}
    return table.assign(**speeds)


def test_held_speeds_are_taken_between_their_updates(table, base, monkeypatch):
    # The last run is a chunk with too few updates to see by itself that they are held.
    table = table.iloc[: 5 * ROWS + 70]
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", ROWS)
    late = open_source(held(table, HELD))
    found = as_measured(late, base)
    assert found.holds == (HELD, 0.0)
    assert "held" in {finding.kind for finding in found.sample.report}
    true, column = Telemetry.read(table), INDEX["ax"]
    wrong = np.abs(late.sample.rows[:, column] - true.rows[:, column])
    assert np.abs(found.sample.rows[:, column] - true.rows[:, column]).mean() < 0.2 * wrong.mean()
    streamed = replace(found, complete=False)
    chunks = [chunk.rows for chunk in streamed.chunks()]
    assert len(chunks) > 4
    assert np.allclose(np.concatenate(chunks), found.sample.rows, equal_nan=True)
    assert found.content != late.content


def test_speeds_that_do_step_stay(table, base, robot):
    steps = held(table, HELD)
    watts = predict(robot, Telemetry.read(steps))
    source = open_source(steps.assign(power=watts))
    assert source.between_updates() is not None
    assert as_measured(source, base) is source


@pytest.fixture(scope="module")
def felt(table):
    """The table as an accurate accelerometer adds to it."""
    rows = Telemetry.read(table).rows
    return table.assign(ax=rows[:, INDEX["ax"]], ay=rows[:, INDEX["ay"]])


@pytest.mark.parametrize("axes", [("ax", "ay"), ("ay",)])
def test_changes_of_speed_take_the_place_of_a_poor_accelerometer(felt, base, monkeypatch, axes):
    monkeypatch.setattr(LogSource, "CHUNK_ROWS", ROWS)
    random = np.random.default_rng(4)
    poor = {name: felt[name] + random.normal(0.15, 0.3, len(felt)) for name in axes}
    log = open_source(felt.drop(columns=["ax", "ay"]).assign(**poor))
    found = as_measured(log, base)
    assert found.derived
    said = [one.sentence for one in found.sample.report if one.kind == "derived"]
    assert len(said) == 1
    assert said[0].startswith(f"{', '.join(axes)}: ")
    plain = Telemetry.read(felt.drop(columns=["ax", "ay"]))
    assert found.sample.present == plain.present
    assert sorted(found.describe()["derived"]) == sorted(plain.derived)
    assert np.allclose(found.sample.rows, plain.rows, equal_nan=True)
    chunks = [chunk.rows for chunk in replace(found, complete=False).chunks()]
    assert len(chunks) > 4
    assert np.allclose(np.concatenate(chunks), plain.rows, equal_nan=True)
    assert replace(log, derived=True).content != log.content


def test_runs_of_other_rates_and_gaps_are_derived_as_they_are_read(felt):
    """A log of 20 and 2 Hz with a gap, as if nobody had measured accelerations."""
    slow = felt[felt["run"] == 0].iloc[::10].assign(run=RUNS)
    mixed = pd.concat([felt.drop(index=range(600, 640)), slow])
    plain = Telemetry.read(mixed.drop(columns=["ax", "ay"]))
    derived = Telemetry.read(mixed.assign(ax=9.0)).without_accelerometer()
    assert np.allclose(derived.rows, plain.rows, equal_nan=True)
    assert np.ptp(derived.rows[-len(slow) :, INDEX["ax"]]) > 0.1


def test_a_good_accelerometer_stays_beside_noisy_speeds(felt, base):
    random = np.random.default_rng(5)
    speeds = {
        name: felt[name] + 0.004 * random.standard_normal(len(felt)) for name in ("vx", "vy", "wz")
    }
    for log in (felt, felt.assign(**speeds)):
        source = open_source(log)
        assert as_measured(source, base) is source
