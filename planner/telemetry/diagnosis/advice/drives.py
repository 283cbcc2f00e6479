"""Drives that a robot can repeat: legs from rest to rest, in a stated area, and their commands.

    settings = drive.settings(rounds=3)                # numbers of a Drive, as JSON has them
    settings = fitted_into(settings, (4.0, 3.0))       # for an area of 4 m by 3 m
    commands(settings)                                 # (k, 4) of t, vx, vy, wz
    rows, seconds = rows_of_round(settings, 0.0, {})   # rows of the power model that a round gives

    settings = {"legs": [{"vx", "vy", "wz", "ramp", "hold"}], "rounds", "area", "robot",
                "slope", "uphill", "runs": [{"payload", "motor_temp"}], "acceleration"}

in SI and in the body frame. A leg starts and ends at rest: its velocity grows for ``ramp`` seconds,
stays for ``hold`` and fades as it grew. A round is all legs in order; it ends where it began. Every
run drives all ``rounds``. ``slope`` is a ramp that rises towards ``uphill``, an angle from the
heading at the start; ``motor_temp`` is None where it may be as it is. ``area`` is the length and
width that path and robot take up.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.errors import InputError
from planner.power.rows import gravity_columns, rows_from
from planner.power.vehicles import Vehicle
from planner.quantities import STANDARD_GRAVITY

Leg = dict[str, float]
Settings = Mapping[str, Any]

LEG_SLOPE = 0.0873  # 5°
GENTLE_LEGS, HARD_LEGS = 0.4, 0.8
"""Acceleration of the legs over the vehicle's limit."""
TOP_SPEED, TOP_YAW_RATE = 0.65, 0.6
"""Highest speed and yaw rate over the vehicle's limits, so that motors and grip have a reserve."""
LEG_SPEEDS = (0.15, 0.35, 0.6, 0.85)
"""Speeds over the highest one."""
CREEP_SPEEDS = (0.01, 0.02, 0.04, 0.07)
"""m/s, where rollers and wheels stick."""
HOLD, LONGEST_HOLD = 3.0, 8.0
"""s of steady motion in a leg: at the highest speed, and at most."""
LEAST_HOLD = 0.5
"""s of steady motion that a leg keeps in a small area."""
SLOWEST_LEG = 0.5
"""Share of its speed that a leg keeps in a small area."""
LENGTH_HALVINGS = 12
"""Halvings in the search for the longest leg that fits: to 2 mm in 10 m."""
PATH_STEP = 0.05
"""s between the poses that show what area a path takes."""
DIGITS = 4
"""Decimals of settings."""


@dataclass(frozen=True)
class Drive:
    """One way of driving.

    Attributes:
        words: what is driven, after "Drive".
        legs: of a round.
        slope: rad, of the ramp that it needs; 0 on level ground.
        uphill: rad, towards which the ramp rises, from the heading at the start.
    """

    words: str
    legs: tuple[Leg, ...]
    slope: float = 0.0
    uphill: float = 0.0

    @property
    def seconds(self) -> float:
        """Duration of a round."""
        return sum(2.0 * leg["ramp"] + leg["hold"] for leg in self.legs)


