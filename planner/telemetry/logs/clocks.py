"""Clocks of files that are to be joined: their unit, and the shift of one against another.

    scale, absolute = clock_of(time, "power.csv")       # stamps since 1970 in ns are 1e-9 s
    sources = on_one_clock(sources, base, {}, said)     # with their times on the clock of ``base``

The shift is where the activity in one file (speed, power, yaw rate) correlates best with that in
the other. A sample stands for the interval that it ends, so that a slow meter's averages are
compared with the speeds of the same interval.

Power peaks while a robot speeds up, before its speed does. Against the speed alone a meter would
seem 0.5 to 1 s early. So near that shift the power is regressed on what a drive takes in each of
the meter's intervals, for shifts a fraction of an interval apart:

    P(s) = c0 + Σ c |u| + d u²  over u = vx, vy, wz, + m Δ(vx² + vy²)/2Δt + J Δ(wz²)/2Δt
           + g vx sin pitch + h vy sin roll, where a file on the same clock has the angles

The best of them, refined by a parabola, is the shift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.errors import LogError

CLEAR = 0.5
"""Correlation of two files from which a shift between their clocks is believed."""
GAIN = 0.05
"""Correlation that a shift must gain over none."""
LONGEST_SHIFT = 30.0
"""s that two clocks that count since 1970 may differ by."""
AROUND = 2.0
"""s, or intervals of the meter if longer, on both sides of the first shift that are looked at."""
FINE_STEP = 0.05
"""s between shifts that the power is regressed at; a parabola goes on from there."""
LEAST_INTERVALS = 30
"""Intervals of the meter for a regression of eleven terms."""
RATE = 20.0
"""Hz at which files are compared; slower than any odometry, faster than any shift that matters."""
MOST_REGRESSED = 20_000
"""Intervals of the meter that are regressed: at 2 Hz nearly three hours."""
MOST_COMPARED = 2_000_000
"""Samples at RATE that are compared: 28 hours."""
_SINCE_1970 = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))
"""Smallest stamp of our time in ns, µs, ms and s, and the unit in s."""


@dataclass(frozen=True, eq=False)
class Source:
    """Channels of a file that share their rows.

    Attributes:
        name: of the file.
        time: (n,) s.
        channels: by quantity, (n,) in SI.
        absolute: whether the times count since 1970.
        file: number of the file; the sources of one file share its clock.
    """

    name: str
    time: Array
    channels: dict[str, Array]
    absolute: bool
    file: int

    @property
    def interval(self) -> float:
        """Median distance of its samples, s."""
        return float(np.median(np.diff(self.time)))


def clock_of(time: Array, where: str) -> tuple[float, bool]:
    """Seconds for one unit of the stamps, and whether they count since 1970.

    Raises:
        LogError: no stamp is a number.
    """
    known = time[np.isfinite(time)]
    if not len(known):
        raise LogError(f"{where}: time", "holds no number", accepted="time in s")
    last = float(np.abs(known).max())
    for least, scale in _SINCE_1970:
        if last > least:
            return scale, True
    return 1.0, False


def on_one_clock(
    sources: Sequence[Source], base: Source, given: AnyMapping[str, float], said: list[str]
) -> list[Source]:
    """Sources on the clock of one of them; those with power last, as the angles help to place them.

    Args, raises: as ``shifted``. One source of a file tells the shift of all of them.
    """
    telling: dict[int, Source] = {}
    for source in sources:
        if _activity(telling.setdefault(source.file, source)) is None:
            telling[source.file] = source
    shifts = {base.file: 0.0}
    angles: dict[str, Array] = {}
    placed: list[Source] = []
    for with_power in (False, True):
        leaning = replace(base, channels={**base.channels, **angles})
        for file, one in telling.items():
            if file not in shifts and ("power" in one.channels) == with_power:
                shifts[file] = float((shifted(one, leaning, given, said).time - one.time)[0])
        placed = [replace(s, time=s.time + shifts[s.file]) for s in sources if s.file in shifts]
        angles = {
            name: np.interp(base.time, one.time, one.channels[name])
            for one in placed
            for name in ("pitch", "roll")
            if name in one.channels
        }
    return placed


def shifted(source: Source, base: Source, given: AnyMapping[str, float], said: list[str]) -> Source:
    """The file on the clock of another one.

    Args:
        source, base: files of one drive; the base has vx and vy.
        given: by file name, s to add; nothing is looked for then.
        said: what was done, in sentences; changed.

    Raises:
        LogError: the clocks have nothing in common and the courses do not tell the shift.
    """
    if source.name in given:
        said.append(f"{source.name} shifted by {given[source.name]:+.4g} s, as given")
        return replace(source, time=source.time + given[source.name])
    found = _best_shift(source, base)
    if found is None:
        return _without_activity(source, base, said)
    shift, gain, best = _refined(source, base, *found)
    overlap = min(source.time[-1], base.time[-1]) - max(source.time[0], base.time[0])
    same_clock = source.absolute == base.absolute and overlap > 0.0
    believed = best >= CLEAR and gain >= GAIN
    if not same_clock and not best >= CLEAR:
        raise LogError(
            source.name,
            f"shares no clock with {base.name}, and their courses do not tell the shift "
            f"(correlation {best:.2f})",
            accepted="times since 1970 in all files, or the shift in s, --shift "
            f"{source.name}=SECONDS",
        )
    small = abs(shift) <= max(source.interval, base.interval, 2.0 / RATE)
    if same_clock and (not believed or small):
        said.append(f"{source.name} not shifted against {base.name}")
        return source
    said.append(f"{source.name} shifted by {shift:+.2f} s (correlation {best:.2f})")
    return replace(source, time=source.time + shift)


def _without_activity(source: Source, base: Source, said: list[str]) -> Source:
    """A file with nothing that could be compared, such as accelerations and angles alone."""
    channels = ", ".join(sorted(source.channels))
    overlap = min(source.time[-1], base.time[-1]) - max(source.time[0], base.time[0])
    if source.absolute != base.absolute or overlap <= 0.0:
        raise LogError(
            source.name,
            f"shares no clock with {base.name}, and {channels} cannot tell the shift",
            accepted=f"wz, speeds or power in this file, or the shift in s, --shift "
            f"{source.name}=SECONDS",
        )
    said.append(f"{source.name} not shifted against {base.name}; {channels} cannot tell a shift")
    return source


def _refined(
    source: Source, base: Source, shift: float, gain: float, best: float
) -> tuple[float, float, float]:
    """The shift of a file with power by regression; of another one as it was."""
    if "power" not in source.channels or {"vx", "vy", "wz"} - set(base.channels):
        return shift, gain, best
    reach = AROUND * max(1.0, source.interval)
    steps = np.arange(-round(reach / FINE_STEP), round(reach / FINE_STEP) + 1) * FINE_STEP
    curve = np.array([_explained(source, base, shift + step) for step in steps])
    top = int(curve.argmax())
    if not curve[top] > 0.0:
        return shift, gain, best
    further = 0.0
    if 0 < top < len(curve) - 1 and np.isfinite(curve[top - 1 : top + 2]).all():
        left, middle, right = curve[top - 1 : top + 2]
        bend = left - 2.0 * middle + right
        further = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    none = _explained(source, base, 0.0)
    refined = float(shift + steps[top] + further * FINE_STEP)
    gain = float(curve[top] - none) if math.isfinite(none) else 1.0
    return refined, gain, float(curve[top])


def _explained(source: Source, base: Source, shift: float) -> float:
    """Multiple correlation of a file's power with the terms of a drive; -inf where too few meet."""
    time, length = source.time + shift, source.interval
    power = source.channels["power"]
    meets = (time - length >= base.time[0]) & (time <= base.time[-1]) & np.isfinite(power)
    if meets.sum() < LEAST_INTERVALS:
        return -math.inf
    ends, power = time[meets][:MOST_REGRESSED], power[meets][:MOST_REGRESSED]
    columns = [np.ones(len(ends))]
    dt = np.diff(base.time, prepend=base.time[0] - base.interval)

    middles = base.time - 0.5 * dt

    def change(times: Array, state: Array) -> Array:
        """Mean rate of change of a state over each interval."""
        upto = np.interp(ends, times, state)
        return np.asarray((upto - np.interp(ends - length, times, state)) / length)

    speeds = {name: np.nan_to_num(base.channels[name]) for name in ("vx", "vy", "wz")}
    for values in speeds.values():
        for shape in (np.abs(values), values**2):
            columns.append(change(base.time, np.cumsum(shape * dt)))
    for angle, along in (("pitch", "vx"), ("roll", "vy")):
        if angle in base.channels:
            climbing = np.sin(np.nan_to_num(base.channels[angle])) * speeds[along]
            columns.append(change(base.time, np.cumsum(climbing * dt)))
    # A sample is a mean, so it shows the state in the middle of its interval.
    columns.append(change(middles, speeds["vx"] ** 2 + speeds["vy"] ** 2))
    columns.append(change(middles, speeds["wz"] ** 2))
    design = np.column_stack(columns)
    centred = power - power.mean()
    total = float(centred @ centred)
    if not total > 0.0:
        return -math.inf
    fitted = design @ np.linalg.lstsq(design, power, rcond=None)[0]
    left = float(np.sum((power - fitted) ** 2))
    return math.sqrt(max(0.0, 1.0 - left / total))


