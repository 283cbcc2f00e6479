"""Drives as people make them: by hand, by missions, by test patterns.

    profile = drawn_drive(rng, vehicle, Conditions.drawn(rng, needs))

By hand     commands change every second or three, mostly forward, smoothed by thumb and stick
missions    from place to place with stops, straight in any direction or nose first with turns
patterns    headings, speeds and spins of a list, one after the other

Commands stand 10 ms apart, so that a log of 100 Hz can be taken from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from planner.arrays import Array
from planner.power.vehicles import Vehicle
from planner.telemetry.virtual import Profile
from planner.telemetry.virtual.profiles import SURFACES, attitude, axes, level_calm

STEP = 0.01  # s
STYLES = ("by hand", "missions", "patterns", "mixed")
RATES = (5.0, 5.0, 8.0, 10.0, 10.0, 15.0, 20.0, 25.0, 50.0, 100.0)
MOST_ROWS = 4000
SHORTEST, LONGEST = 300.0, 900.0  # s of driving in a log


@dataclass(frozen=True)
class Conditions:
    """How and where a robot is driven.

    Attributes:
        style: of STYLES.
        rate: Hz of the log.
        lengths: s of each run.
        floor: "flat", "tilted" (one slope a run) or "terrain" (slopes change).
        payloads: kg over the robot's mass that runs choose from.
        surfaces: kinds of ground.
        by_run: the ground changes between runs only.
        windy, cold_to_warm, sampling: wind; widely differing temperatures; changing sensor rates.
    """

    style: str
    rate: float
    lengths: tuple[float, ...]
    floor: str
    payloads: tuple[float, ...]
    surfaces: int
    by_run: bool
    windy: bool
    cold_to_warm: bool
    sampling: bool

    @classmethod
    def drawn(cls, rng: np.random.Generator, needs: frozenset[str]) -> Conditions:
        """Random conditions; what ``needs`` lists (slopes, payload, ...) is there."""

        def there(name: str, usually: float) -> bool:
            return bool(rng.random() < (1.0 if name in needs else usually))

        rate = float(rng.choice(RATES))
        whole = min(math.exp(rng.uniform(math.log(SHORTEST), math.log(LONGEST))), MOST_ROWS / rate)
        few = rng.random() < 0.4
        runs = int(rng.integers(4, 8)) if few else int(rng.integers(10, 31))
        runs = max(4, min(runs, int(whole / 6.0)))
        shares = rng.uniform(0.6, 1.4, runs)
        return cls(
            style=str(rng.choice(STYLES)),
            rate=rate,
            lengths=tuple((whole * shares / shares.sum()).tolist()),
            floor=str(rng.choice(["tilted", "terrain"])) if there("slopes", 0.6) else "flat",
            payloads=(0.0, *rng.uniform(0.1, 0.6, 3)) if there("payload", 0.4) else (0.0,),
            surfaces=int(rng.integers(2, 4)) if there("surface", 0.2) else 1,
            by_run=bool(rng.random() < 0.5),
            windy=there("wind", 0.08),
            cold_to_warm=there("temperature", 0.5),
            sampling=there("sensor_rate", 0.05),
        )


def drawn_drive(rng: np.random.Generator, vehicle: Vehicle, how: Conditions) -> Profile:
    """A profile of 10 ms bins; shorter runs are padded, see ``lengths`` of the conditions."""
    bins = math.ceil(max(how.lengths) / STEP)
    runs = len(how.lengths)
    motion = np.zeros((runs, bins + 1, 5))
    conditions, starts = level_calm(runs, bins)
    grounds = rng.permutation(len(SURFACES))[: how.surfaces]
    direction = 0.0
    odometer = 0.0
    for k in range(runs):
        style = how.style if how.style != "mixed" else str(rng.choice(STYLES[:3]))
        motion[k, :, :3] = _MAKERS[style](rng, vehicle, bins + 1)
        yaw = rng.uniform(-math.pi, math.pi) + np.cumsum(motion[k, :, 2]) * STEP
        p, q = _gradients(rng, how.floor, motion[k], bins + 1)
        motion[k, :, 3], motion[k, :, 4] = attitude(p, q, yaw)
        conditions[k, :, 0] = np.abs(np.diff(np.arctan(np.hypot(p, q)))) / STEP
        if how.windy:
            strength, direction = rng.uniform(0.5, 5.0), rng.uniform(-math.pi, math.pi)
            conditions[k, :, 1] = strength * np.cos(direction - yaw[:-1])
            conditions[k, :, 2] = strength * np.sin(direction - yaw[:-1])
        if how.sampling:
            chosen = rng.choice([5.0, 10.0, 20.0, 40.0], 1 + bins // 2000)
            conditions[k, :, 3] = np.repeat(chosen, 2000)[:bins]
        changes = rng.choice(grounds, 1 if how.by_run else 1 + bins // 1500)
        conditions[k, :, 4] = np.repeat(changes, bins if how.by_run else 1500)[:bins]
        payload = vehicle.mass * float(rng.choice(how.payloads))
        reach = 0.25 * payload / (payload + vehicle.mass)
        starts[k, 0] = payload
        starts[k, 1] = reach * vehicle.length * rng.uniform(-1.0, 1.0)
        starts[k, 2] = reach * vehicle.width * rng.uniform(-1.0, 1.0)
        starts[k, 3] = rng.uniform(-5.0, 35.0) if how.cold_to_warm else rng.uniform(19.0, 24.0)
        starts[k, 5] = starts[k, 3] + rng.uniform(0.0, 40.0 if how.cold_to_warm else 10.0)
        starts[k, 4] = starts[k, 5] + rng.uniform(0.0, 8.0)
        starts[k, 6] = rng.uniform(0.3, 1.0)
        starts[k, 7] = odometer
        end = int(how.lengths[k] / STEP)
        odometer += float(np.hypot(motion[k, :end, 0], motion[k, :end, 1]).sum()) * STEP
    labels = tuple(f"run{k:02d}" for k in range(runs))
    return Profile(
        "laboratory", motion, conditions, starts, SURFACES, labels, (), 1.0 / how.rate, STEP
    )


def uphill(p: Array, q: Array, yaw: Array) -> tuple[Array, Array]:
    """Heights gained per metre forward and left on a plane with these slopes."""
    forward, left = axes(p, q, yaw)
    return forward[2], left[2]


def _by_hand(rng: np.random.Generator, vehicle: Vehicle, count: int) -> Array:
    """(count, 3) m/s, m/s, rad/s."""
    top, turn = 0.75 * vehicle.limits.speed, 0.7 * vehicle.limits.yaw_rate
    aims = np.zeros((count, 3))
    at = int(rng.uniform(0.5, 3.0) / STEP)
    sideways = rng.uniform(0.1, 0.6)
    while at < count:
        hold = int((0.5 + rng.exponential(2.5)) / STEP)
        if rng.random() > 0.12:  # else a pause
            pace = top * rng.beta(2.0, 1.3)
            heading = rng.normal(0.0, 0.25)
            if rng.random() < 0.15:
                heading += math.pi
            if rng.random() < sideways:
                heading = rng.uniform(-math.pi, math.pi)
            yaw = turn * rng.normal(0.0, 0.45) if rng.random() < 0.6 else 0.0
            aims[at : at + hold] = pace * math.cos(heading), pace * math.sin(heading), yaw
        at += hold
    aims += np.abs(aims) * _slow_noise(rng, count, 0.06)
    # Two equal lags turn a step into at most step/(e·lag) of acceleration.
    hardest = 2.0 * top / (math.e * vehicle.limits.acceleration)
    lag = hardest * rng.uniform(0.8, 1.6)
    pole = math.exp(-STEP / lag)
    smooth = lfilter([1.0 - pole], [1.0, -pole], aims, axis=0)
    return _within(lfilter([1.0 - pole], [1.0, -pole], smooth, axis=0), vehicle)


def _slow_noise(rng: np.random.Generator, count: int, size: float) -> Array:
    pole = math.exp(-STEP / 0.4)
    white = size * math.sqrt(1.0 - pole**2) * rng.standard_normal((count, 3))
    return np.asarray(lfilter([1.0], [1.0, -pole], white, axis=0))


def _missions(rng: np.random.Generator, vehicle: Vehicle, count: int) -> Array:
    """Legs of a trapezoid of speed, stops between, turns on the spot where the nose leads."""
    limits = vehicle.limits
    made = [np.zeros((int(rng.uniform(0.5, 2.5) / STEP), 3))]
    nose_first = rng.random() < 0.5
    usual = rng.uniform(0.4, 0.85) * limits.speed
    while sum(map(len, made)) < count:
        if nose_first:
            angle = rng.uniform(-2.5, 2.5)
            rate = _trapezoid(abs(angle), 0.6 * limits.yaw_rate, 1.5 * limits.yaw_rate)
            made.append(np.outer(rate * np.sign(angle), [0.0, 0.0, 1.0]))
        pace = usual * (1.0 if rng.random() < 0.6 else rng.uniform(0.3, 1.0))
        speed = _trapezoid(rng.uniform(0.4, 6.0), pace, rng.uniform(0.4, 0.8) * limits.acceleration)
        heading = 0.0 if nose_first else rng.uniform(-math.pi, math.pi)
        turning = rng.normal(0.0, 0.15) * limits.yaw_rate if rng.random() < 0.4 else 0.0
        made.append(np.outer(speed, [math.cos(heading), math.sin(heading), turning / pace]))
        made.append(np.zeros((int(rng.uniform(0.0, 3.0) / STEP), 3)))
    return _within(np.concatenate(made)[:count], vehicle)


def _patterns(rng: np.random.Generator, vehicle: Vehicle, count: int) -> Array:
    """Every heading at some speeds, spins between, in the order of a list that starts anywhere."""
    limits = vehicle.limits
    listed = []
    for share in rng.choice([0.2, 0.35, 0.5, 0.65, 0.8], 3, replace=False):
        for heading in np.arange(8) * math.pi / 4.0:
            pace = share * limits.speed
            listed.append((pace * math.cos(heading), pace * math.sin(heading), 0.0))
        listed.append((0.0, 0.0, share * limits.yaw_rate))
        listed.append((0.6 * share * limits.speed, 0.0, -share * limits.yaw_rate))
    hold = int(rng.uniform(2.0, 5.0) / STEP)
    hardest = 1.6 * limits.speed / limits.acceleration
    ramp = int(hardest * rng.uniform(0.8, 1.5) / STEP)
    first = int(rng.integers(len(listed)))
    made, before = [], np.zeros(3)
    shares = np.linspace(0.0, 1.0, ramp)[:, None]
    while sum(map(len, made)) < count:
        aim = np.array(listed[(first + len(made)) % len(listed)])
        made.append(np.concatenate([before + shares * (aim - before), np.tile(aim, (hold, 1))]))
        before = aim
    return _within(np.concatenate(made)[:count], vehicle)


def _trapezoid(length: float, pace: float, rate: float) -> Array:
    """Speeds over a length, from rest to rest, at most ``pace``."""
    pace = min(pace, math.sqrt(length * rate))
    ramp = np.arange(0.0, pace, rate * STEP)
    hold = np.full(int(max(length / pace - pace / rate, 0.0) / STEP), pace)
    return np.concatenate([ramp, hold, ramp[::-1]])


def _within(motion: Array, vehicle: Vehicle) -> Array:
    """Commands that all wheels can follow."""
    need = np.hypot(motion[:, 0], motion[:, 1]) + 0.5 * vehicle.width * np.abs(motion[:, 2])
    most = 0.9 * vehicle.limits.speed
    return motion * np.minimum(1.0, most / np.maximum(need, 1e-9))[:, None]


def _gradients(
    rng: np.random.Generator, floor: str, motion: Array, count: int
) -> tuple[Array, Array]:
    """Slopes of the ground in the world along x and y."""
    if floor == "flat":
        # No floor is quite level.
        return np.full(count, rng.normal(0.0, 0.001)), np.full(count, rng.normal(0.0, 0.001))
    steep, bearing = rng.uniform(0.02, 0.12), rng.uniform(-math.pi, math.pi)
    if floor == "tilted":
        return np.full(count, steep * math.cos(bearing)), np.full(count, steep * math.sin(bearing))
    way = np.cumsum(np.hypot(motion[:, 0], motion[:, 1])) * STEP
    made = []
    for _ in range(2):
        waves = rng.uniform(2.0, 12.0, 3)
        phases = rng.uniform(0.0, 2.0 * math.pi, 3)
        heights = [np.sin(2 * math.pi * way / w + f) for w, f in zip(waves, phases, strict=True)]
        made.append(0.8 * steep * np.sum(heights, axis=0) / math.sqrt(3.0))
    return made[0], made[1]


_MAKERS = {"by hand": _by_hand, "missions": _missions, "patterns": _patterns}