def drives_of(vehicle: Vehicle) -> list[Drive]:
    """All ways of driving that are considered for a vehicle."""
    limits = vehicle.limits
    top, turn = TOP_SPEED * limits.speed, TOP_YAW_RATE * limits.yaw_rate
    speeds = [top * share for share in LEG_SPEEDS]
    said = ", ".join(f"{v:.2f}" for v in speeds)
    slope = f"a ramp of {math.degrees(LEG_SLOPE):.0f}°"
    ahead, left = (1.0, 0.0), (0.0, 1.0)
    diagonal = math.sqrt(0.5)
    eight = [ahead, left, (diagonal, diagonal), (-diagonal, diagonal)]

    def lines(directions: Sequence[tuple[float, float]], share: float = GENTLE_LEGS) -> list[Leg]:
        return [
            leg
            for v in speeds
            for x, y in directions
            for leg in there_and_back(vehicle, v * x, v * y, 0.0, share)
        ]

    def turned(angle: float) -> list[Leg]:
        return [_turn(vehicle, angle, turn)]

    half, quarter = turned(math.pi), turned(0.5 * math.pi)
    back = turned(-0.5 * math.pi)
    creeping = [
        leg
        for v in CREEP_SPEEDS
        for x, y in (ahead, left)
        for leg in there_and_back(vehicle, v * x, v * y, 0.0)
    ]
    curves = [
        leg
        for v, w in itertools.product((speeds[1], speeds[2]), (0.4, 0.8, -0.4, -0.8))
        for x, y in (ahead, left)
        for leg in there_and_back(vehicle, v * x, v * y, w * turn)
    ]
    spins = [leg for w in (0.3, 0.8) for leg in there_and_back(vehicle, 0.0, 0.0, w * turn)]
    returning = f"there and back at {said} m/s"
    return [
        Drive(f"straight ahead and back on level ground at {said} m/s", tuple(lines([ahead]))),
        Drive(f"sideways {returning} on level ground", tuple(lines([left]))),
        Drive(f"in all eight directions {returning} on level ground", tuple(lines(eight))),
        Drive(
            f"up and down {slope}, forwards and backwards, at {said} m/s",
            (*lines([ahead]), *half, *lines([(-1.0, 0.0)]), *half),
            LEG_SLOPE,
        ),
        Drive(
            f"up and down {slope}, sideways, at {said} m/s",
            (*lines([left]), *half, *lines([(0.0, -1.0)]), *half),
            LEG_SLOPE,
            0.5 * math.pi,
        ),
        Drive(
            f"forwards and sideways across {slope} at {said} m/s",
            (*lines([ahead]), *quarter, *lines([left]), *back),
            LEG_SLOPE,
            0.5 * math.pi,
        ),
        Drive(f"turning on the spot at {0.3 * turn:.2f} and {0.8 * turn:.2f} rad/s", tuple(spins)),
        Drive(
            f"in curves at {speeds[1]:.2f} and {speeds[2]:.2f} m/s with up to {0.8 * turn:.2f} "
            "rad/s to either side",
            tuple(curves),
        ),
        Drive("creeping at 1 to 7 cm/s, forwards and sideways, there and back", tuple(creeping)),
        Drive(
            f"starting and stopping hard with {HARD_LEGS * limits.acceleration:.2g} m/s², forwards "
            f"and sideways, up to {speeds[-1]:.2f} m/s",
            tuple({**leg, "hold": LEAST_HOLD} for leg in lines([ahead, left], HARD_LEGS)),
        ),
    ]


def there_and_back(
    vehicle: Vehicle, vx: float, vy: float, wz: float, share: float = GENTLE_LEGS
) -> tuple[Leg, Leg]:
    """A leg and the one that leads back on the same path.

    Args:
        vehicle: says what the robot can do.
        vx, vy, wz: m/s and rad/s while the motion is steady; scaled down where wheels would pass
            the highest speed.
        share: of the largest acceleration.
    """
    limits, reach = vehicle.limits, 0.5 * math.hypot(vehicle.length, vehicle.width)
    rim = math.hypot(vx, vy) + reach * abs(wz)
    # An unhurried turn of a large robot is as fast as its rim may be.
    less = min(1.0, limits.speed / max(rim, 1e-9))
    vx, vy, wz, rim = (less * value for value in (vx, vy, wz, rim))
    ramp = rim / (share * limits.acceleration)
    speed = math.hypot(vx, vy)
    longest = HOLD * TOP_SPEED * limits.speed * LEG_SPEEDS[-1] / max(speed, 1e-9)
    leg = _leg(vx, vy, wz, ramp, min(longest, LONGEST_HOLD))
    return leg, {name: value if name in ("ramp", "hold") else -value for name, value in leg.items()}


def _turn(vehicle: Vehicle, angle: float, rate: float) -> Leg:
    """A turn on the spot by an angle."""
    leg = there_and_back(vehicle, 0.0, 0.0, math.copysign(rate, angle))[0]
    return {**leg, "hold": max(angle / leg["wz"] - leg["ramp"], 0.0)}


def _leg(vx: float, vy: float, wz: float, ramp: float, hold: float) -> Leg:
    values = {"vx": vx, "vy": vy, "wz": wz, "ramp": ramp, "hold": hold}
    return {name: round(value, DIGITS) for name, value in values.items()}