def _activity(source: Source) -> tuple[str, Array] | None:
    """Name and values of the channel that shows when the robot moves."""
    channels = source.channels
    if {"vx", "vy"} <= set(channels):
        return "speed", np.hypot(channels["vx"], channels["vy"])
    if "power" in channels:
        return "power", channels["power"]
    if "battery_current" in channels:
        return "battery_current", channels["battery_current"]
    if "wz" in channels:
        return "wz", channels["wz"]
    return None


def _best_shift(source: Source, base: Source) -> tuple[float, float, float] | None:
    """Shift in s, its correlation above that of none, and its correlation.

    None where a file has no channel that shows when the robot moves.
    """
    own, other = _activity(source), _activity(base)
    if own is None or other is None:
        return None
    reference = np.abs(base.channels["wz"]) if own[0] == "wz" else other[1]
    values = np.abs(own[1]) if own[0] == "wz" else own[1]
    a, start_a = _resampled(base.time, reference)
    b, start_b = _resampled(source.time, values)
    size = 1 << (len(a) + len(b)).bit_length()
    lags = np.arange(size)
    lags[lags > size // 2] -= size

    def correlated(one: Array, two: Array) -> Array:
        spectrum = np.fft.rfft(one, size) * np.conj(np.fft.rfft(two, size))
        return np.asarray(np.fft.irfft(spectrum, size))

    # Energies of what overlaps at each lag; the floor keeps a stretch of rest from dividing by 0.
    own_part = correlated(a * a, np.ones(len(b)))
    other_part = correlated(np.ones(len(a)), b * b)
    floor = 1e-3 * max(float(a @ a), 1e-12), 1e-3 * max(float(b @ b), 1e-12)
    scale = np.sqrt(np.maximum(own_part, floor[0]) * np.maximum(other_part, floor[1]))
    correlation = correlated(a, b) / scale
    shift = start_a - start_b + lags / RATE
    overlap = np.minimum(len(a), lags + len(b)) - np.maximum(0, lags)
    allowed = overlap >= 0.5 * min(len(a), len(b))
    if source.absolute and base.absolute:
        allowed &= np.abs(shift) <= LONGEST_SHIFT
    if not allowed.any():
        return 0.0, 0.0, -1.0
    correlation = np.where(allowed, correlation, -2.0)
    best = int(correlation.argmax())
    none = int(np.abs(np.where(allowed, shift, np.inf)).argmin())
    at_none = correlation[none] if abs(shift[none]) <= 1.0 / RATE else -1.0
    return float(shift[best]), float(correlation[best] - at_none), float(correlation[best])


def _resampled(time: Array, values: Array) -> tuple[Array, float]:
    """Values at RATE without their mean, and the first time."""
    good = np.isfinite(values)
    count = min(int((time[-1] - time[0]) * RATE) + 1, MOST_COMPARED)
    grid = time[0] + np.arange(max(count, 2)) / RATE
    # Of the sample that ends the interval; no interpolation, which would invent power.
    place = np.minimum(np.searchsorted(time[good], grid), int(good.sum()) - 1)
    known = values[good][np.maximum(place, 0)] if good.any() else np.zeros(len(grid))
    return known - known.mean(), float(time[0])
