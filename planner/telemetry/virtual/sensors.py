"""From what happens to what is logged: means over rows, noise, and sensors that are wrong.

    power row    mean over the interval that ends at time - delay
    noise        level·max(|P|, floor)·(√(1 - a)·white + √a·AR(1)) + offset of the run + outliers
    slope        pitch + slope_offset, roll + roll_offset
    velocity     (vx, vy) scaled by speed_scale and turned by heading_misalignment
    power        power_scale·P + power_offset

Every input channel also carries a small error of its own (``CHANNEL_ERRORS``), white by row or
constant in a run, as its sensor would have it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array, Mask
from planner.errors import InputError
from planner.telemetry.virtual.dynamics import BIN, MEANS, by_name
from planner.telemetry.virtual.profiles import Profile

Columns = dict[str, NDArray[np.generic]]

# Standard deviations in the column's unit; True = one error a run, False = one a row.
CHANNEL_ERRORS: dict[str, tuple[float, bool]] = {
    **dict.fromkeys(("vx", "vy"), (0.002, False)),
    "wz": (0.003, False),
    **dict.fromkeys(("roll", "pitch"), (0.001, False)),
    **dict.fromkeys(("ax", "ay"), (0.01, False)),
    "payload": (0.02, True),
    **dict.fromkeys(("com_x", "com_y"), (0.001, True)),
    "motor_temp": (0.5, False),
    "ambient_temp": (0.3, True),
    "battery_voltage": (0.01, False),
    "battery_current": (0.005, False),
    **dict.fromkeys(("wind_x", "wind_y"), (0.05, False)),
}
_WHEEL_CURRENT_ERROR = 0.005  # A
_ORDER = ["run", "time", "vx", "vy", "wz", "power", "roll", "pitch", "ax", "ay", "payload"]
_ORDER += ["com_x", "com_y", "motor_temp", "ambient_temp", "battery_voltage", "battery_current"]
_ORDER += ["surface", "wind_x", "wind_y", "sensor_rate"]


@dataclass(frozen=True)
class Noise:
    """Scatter of the power column and of the inputs.

    Attributes:
        level: standard deviation as a share of |power|.
        autocorrelated: share of that variance that follows an AR(1) process.
        correlation: of neighbouring rows of that process.
        floor: |power| counts at least as this share of its mean over the log.
        run_offset: standard deviation of one offset a run, as a share of mean power.
        outliers: share of rows with an error of 6 to 20 standard deviations.
        channels: multiplies ``CHANNEL_ERRORS``; 0 gives exact inputs.
    """

    level: float = 0.02
    autocorrelated: float = 0.5
    correlation: float = 0.7
    floor: float = 0.3
    run_offset: float = 0.0
    outliers: float = 0.0
    channels: float = 1.0


QUIET = Noise(level=0.0, channels=0.0)


@dataclass(frozen=True)
class Sensors:
    """What is wrong with the sensors; the defaults are right ones.

    Attributes:
        slope_offset: rad added to pitch.
        roll_offset: rad added to roll.
        speed_scale: factor on vx and vy.
        heading_misalignment: rad by which the logged velocity and acceleration are turned.
        delay: s by which power lags the motion in the same row.
        power_scale: factor on power and battery_current.
        power_offset: W added to power.
        dropouts: share of rows that are missing.
        absent: columns that the log does not have.
    """

    slope_offset: float = 0.0
    roll_offset: float = 0.0
    speed_scale: float = 1.0
    heading_misalignment: float = 0.0
    delay: float = 0.0
    power_scale: float = 1.0
    power_offset: float = 0.0
    dropouts: float = 0.0
    absent: tuple[str, ...] = ()


def rows_of(means: Array, row: float, length: float = BIN) -> Array:
    """Means over rows of (runs, bins of ``length`` s, k), shape (runs, rows, k)."""
    each = round(row / length)
    runs, bins, k = means.shape
    return np.asarray(
        means[:, : bins // each * each].reshape(runs, bins // each, each, k).mean(axis=2)
    )


def delayed_power(power: Array, row: float, delay: float, length: float = BIN) -> Array:
    """Mean power of rows that end ``delay`` s before their time, from bins of ``length`` s,
    shape (runs, bins).

    Before the start, and for a negative delay after the end, power stays what it is there.
    """
    if delay == 0.0:
        return rows_of(power[:, :, None], row, length)[:, :, 0]
    runs, bins = power.shape
    pad = int(abs(delay) / length) + 2
    long = np.pad(power, ((0, 0), (pad, pad)), mode="edge")
    times = (np.arange(long.shape[1] + 1) - pad) * length
    count = bins // round(row / length)
    edges = np.arange(count + 1) * row - delay
    result = np.empty((runs, count))
    for k in range(runs):
        energy = np.concatenate([[0.0], np.cumsum(long[k]) * length])
        result[k] = np.diff(np.interp(edges, times, energy)) / row
    return result


def exact_columns(drive: Profile, means: Array) -> Columns:
    """The log of perfect sensors, one row after the other, columns in their order."""
    rows = rows_of(means, drive.row, drive.bin_length)
    runs, count, width = rows.shape
    values = by_name(rows, rows_of(drive.conditions, drive.row, drive.bin_length), drive.starts)
    known: Columns = {name: table.ravel() for name, table in values.items()}
    known["run"] = np.repeat(np.array(drive.labels), count)
    known["time"] = np.tile((np.arange(count) + 1) * drive.row, runs)
    known["ambient_temp"] = known["ambient"]
    known["surface"] = np.array(drive.surfaces)[np.rint(_number(known, "surface")).astype(int)]
    if np.isnan(_number(known, "sensor_rate")).any():
        del known["sensor_rate"]
    columns = {name: known[name] for name in _ORDER if name in known}
    for wheel in range(width - len(MEANS)):
        columns[f"wheel_current_{wheel + 1}"] = rows[:, :, len(MEANS) + wheel].ravel()
    return columns


def measured_columns(
    exact: Columns, drive: Profile, means: Array, noise: Noise, sensors: Sensors, seed: int
) -> tuple[Columns, Mask]:
    """The log that these sensors write, and which rows of ``exact`` it kept.

    Raises:
        InputError: ``sensors.absent`` names a column that the log does not have.
    """
    rng = np.random.default_rng([seed, 2])
    columns = dict(exact)
    runs = len(drive.labels)
    count = len(exact["time"]) // runs
    power = delayed_power(
        means[:, :, MEANS.index("power")], drive.row, sensors.delay, drive.bin_length
    )
    clean = power.ravel()
    scatter = _power_noise(rng, clean, runs, count, noise)
    columns["power"] = sensors.power_scale * (clean + scatter) + sensors.power_offset
    columns["battery_current"] = sensors.power_scale * _number(exact, "battery_current")
    c, s = np.cos(sensors.heading_misalignment), np.sin(sensors.heading_misalignment)
    for x, y, scale in (("vx", "vy", sensors.speed_scale), ("ax", "ay", 1.0)):
        right_x, right_y = _number(exact, x), _number(exact, y)
        columns[x] = scale * (c * right_x - s * right_y)
        columns[y] = scale * (s * right_x + c * right_y)
    columns["pitch"] = _number(exact, "pitch") + sensors.slope_offset
    columns["roll"] = _number(exact, "roll") + sensors.roll_offset
    for name, (spread, by_run) in CHANNEL_ERRORS.items():
        size = runs if by_run else runs * count
        error = noise.channels * spread * rng.standard_normal(size)
        if name == "payload":  # an empty robot is known to be empty
            error *= _number(exact, name)[::count] > 0.0
        columns[name] = _number(columns, name) + (np.repeat(error, count) if by_run else error)
    for name in [n for n in exact if n.startswith("wheel_current_")]:
        error = noise.channels * _WHEEL_CURRENT_ERROR * rng.standard_normal(runs * count)
        columns[name] = _number(exact, name) + error
    kept = rng.random(runs * count) >= sensors.dropouts
    for name in sensors.absent:
        if name not in columns:
            raise InputError("absent", "no such column", value=name, accepted=", ".join(columns))
        del columns[name]
    return {name: values[kept] for name, values in columns.items()}, kept


def _number(columns: Columns, name: str) -> Array:
    return np.asarray(columns[name], dtype=np.float64)


def _power_noise(
    rng: np.random.Generator, clean: Array, runs: int, count: int, noise: Noise
) -> Array:
    """W added to power, (runs · count,)."""
    usual = float(np.mean(np.abs(clean)))
    spread = noise.level * np.maximum(np.abs(clean), noise.floor * usual)
    white = rng.standard_normal((runs, count))
    drive = rng.standard_normal((runs, count))
    slow = np.empty((runs, count))
    slow[:, 0] = drive[:, 0]
    gain = np.sqrt(1.0 - noise.correlation**2)
    for k in range(1, count):
        slow[:, k] = noise.correlation * slow[:, k - 1] + gain * drive[:, k]
    share = noise.autocorrelated
    unit = np.sqrt(1.0 - share) * white + np.sqrt(share) * slow
    result = spread * unit.ravel()
    result += np.repeat(noise.run_offset * usual * rng.standard_normal(runs), count)
    hit = rng.random(runs * count) < noise.outliers
    size = rng.uniform(6.0, 20.0, runs * count) * rng.choice([-1.0, 1.0], runs * count)
    return np.asarray(result + hit * size * spread)