def settings_of(
    drive: Drive, vehicle: Vehicle, runs: Sequence[Mapping[str, float | None]], rounds: int
) -> dict[str, Any]:
    """A drive in numbers.

    Args:
        drive: the way of driving.
        vehicle: that drives.
        runs: payload in kg and motor temperature in °C, or None, of every run.
        rounds: of every run.
    """
    robot = [vehicle.length, vehicle.width]
    settings: dict[str, Any] = {
        "runs": [dict(run) for run in runs],
        "rounds": rounds,
        "slope": drive.slope,
        "uphill": round(drive.uphill, DIGITS),
        "robot": robot,
        "legs": [dict(leg) for leg in drive.legs],
    }
    return {"area": area_of(settings), **settings}


def area_of(settings: Settings) -> list[float]:
    """Length and width in m that path and robot take up, along and across the first heading."""
    return [math.ceil(10.0 * size - 1e-6) / 10.0 for size in _extent(settings)]


def _extent(settings: Settings) -> list[float]:
    x, y, _ = poses_of(sampled({**settings, "rounds": 1}, PATH_STEP)).T
    return [float(np.ptp(along)) + math.hypot(*settings["robot"]) for along in (x, y)]


def fitted_into(settings: Settings, area: tuple[float, float]) -> dict[str, Any]:
    """The same drive with shorter or slower legs, where it would leave an area.

    Args:
        settings: of the drive.
        area: m, length and width, along and across the heading at the start.

    Raises:
        InputError: a leg would keep less than SLOWEST_LEG of its speed.
    """

    def fits(some: Sequence[Leg]) -> bool:
        needs = _extent({**settings, "legs": some})
        return all(size <= has for size, has in zip(needs, area, strict=True))

    legs = settings["legs"]
    if not fits(legs):
        low, high = 0.0, max(map(_length, legs))
        for _ in range(LENGTH_HALVINGS):
            longest = 0.5 * (low + high)
            legs = [_shortened(leg, longest) for leg in settings["legs"]]
            low, high = (longest, high) if fits(legs) else (low, longest)
        legs = [_shortened(leg, low) for leg in settings["legs"]]
    pairs = zip(legs, settings["legs"], strict=True)
    if not fits(legs) or any(_speed(one) < SLOWEST_LEG * _speed(other) for one, other in pairs):
        needs = " x ".join(f"{size:g}" for size in settings["area"])
        given = " x ".join(f"{size:g}" for size in area)
        raise InputError(
            "area", "is too small for this drive", value=f"{given} m", accepted=f"about {needs} m"
        )
    before, after = (sum(leg["hold"] for leg in some) for some in (settings["legs"], legs))
    rounds = math.ceil(settings["rounds"] * before / max(after, 1e-9) - 1e-9)
    fitted = {**settings, "legs": legs, "rounds": rounds}
    return {**fitted, "area": area_of(fitted)}


def _speed(leg: Leg) -> float:
    return math.hypot(leg["vx"], leg["vy"])


def _length(leg: Leg) -> float:
    """m from rest to rest."""
    return _speed(leg) * (leg["ramp"] + leg["hold"])


def _shortened(leg: Leg, longest: float) -> Leg:
    """A leg of at most a length in m: shorter at the same speed, or slower as well."""
    if _length(leg) <= longest:
        return leg
    speed, hold = _speed(leg), min(leg["hold"], LEAST_HOLD)
    # Acceleration stays: share · speed · (share · ramp + hold) = longest at the least hold.
    rise = speed * leg["ramp"]
    share = (math.sqrt((speed * hold) ** 2 + 4.0 * rise * longest) - speed * hold) / (2.0 * rise)
    share = min(share, 1.0)
    hold = max(longest / (max(share, 1e-9) * speed) - share * leg["ramp"], 0.0)
    slower = {name: share * leg[name] for name in ("vx", "vy", "wz", "ramp")}
    return _leg(**slower, hold=min(hold, leg["hold"]))


