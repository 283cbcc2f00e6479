"""What is derived from the columns of a log, within runs only."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import (
    column,
    kinds,
    table,
    written,
)


def test_acceleration_on_a_circle_points_to_its_centre(tmp_path: Path) -> None:
    # 0.8 m/s forward at 0.5 rad/s: v·ω = 0.4 m/s² to the left, nothing forward.
    columns = table() | {"vx": np.full(60, 0.8), "vy": np.zeros(60), "wz": np.full(60, 0.5)}
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(column(log, "ay"), 0.4)
    assert np.allclose(column(log, "ax"), 0.0, atol=1e-12)


def test_derivatives_are_exact_for_parabolas_on_uneven_times_and_stay_within_runs(
    tmp_path: Path,
) -> None:
    t = np.cumsum(np.tile([0.1, 0.2, 0.15], 20))
    t = np.concatenate([t[:30], t[:30]])
    sign = np.repeat([1.0, -1.0], 30)
    columns = table() | {
        "time": t,
        "vx": sign * t * t,
        "vy": np.zeros(60),
        "wz": np.zeros(60),
    }
    log = Telemetry.read(written(tmp_path, columns))
    inner = np.r_[1:29, 31:59]
    assert np.allclose(column(log, "ax")[inner], (sign * 2.0 * t)[inner])
    # One-sided at the ends of a run: slope of the chord, not the jump to the other run.
    assert column(log, "ax")[30] == pytest.approx(-(t[31] + t[30]))
    assert column(log, "ax")[29] == pytest.approx(t[29] + t[28])


def test_gravity_of_a_log_follows_rep_103(tmp_path: Path) -> None:
    columns = table() | {"pitch": np.full(60, 0.3), "roll": np.full(60, -0.2)}
    log = Telemetry.read(written(tmp_path, columns))
    g = STANDARD_GRAVITY
    # Nose down: gravity pulls forward. Left side down (roll < 0): gravity pulls to the left.
    assert column(log, "gravity_x")[5] == pytest.approx(g * math.sin(0.3))
    assert column(log, "gravity_y")[5] == pytest.approx(g * math.cos(0.3) * math.sin(0.2))
    assert column(log, "gravity_normal")[5] == pytest.approx(g * math.cos(0.3) * math.cos(0.2))
    assert not any("flat" in sentence for sentence in log.assumed)


def test_slope_rate_is_the_pitch_rate_on_a_rising_ramp(tmp_path: Path) -> None:
    columns = table(runs=1)
    columns |= {"pitch": -0.1 * columns["time"] / 6.0}
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(column(log, "slope_rate"), 0.1 / 6.0)


def test_odometer_runs_on_and_time_starts_anew_with_a_run(tmp_path: Path) -> None:
    columns = table() | {"vx": np.full(60, 0.3), "vy": np.full(60, 0.4), "wz": np.zeros(60)}
    log = Telemetry.read(written(tmp_path, columns))
    assert column(log, "odometer")[-1] == pytest.approx(60 * 0.05)
    assert column(log, "time_since_start")[[0, 29, 30, 59]] == pytest.approx([0.1, 3.0, 0.1, 3.0])


def test_power_from_voltage_and_current(tmp_path: Path) -> None:
    columns = table()
    columns["battery_voltage"] = np.full(60, 24.0)
    columns["battery_current"] = columns.pop("power") / 24.0
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(log.power, table()["power"])
    assert any(s.startswith("power: battery_voltage") for s in log.derived)
    assert ("unknown", "power") not in kinds(log)


def test_unknown_quantities_stay_unknown_and_labels_are_kept(tmp_path: Path) -> None:
    columns = table() | {
        "surface": ["gravel"] * 20 + ["brown"] * 40,
        "motor_temp": [""] * 10 + list(np.linspace(20.0, 40.0, 50)),
        "wheel_current_1": np.linspace(0.0, 1.0, 60),
        "wheel_current_3": np.linspace(1.0, 2.0, 60),
    }
    log = Telemetry.read(written(tmp_path, columns))
    assert np.isnan(column(log, "motor_temp")[:10]).all()
    assert ("unknown", "motor_temp") in kinds(log)
    assert log.surfaces == ("gravel", "brown")
    assert {"wheel_current_1", "wheel_current_3"} <= log.present
    renumbered = log.rows_for(["brown", "sand"])[:, INDEX["surface"]]
    assert np.array_equal(renumbered, np.repeat([-1.0, 0.0], [20, 40]))
