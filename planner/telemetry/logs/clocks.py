"""Clocks of files that are to be joined: their unit, and the shift of one against another.

    scale, absolute = clock_of(time, "power.csv")       # stamps since 1970 in ns are 1e-9 s
    source = shifted(source, base, {}, said)            # with its times on the clock of ``base``

The shift is where the activity in one file (speed, power, yaw rate) correlates best with that in
the other. A sample stands for the interval that it ends, so that a slow meter's averages are
compared with the speeds of the same interval.
"""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
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
RATE = 20.0
"""Hz at which files are compared; slower than any odometry, faster than any shift that matters."""
MOST_COMPARED = 2_000_000
"""Samples at RATE that are compared: 28 hours."""
_SINCE_1970 = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))
"""Smallest stamp of our time in ns, µs, ms and s, and the unit in s."""


@dataclass(frozen=True, eq=False)
class Source:
    """One file: its name, times in s, channels in SI, each (n,); whether it counts since 1970."""

    name: str
    time: Array
    channels: dict[str, Array]
    absolute: bool

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


def shifted(source: Source, base: Source, given: AnyMapping[str, float], said: list[str]) -> Source:
    """The file on the clock of another one.

    Args:
        source, base: files of one drive; the base has vx and vy.
        given: by file name, s to add; nothing is looked for then.
        said: what was done, in sentences; changed.

    Raises:
        LogError: the clocks have nothing in common and the courses do not tell the shift.
    """
    if source is base:
        return source
    if source.name in given:
        said.append(f"{source.name} shifted by {given[source.name]:+.4g} s, as given")
        return replace(source, time=source.time + given[source.name])
    shift, gain, best = _best_shift(source, base)
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


def _best_shift(source: Source, base: Source) -> tuple[float, float, float]:
    """Shift in s, its correlation above that of none, and its correlation."""
    own, other = _activity(source), _activity(base)
    if own is None or other is None:
        return 0.0, 0.0, -1.0
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