def commands(settings: Settings) -> Array:
    """(k, 4) of s, m/s, m/s, rad/s: the corners of a run's commands, linear in between."""
    corners = [(0.0, 0.0, 0.0, 0.0)]
    clock = 0.0
    for _ in range(settings["rounds"]):
        for leg in settings["legs"]:
            motion = (leg["vx"], leg["vy"], leg["wz"])
            corners.append((clock + leg["ramp"], *motion))
            corners.append((clock + leg["ramp"] + leg["hold"], *motion))
            clock += 2.0 * leg["ramp"] + leg["hold"]
            corners.append((clock, 0.0, 0.0, 0.0))
    return np.array(corners)


def sampled(settings: Settings, step: float) -> Array:
    """(k, 4) commands of a run at equal steps of s, which ends at rest."""
    corners = commands(settings)
    times = np.arange(math.ceil(corners[-1, 0] / step) + 1) * step
    columns = [np.interp(times, corners[:, 0], corners[:, k]) for k in (1, 2, 3)]
    return np.column_stack([times, *columns])


def poses_of(driven: Array) -> Array:
    """(k, 3) of m, m, rad from where the drive starts, of commands (k, 4)."""
    step = np.diff(driven[:, 0])
    vx, vy, wz = 0.5 * (driven[1:, 1:] + driven[:-1, 1:]).T
    yaw = np.concatenate([[0.0], np.cumsum(wz * step)])
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    x = np.cumsum((vx * np.cos(middle) - vy * np.sin(middle)) * step)
    y = np.cumsum((vx * np.sin(middle) + vy * np.cos(middle)) * step)
    return np.column_stack([np.concatenate([[0.0], x]), np.concatenate([[0.0], y]), yaw])


def tilt_of(settings: Settings, yaw: Array) -> tuple[Array, Array]:
    """(k,) rad roll and pitch on the ramp of a drive, at yaws (k,) from the first heading."""
    along = settings["uphill"] - yaw
    # Gravity in the body frame is g·(sin pitch, −cos pitch·sin roll, …), REP-103.
    ahead, aside = (
        np.sin(settings["slope"]) * np.cos(along),
        np.sin(settings["slope"]) * np.sin(along),
    )
    pitch = -np.arcsin(ahead)
    return np.arcsin(aside / np.cos(pitch)), pitch


def rows_of_round(
    settings: Settings, run: Mapping[str, float | None], usual: Mapping[str, float]
) -> tuple[Array, Array]:
    """Rows of the power model for one round of a run, and the seconds that each stands for.

    A leg has two rows while it grows, one or a few while it is steady, two while it fades.

    Args:
        settings: of the drive.
        run: payload and motor temperature.
        usual: quantity → value that the robot's log usually has.
    """
    parts: list[tuple[float, ...]] = []  # seconds, velocity, change of velocity, yaw
    yaw = clock = 0.0
    for leg in settings["legs"]:
        top = np.array([leg["vx"], leg["vy"], leg["wz"]])
        rate = top / max(leg["ramp"], 1e-9)
        steps = 8 if settings["slope"] and leg["wz"] else 1
        pieces = [
            *((0.5 * leg["ramp"], share * top, rate) for share in (0.25, 0.75)),
            *((leg["hold"] / steps, top, 0.0 * top) for _ in range(steps)),
            *((0.5 * leg["ramp"], share * top, -rate) for share in (0.75, 0.25)),
        ]
        for seconds, velocity, change in pieces:
            if seconds <= 0.0:
                continue
            middle = yaw + 0.5 * velocity[2] * seconds
            parts.append((seconds, *velocity, *change, middle, clock + 0.5 * seconds))
            yaw, clock = yaw + velocity[2] * seconds, clock + seconds
    seconds, vx, vy, wz, ax, ay, turning, yaws, clocks = np.array(parts).T
    columns: dict[str, Any] = {
        **usual,
        # Inertial acceleration in body axes.
        "vx": vx,
        "vy": vy,
        "wz": wz,
        "ax": ax - wz * vy,
        "ay": ay + wz * vx,
        "yaw_acceleration": turning,
        "payload": run["payload"] or 0.0,
        "time_since_start": clocks,
    }
    if run["motor_temp"] is not None:
        columns["motor_temp"] = run["motor_temp"]
    columns |= gravity_columns(*tilt_of(settings, yaws), gravity=STANDARD_GRAVITY)
    count = len(seconds)
    return rows_from(**{k: np.broadcast_to(v, (count,)) for k, v in columns.items()}), seconds
