"""What the virtual robot is asked to drive: commands, slopes, loads and surroundings of every run.

    profile("rich", vehicle)                everything varies: 16 training and 8 held-out runs
    profile("speed_heats_motor", vehicle)   motor temperature is a function of the speed alone
    profile("one_heading", vehicle)         forward only
    profile("one_load", vehicle)            no payload, centre of mass in the middle
    profile("flat", vehicle)                as rich, on a level floor
    steady(vx=0.5, pitch=-0.17, ...)        one constant motion a run

A run is a chain of segments of a few seconds, each with a speed, a heading, a yaw rate and a slope
of its own; between them commands change along smooth ramps. Slopes are planes in the world: when
the robot turns on one, its roll and pitch change. Commands stand 0.1 s apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from planner.arrays import Array, Integers
from planner.errors import InputError
from planner.power.vehicles import Vehicle
from planner.telemetry.virtual.dynamics import BIN, CONDITIONS, MOTION, START

DESIGNS = ("rich", "speed_heats_motor", "one_heading", "one_load", "flat")
SURFACES = ("hard", "carpet", "asphalt")
ROW = 0.5  # s, the interval of a log's rows unless a profile says otherwise
TRAINING, HELD_OUT, ROWS = 16, 8, 300
"""Runs to fit on, runs held out, and rows of each, unless a caller says otherwise."""


@dataclass(frozen=True)
class Profile:
    """Commands and surroundings of all runs; every run has the same length.

    Attributes:
        name: the design.
        motion: (runs, bins + 1, len(MOTION)) commands at the edges of bins.
        conditions: (runs, bins, len(CONDITIONS)) of wind, ground and the like; NaN where the robot
            is left to itself.
        starts: (runs, len(START)) load and initial state.
        surfaces: names of the grounds that ``conditions`` numbers.
        held_out: labels of the runs that a test keeps back.
        labels: name of each run.
        row: s, interval of the log's rows.
        bin_length: s, a multiple of the integrator's step.
        BIN, ROW: s, length of a bin, and the interval of rows unless a profile says otherwise.
        MOTION, CONDITIONS: names of the last axis of ``motion`` and ``conditions``.
    """

    name: str
    motion: Array
    conditions: Array
    starts: Array
    surfaces: tuple[str, ...]
    labels: tuple[str, ...]
    held_out: tuple[str, ...] = ()
    row: float = ROW
    bin_length: float = BIN

    BIN: ClassVar[float] = BIN
    ROW: ClassVar[float] = ROW
    MOTION: ClassVar[tuple[str, ...]] = MOTION
    CONDITIONS: ClassVar[tuple[str, ...]] = CONDITIONS

    @classmethod
    def plain(cls, name: str, motion: Array, labels: Sequence[str]) -> Profile:
        """Commands (runs, bins + 1, len(MOTION)) in level calm, without load, nothing held out."""
        runs, edges = motion.shape[:2]
        conditions, starts = level_calm(runs, edges - 1)
        return cls(name, motion, conditions, starts, SURFACES, tuple(labels))

    def runs(self, chosen: Sequence[int]) -> Profile:
        """A profile of some of the runs, numbered from 0."""
        index = list(chosen)
        labels = tuple(self.labels[k] for k in index)
        return replace(
            self,
            motion=self.motion[index],
            conditions=self.conditions[index],
            starts=self.starts[index],
            labels=labels,
            held_out=tuple(label for label in self.held_out if label in labels),
        )


def profile(
    design: str,
    vehicle: Vehicle,
    *,
    seed: int = 0,
    runs: int = TRAINING + HELD_OUT,
    rows: int = ROWS,
    row: float = ROW,
) -> Profile:
    """A profile for identification.

    Args:
        design: one of ``DESIGNS``.
        vehicle: gives the limits of speed and yaw rate, mass and lengths.
        seed: of what is drawn at random.
        runs: number of runs; the last third is held out.
        rows: rows of the log a run.
        row: s, interval of a row, a multiple of 0.1 s.

    Raises:
        InputError: no such design.
    """
    if design not in DESIGNS:
        raise InputError("profile", "no such design", value=design, accepted=", ".join(DESIGNS))
    rng = np.random.default_rng([seed, 1])
    bins = rows * bins_of(row)
    top = 0.65 * vehicle.limits.speed
    motion = np.zeros((runs, bins + 1, len(MOTION)))
    conditions, starts = level_calm(runs, bins)
    turn = 0.6 * vehicle.limits.yaw_rate
    for k in range(runs):
        pieces = _segments(rng, bins, bins_of(row))
        count = len(pieces)
        speed = top * rng.uniform(0.12, 1.0, count) * (rng.random(count) > 0.07)
        heading = rng.uniform(-math.pi, math.pi, count)
        yaw = turn * rng.uniform(-1.0, 1.0, count) * (rng.random(count) < 0.45)
        if design == "one_heading":
            heading[:], yaw[:] = 0.0, 0.0
        steep = 0.13 * rng.uniform(0.0, 1.0, count) * (rng.random(count) < 0.75)
        uphill = rng.uniform(-math.pi, math.pi, count)
        if design == "flat":
            steep[:] = 0.0
        calm = np.hypot(speed, 0.5 * vehicle.width * yaw) / top
        scale = 1.0 / np.maximum(calm, 1.0)
        motion[k, :, 0] = _ramps(pieces, speed * scale * np.cos(heading), bins)
        motion[k, :, 1] = _ramps(pieces, speed * scale * np.sin(heading), bins)
        motion[k, :, 2] = _ramps(pieces, yaw * scale, bins)
        gradient_x = _ramps(pieces, np.tan(steep) * np.cos(uphill), bins)
        gradient_y = _ramps(pieces, np.tan(steep) * np.sin(uphill), bins)
        yaws = rng.uniform(-math.pi, math.pi) + _integral(motion[k, :, 2])
        motion[k, :, 3], motion[k, :, 4] = attitude(gradient_x, gradient_y, yaws)
        conditions[k, :, 0] = tilting(gradient_x, gradient_y)
        _weather(rng, conditions[k], yaws)
        conditions[k, :, 4] = _steps(pieces, rng.integers(0, len(SURFACES), count), bins)
        _load(rng, starts[k], vehicle, empty=design == "one_load")
        if design == "speed_heats_motor":
            pace = np.hypot(motion[k, :-1, 0], motion[k, :-1, 1])
            conditions[k, :, 5] = 25.0 + 45.0 * pace / top
    path = np.hypot(motion[:, :-1, 0], motion[:, :-1, 1]).sum(axis=1) * BIN
    starts[:, 7] = np.concatenate([[0.0], np.cumsum(path)[:-1]])
    labels = tuple(f"run{k:02d}" for k in range(runs))
    kept = labels[runs - runs // 3 :]
    return Profile(design, motion, conditions, starts, SURFACES, labels, kept, row)


def steady(
    *,
    vx: float | Sequence[float] = 0.0,
    vy: float | Sequence[float] = 0.0,
    wz: float | Sequence[float] = 0.0,
    roll: float | Sequence[float] = 0.0,
    pitch: float | Sequence[float] = 0.0,
    duration: float = 10.0,
    row: float = ROW,
    settings: Mapping[str, float | Sequence[float]] | None = None,
) -> Profile:
    """One constant motion a run; arguments are numbers or one number a run.

    Args:
        vx: m/s.
        vy: m/s.
        wz: rad/s.
        roll: rad.
        pitch: rad, negative when climbing forward.
        duration: s of each run.
        row: s, interval of a row.
        settings: names of ``CONDITIONS`` or ``START`` → value, one for all runs or one a run.
    """
    given = [np.atleast_1d(np.asarray(q, dtype=float)) for q in (vx, vy, wz, roll, pitch)]
    extra = {k: np.atleast_1d(np.asarray(v, dtype=float)) for k, v in (settings or {}).items()}
    runs = max(len(q) for q in (*given, *extra.values()))
    bins = round(duration / BIN)
    motion = np.zeros((runs, bins + 1, len(MOTION)))
    for column, values in enumerate(given):
        motion[:, :, column] = np.broadcast_to(values, (runs,))[:, None]
    conditions, starts = level_calm(runs, bins)
    set_quantities(extra, conditions, starts)
    labels = tuple(f"run{k:02d}" for k in range(runs))
    return Profile("steady", motion, conditions, starts, SURFACES, labels, (), row)


def attitude(gradient_x: Array, gradient_y: Array, yaw: Array) -> tuple[Array, Array]:
    """Roll and pitch in rad of a robot on a plane with these slopes, turned by ``yaw``."""
    forward, left = axes(gradient_x, gradient_y, yaw)
    # Gravity is -g times the vertical part of each axis: sin(pitch) and -cos(pitch)·sin(roll).
    pitch = np.arcsin(-forward[2])
    return np.arcsin(np.clip(left[2] / np.cos(pitch), -1.0, 1.0)), pitch


def axes(p: Array, q: Array, yaw: Array) -> tuple[Array, Array]:
    """Body axes in the world, (3, k) each: forward above the yaw direction, left square to it."""
    c, s = np.cos(yaw), np.sin(yaw)
    forward = np.stack([c, s, p * c + q * s])
    forward /= np.linalg.norm(forward, axis=0)
    normal = np.stack([-p, -q, np.ones_like(p)])
    normal /= np.linalg.norm(normal, axis=0)
    return forward, np.cross(normal, forward, axis=0)


def tilting(p: Array, q: Array) -> Array:
    """Rate of the angle between the surface and the level, rad/s, from slopes at bin edges."""
    return np.abs(np.diff(np.arctan(np.hypot(p, q)))) / BIN


def bins_of(row: float) -> int:
    """Number of 0.1 s bins in a row of ``row`` s; InputError where it is not whole."""
    count = round(row / BIN)
    if count < 1 or abs(count * BIN - row) > 1e-9:
        raise InputError("row", "not a multiple of 0.1 s", value=row, accepted="0.1, 0.2, 0.5, …")
    return count


def level_calm(runs: int, bins: int) -> tuple[Array, Array]:
    """Surroundings (runs, bins, len(CONDITIONS)) and starts (runs, len(START)) of an empty robot.

    It is left to itself in still air, at 25 °C, with a full battery.
    """
    conditions, starts = np.zeros((runs, bins, len(CONDITIONS))), np.zeros((runs, len(START)))
    conditions[:, :, 3] = conditions[:, :, 5] = np.nan
    conditions[:, :, 6] = 1.0
    starts[:, 3:6] = 25.0
    starts[:, 6] = 1.0
    return conditions, starts


def set_quantities(settings: Mapping[str, ArrayLike], conditions: Array, starts: Array) -> None:
    """Set surroundings and starts of all runs.

    Args:
        settings: names of ``CONDITIONS`` or ``START`` → value, one for all runs or one a run.
        conditions: (runs, bins, len(CONDITIONS)), changed.
        starts: (runs, len(START)), changed.

    Raises:
        InputError: no such quantity.
    """
    for name, value in settings.items():
        if name in CONDITIONS:
            conditions[:, :, CONDITIONS.index(name)] = np.reshape(value, (-1, 1))
        elif name in START:
            starts[:, START.index(name)] = value
        else:
            accepted = ", ".join((*CONDITIONS, *START))
            raise InputError("settings", "no such quantity", value=name, accepted=accepted)


def _segments(rng: np.random.Generator, bins: int, row: int) -> list[tuple[int, int]]:
    """First bin and length of ramp of each segment; both whole rows."""
    pieces: list[tuple[int, int]] = []
    at = 0
    while at < bins:
        ramp = row * max(1, round(rng.uniform(2.5, 5.0) / (row * BIN)))
        pieces.append((at, ramp))
        at += ramp + row * max(1, round(rng.uniform(2.5, 8.0) / (row * BIN)))
    return pieces


def _ramps(pieces: list[tuple[int, int]], values: Array, bins: int) -> Array:
    """Values of the segments at bin edges, joined by raised cosines."""
    curve = np.empty(bins + 1)
    before = 0.0
    for (start, ramp), value in zip(pieces, values, strict=True):
        shares = np.clip(np.arange(bins + 1 - start) / ramp, 0.0, 1.0)
        curve[start:] = before + (value - before) * 0.5 * (1.0 - np.cos(math.pi * shares))
        before = float(value)
    return curve


def _steps(pieces: list[tuple[int, int]], values: Integers, bins: int) -> Array:
    curve = np.zeros(bins)
    for (start, _), value in zip(pieces, values, strict=True):
        curve[start:] = value
    return curve


def _integral(rate: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))]) * BIN


def _weather(rng: np.random.Generator, conditions: Array, yaws: Array) -> None:
    strength, bearing = rng.uniform(0.0, 4.0), rng.uniform(-math.pi, math.pi)
    time = np.arange(len(conditions)) * BIN
    phase = rng.uniform(0.0, 2.0 * math.pi)
    gusts = strength * (1.0 + 0.4 * np.sin(2.0 * math.pi * time / 17.0 + phase))
    conditions[:, 1] = gusts * np.cos(bearing - yaws[:-1])
    conditions[:, 2] = gusts * np.sin(bearing - yaws[:-1])
    conditions[:, 3] = np.repeat(rng.choice([10.0, 20.0, 30.0, 50.0], 1 + len(time) // 300), 300)[
        : len(time)
    ]


def _load(rng: np.random.Generator, start: Array, vehicle: Vehicle, *, empty: bool) -> None:
    if not empty:
        start[0] = vehicle.mass * rng.choice([0.0, 0.2, 0.4, 0.6])
        reach = 0.2 * start[0] / (start[0] + vehicle.mass)
        start[1] = reach * vehicle.length * rng.uniform(-1.0, 1.0)
        start[2] = reach * vehicle.width * rng.uniform(-1.0, 1.0)
    start[3] = rng.uniform(-5.0, 35.0)
    start[5] = start[3] + rng.uniform(0.0, 40.0)
    start[4] = start[5] + rng.uniform(0.0, 10.0)
    start[6] = rng.uniform(0.25, 1.0)
