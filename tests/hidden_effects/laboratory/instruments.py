"""Instruments as laboratories have them, from the robot's 10 ms means to the rows of a log.

    columns = Instruments.drawn(rng, ...).measure(rng, profile, means, lengths)

meter       first-order filter; the moment of the row's end, the row's mean, or the held value of a
            slower meter; delay; quantisation; clipping at full scale
odometry    scale, a scale of its own sideways, slip with acceleration, white noise; slower than
            the log, which repeats it
IMU         bias and noise of acceleration and of the angles; its filter makes these late, or takes
            accelerations for slopes
clock       jitter, rows that are missing, gaps, a rate that is off; moments of arrival, in bunches
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from planner.arrays import Array, Integers
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.virtual import Profile
from planner.telemetry.virtual.dynamics import MEANS, by_name

Columns = dict[str, NDArray[np.generic]]

LONGEST_FILTER = 0.8  # s
LONGEST_ANGLE_LAG = 0.2  # s, of pitch and roll
BUNCHED = 0.25  # share of the samples that wait for a later one, where rows arrive in bunches
FASTER_THAN_ODOMETRY = 20.0  # Hz, of logs some of which repeat a slower odometry
ANGLE_FILTERS = 0.3, 3.0  # s, of angles that follow an accelerometer, as complementary filters do


@dataclass(frozen=True)
class Meter:
    """How the power column comes about.

    Attributes:
        time_constant: s of the first-order filter; 0 for none.
        sampling: "end" (value at the row's end), "mean" (over the row) or "held".
        delay: s by which it is late.
        period, phase: s between the readings of a slower meter, and when the first is taken.
        quantum: W; 0 for none.
        full_scale: share of the rows that a too small range leaves unclipped.
        motion: moment of the motion columns, "end" or "mean".
    """

    time_constant: float = 0.0
    sampling: str = "end"
    delay: float = 0.0
    period: float = 0.0
    phase: float = 0.0
    quantum: float = 0.0
    full_scale: float = 1.0
    motion: str = "end"


@dataclass(frozen=True)
class Noise:
    """Scatter of the power column: shares of mean |P| and of |P|, and how much of it is slow."""

    level: float = 0.0
    share: float = 0.0
    slow: float = 0.0
    correlation_time: float = 1.0
    outliers: float = 0.0


@dataclass(frozen=True)
class Instruments:
    """All instruments of one log; the defaults are perfect ones.

    Attributes:
        meter, noise: of the power.
        speed_scale, sideways_scale: relative errors of the odometry; the second is of vy alone.
        slip: relative error of the speed per m/s² of acceleration.
        speed_noise, yaw_noise: m/s and rad/s, white.
        acceleration_bias, acceleration_noise: m/s².
        pitch_offset, roll_offset, angle_noise: rad.
        angle_lag: s of the first-order filter that pitch and roll come from.
        angle_filter: s over which they follow the accelerometer; 0 for never.
        odometry_period: s between its updates; 0 where each row has one.
        bunched: whether the time column tells when rows arrived, some of them in bunches.
        jitter: standard deviation of the time of a row, as a share of it; ``jitter_logged`` where
            the time column tells it.
        missing, gaps: share of rows that are not there; number of gaps of a second.
        clock_rate: relative error of the time column.
        columns: names of the optional columns that the log has.
    """

    meter: Meter = Meter()
    noise: Noise = Noise()
    speed_scale: float = 0.0
    sideways_scale: float = 0.0
    slip: float = 0.0
    speed_noise: float = 0.0
    yaw_noise: float = 0.0
    acceleration_bias: tuple[float, float] = (0.0, 0.0)
    acceleration_noise: float = 0.0
    pitch_offset: float = 0.0
    roll_offset: float = 0.0
    angle_noise: float = 0.0
    angle_lag: float = 0.0
    angle_filter: float = 0.0
    odometry_period: float = 0.0
    bunched: bool = False
    jitter: float = 0.0
    jitter_logged: bool = True
    missing: float = 0.0
    gaps: int = 0
    clock_rate: float = 0.0
    columns: frozenset[str] = frozenset()

    @classmethod
    def drawn(cls, rng: np.random.Generator, row: float, columns: frozenset[str]) -> Instruments:
        """Random instruments for rows of ``row`` s."""

        def maybe(share: float, value: float) -> float:
            return value if rng.random() < share else 0.0

        sampling = str(rng.choice(["end", "mean", "held"], p=[0.45, 0.40, 0.15]))
        meter = Meter(
            time_constant=maybe(0.6, rng.uniform(0.05, LONGEST_FILTER)),
            sampling=sampling,
            delay=maybe(0.3, rng.uniform(0.0, 0.15)),
            period=row * float(rng.integers(2, 6)) if sampling == "held" else 0.0,
            phase=rng.uniform(0.0, row),
            quantum=maybe(0.5, float(rng.choice([0.01, 0.05, 0.1, 0.2]))),
            full_scale=1.0 - maybe(0.15, rng.uniform(0.0, 0.01)),
            motion=str(rng.choice(["end", "mean"], p=[0.6, 0.4])),
        )
        noise = Noise(
            level=rng.uniform(0.003, 0.015),
            share=rng.uniform(0.003, 0.02),
            slow=maybe(0.4, rng.uniform(0.2, 0.8)),
            correlation_time=rng.uniform(0.3, 4.0),
            outliers=maybe(0.25, rng.uniform(0.001, 0.01)),
        )
        bias = rng.normal(0.0, 0.03, 2)
        # A stream of its own: what is drawn after it stays as it was before angles were late.
        lags = rng.spawn(1)[0]
        angle_lag = lags.uniform(0.03, LONGEST_ANGLE_LAG) if lags.random() < 0.5 else 0.0
        followed = math.exp(lags.uniform(*np.log(ANGLE_FILTERS)))
        # And another for what a recorder does.
        records = rng.spawn(1)[0]
        held = records.random() < 0.2 and row * FASTER_THAN_ODOMETRY <= 1.0 + 1e-9
        updates = row * float(records.integers(2, 6)) if held else 0.0
        return cls(
            odometry_period=updates,
            bunched=bool(records.random() < 0.1),
            meter=meter,
            noise=noise,
            speed_scale=float(rng.normal(0.0, 0.008)),
            sideways_scale=maybe(0.5, float(rng.normal(0.0, 0.012))),
            slip=maybe(0.4, rng.uniform(0.0, 0.02)),
            speed_noise=rng.uniform(0.001, 0.006),
            yaw_noise=rng.uniform(0.002, 0.010),
            acceleration_bias=(float(bias[0]), float(bias[1])),
            acceleration_noise=rng.uniform(0.01, 0.08),
            pitch_offset=float(rng.normal(0.0, 0.002)),
            roll_offset=float(rng.normal(0.0, 0.002)),
            angle_noise=rng.uniform(0.0005, 0.004),
            angle_lag=angle_lag,
            angle_filter=followed if lags.random() < 0.25 else 0.0,
            jitter=maybe(0.5, rng.uniform(0.02, 0.2)),
            jitter_logged=bool(rng.random() < 0.6),
            missing=maybe(0.4, rng.uniform(0.001, 0.03)),
            gaps=int(maybe(0.3, float(rng.integers(1, 4)))),
            clock_rate=float(rng.normal(0.0, 1e-3)),
            columns=columns,
        )

    @property
    def wrong_sensors(self) -> frozenset[str]:
        """Kinds of sensor errors that are there and large enough to be named.

        A biased accelerometer acts as a tilt, and is called by it.
        """
        forward, left = (bias / STANDARD_GRAVITY for bias in self.acceleration_bias)
        sizes = {
            "speed_scale": abs(self.speed_scale + 0.5 * self.sideways_scale) / 0.008,
            "slope_offset": abs(self.pitch_offset - forward) / 0.003,
            "roll_offset": abs(self.roll_offset + left) / 0.003,
            "power_delay": (self.meter.time_constant + self.meter.delay + self.meter.period) / 0.04,
        }
        return frozenset(kind for kind, size in sizes.items() if size >= 1.0)

    def measure(
        self,
        rng: np.random.Generator,
        drive: Profile,
        means: Array,
        lengths: tuple[float, ...],
    ) -> tuple[Columns, Array]:
        """The log, and the power that a perfect meter of this kind would have shown.

        Args:
            rng: of all noise.
            drive: of 10 ms bins.
            means: (runs, bins, k) of the virtual robot.
            lengths: s of each run.

        Returns:
            Columns by name, and (rows,) W.
        """
        table = by_name(means, drive.conditions, drive.starts)
        parts: list[Columns] = []
        clean, updated = [], list[Integers]()
        for k, length in enumerate(lengths):
            taken = self._times(rng, drive.row, length)
            bins = means.shape[1]
            series = {name: values[k] for name, values in table.items()}
            # The nose seems to rise as a robot speeds up, and the left side to as it goes left.
            for name, side, pull in (("pitch", -1.0, "ax"), ("roll", 1.0, "ay")):
                series[name] = filtered(series[name], drive.bin_length, self.angle_lag)
                if self.angle_filter > 0.0:
                    felt = filtered(series[pull], drive.bin_length, self.angle_filter)
                    series[name] = series[name] + side * felt / STANDARD_GRAVITY
            part = {name: self._channel(series[name], taken, drive) for name in self._names(series)}
            part["surface"] = np.array(drive.surfaces)[
                series["surface"][
                    np.clip((taken / drive.bin_length).astype(int), 0, bins - 1)
                ].astype(int)
            ]
            clean.append(self.power(series["power"], taken, drive))
            logged = taken if self.jitter_logged else np.round(taken / drive.row) * drive.row
            if self.bunched:
                logged = arrivals(rng, taken)
            part["time"] = logged * (1.0 + self.clock_rate)
            part["run"] = np.repeat(drive.labels[k], len(taken))
            currents = means[k, :, len(MEANS) :]
            for wheel in range(currents.shape[1]):
                name = f"wheel_current_{wheel + 1}"
                part[name] = self._channel(currents[:, wheel], taken, drive)
            updated.append(sum(map(len, updated)) + self._updates(taken))
            parts.append(part)
        columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        columns, power = self._disturbed(rng, columns, np.concatenate(clean), drive.row)
        latest = np.concatenate(updated)
        return columns | {name: columns[name][latest] for name in ("vx", "vy", "wz")}, power

    def _times(self, rng: np.random.Generator, row: float, length: float) -> Array:
        """True times of the rows that a run has."""
        count = int(length / row)
        times = (np.arange(count) + 1.0) * row
        late = self.jitter * row * np.clip(rng.standard_normal(count), -2.0, 2.0)
        kept = rng.random(count) >= self.missing
        for _ in range(self.gaps):
            at = rng.uniform(0.0, length)
            kept &= (times < at) | (times > at + rng.uniform(0.5, 2.0))
        # Jitter of at most 0.4 rows keeps the order.
        return np.asarray((times + late)[kept])

    def _updates(self, taken: Array) -> Integers:
        """(rows,) number of the row that the odometry of every row of a run comes from."""
        if self.odometry_period <= 0.0:
            return np.arange(len(taken))
        number = np.floor(taken / self.odometry_period + 1e-6)
        return np.searchsorted(number, number)

    @staticmethod
    def _names(series: dict[str, Array]) -> list[str]:
        return [name for name in series if name not in ("surface", "power", "slope_rate")]

    def _channel(self, values: Array, taken: Array, drive: Profile) -> Array:
        window = drive.row if self.meter.motion == "mean" else 0.0
        return sampled(values, drive.bin_length, taken, window)

    def power(self, watts: Array, taken: Array, drive: Profile) -> Array:
        """(rows,) W that the meter shows for means (bins,), without noise."""
        meter = self.meter
        seen = filtered(watts, drive.bin_length, meter.time_constant)
        at = taken - meter.delay
        if meter.sampling == "held":
            at = held_times(at, meter.period, meter.phase)
        window = drive.row if meter.sampling == "mean" else 0.0
        return sampled(seen, drive.bin_length, at, window)

    def _disturbed(
        self, rng: np.random.Generator, exact: Columns, clean: Array, row: float
    ) -> tuple[Columns, Array]:
        count = len(clean)
        columns = {name: _number(exact, name) for name in exact if name not in ("run", "surface")}

        def add(name: str, error: Array | float) -> None:
            columns[name] = columns[name] + error

        columns["power"] = self._noisy(rng, clean, row)
        pull = np.hypot(columns["ax"], columns["ay"])
        factor = 1.0 + self.speed_scale + self.slip * pull
        columns["vx"] = columns["vx"] * factor
        columns["vy"] = columns["vy"] * (factor + self.sideways_scale)
        add("vx", self.speed_noise * rng.standard_normal(count))
        add("vy", self.speed_noise * rng.standard_normal(count))
        add("wz", self.yaw_noise * rng.standard_normal(count))
        for name, bias in zip(("ax", "ay"), self.acceleration_bias, strict=True):
            add(name, bias + self.acceleration_noise * rng.standard_normal(count))
        for name, bias in (("pitch", self.pitch_offset), ("roll", self.roll_offset)):
            add(name, bias + self.angle_noise * rng.standard_normal(count))
        temperature = 0.5 * float(self.angle_noise > 0.0)
        add("motor_temp", temperature * rng.standard_normal(count))
        columns["ambient_temp"] = columns["ambient"]
        made: Columns = {"run": exact["run"], "surface": exact["surface"]}
        made |= {name: np.round(values, 5) for name, values in columns.items()}
        always = ("run", "time", "vx", "vy", "wz", "power")
        return {n: v for n, v in made.items() if n in always or n in self.columns}, clean

    def _noisy(self, rng: np.random.Generator, clean: Array, row: float) -> Array:
        noise, meter = self.noise, self.meter
        usual = float(np.mean(np.abs(clean)))
        spread = np.hypot(noise.level * usual, noise.share * np.abs(clean))
        pole = math.exp(-row / noise.correlation_time)
        drive = math.sqrt(1.0 - pole**2) * rng.standard_normal(len(clean))
        slow = lfilter([1.0], [1.0, -pole], drive)
        white = rng.standard_normal(len(clean))
        error = math.sqrt(1.0 - noise.slow) * white + math.sqrt(noise.slow) * slow
        error += (rng.random(len(clean)) < noise.outliers) * rng.normal(0.0, 12.0, len(clean))
        watts = clean + spread * error
        if meter.full_scale < 1.0:
            watts = np.minimum(watts, np.quantile(clean, meter.full_scale))
        if meter.quantum > 0.0:
            watts = meter.quantum * np.round(watts / meter.quantum)
        return np.asarray(watts)


def filtered(values: Array, step: float, time_constant: float) -> Array:
    """A first-order filter of means (bins,) over ``step`` s; means of its output.

    It begins settled at the first value.
    """
    if time_constant <= 0.0:
        return values
    pole = math.exp(-step / time_constant)
    # Mean over a bin of a response to a constant input, from its value at the start of the bin.
    at_start = lfilter([0.0, 1.0 - pole], [1.0, -pole], values - values[0]) + values[0]
    share = time_constant / step * (1.0 - pole)
    return np.asarray(share * at_start + (1.0 - share) * values)


def sampled(values: Array, step: float, at: Array, window: float) -> Array:
    """Means over the ``window`` s before every time ``at``, or the values there for no window.

    Before the first and after the last value these go on: a late meter shows no zeros at first.
    """
    edges = np.arange(len(values) + 1) * step
    if window <= 0.0:
        return np.interp(at, edges[:-1] + 0.5 * step, values)
    total = np.concatenate([[0.0], np.cumsum(values) * step])

    def integral(time: Array) -> Array:
        before, after = np.minimum(time, 0.0), np.maximum(time - edges[-1], 0.0)
        return np.asarray(np.interp(time, edges, total) + before * values[0] + after * values[-1])

    return (integral(at) - integral(at - window)) / window


def arrivals(rng: np.random.Generator, taken: Array) -> Array:
    """Moments at which samples (n,) arrive: now and then up to four wait for the next one."""
    arrival, k = taken.copy(), 0
    while k < len(taken):
        waiting = int(rng.integers(1, 5)) if rng.random() < BUNCHED else 0
        last = min(k + waiting, len(taken) - 1)
        after = taken[last + 1] - taken[last] if last + 1 < len(taken) else 1.0
        apart = min(1e-3, 0.2 * after)
        arrival[k : last + 1] = taken[last] + apart * np.arange(last + 1 - k)
        k = last + 1
    return arrival


def held_times(at: Array, period: float, phase: float) -> Array:
    """The moment of the last reading of a slower meter before every time."""
    return np.maximum(np.floor((at - phase) / period) * period + phase, 0.0)


def _number(columns: Columns, name: str) -> Array:
    return np.asarray(columns[name], dtype=np.float64)
