"""Poses of a motion as close in time as anybody asks, from which its limits can be checked.

poses = poses_every(motion, 0.01)        # {"x": ..., "t": ...}

Poses of an answer are chords of its bends. These here lie on the arcs themselves, and where two
straight steps meet at an angle that needs no arc, the corner is rounded over both half steps. The
velocity that follows from their differences then has the acceleration that limits are kept for.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.trajectory import Motion, shares_driven

Integers = NDArray[np.int64]
KINK = math.radians(1.0)
"""Changes of direction up to this are rounded; at larger ones the robot stands still."""


def poses_every(motion: Motion, seconds: float) -> dict[str, Array]:
    """x, y, z, yaw, t and speed of a motion, each (n,): its own samples, and between them.

    Args:
        motion: finished.
        seconds: s between two poses at most.
    """
    counts = np.maximum(1, np.ceil(np.diff(motion.time) / seconds - 1e-9)).astype(np.int64)
    steps = np.repeat(np.arange(len(counts)), counts)
    share = np.concatenate([np.zeros(0), *(np.arange(n) / n for n in counts)])
    steps, share = np.append(steps, len(counts) - 1), np.append(share, 1.0)
    times = motion.time[steps] + share * np.diff(motion.time)[steps]
    times[-1] = motion.time[-1]
    gone = shares_driven(motion, steps, times)
    x, y = _on_arcs(motion, steps, gone)
    across_x, across_y = _off_corners(motion, steps, gone)
    x, y = x + across_x, y + across_y
    return {
        "x": x,
        "y": y,
        "z": motion.heights[steps] + np.diff(motion.heights)[steps] * gone,
        "yaw": motion.yaw[steps] + np.diff(motion.yaw)[steps] * gone,
        "t": times,
        "speed": motion.speed[steps] + np.diff(motion.speed)[steps] * share,
    }


def _on_arcs(motion: Motion, steps: Integers, gone: Array) -> tuple[Array, Array]:
    """Places on the arcs whose chords the steps are, or parts of them."""
    arcs = motion.arcs
    half, gone = arcs.half[steps], arcs.before[steps] + arcs.share[steps] * gone
    # The chord of a part of the arc: its length over that of the whole, and its direction.
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(np.abs(half) > 1e-9, np.sin(half * gone) / np.sin(half), gone)
    towards = arcs.direction[steps] - half + half * gone
    reach = arcs.chord[steps] * scale
    first = arcs.first[steps]
    return motion.x[first] + reach * np.cos(towards), motion.y[first] + reach * np.sin(towards)


def _off_corners(motion: Motion, steps: Integers, gone: Array) -> tuple[Array, Array]:
    """(n,) m along x and y from the corner of two straight steps to the arc that rounds it."""
    arcs = motion.arcs
    direction, length = arcs.direction, arcs.chord * arcs.share
    # At every inner sample: how far the direction jumps, and over which length it is rounded.
    begun = arcs.begun
    jumps = begun[1:] - (begun + arcs.change)[:-1]
    jumps = (jumps + math.pi) % (2.0 * math.pi) - math.pi
    reach = 0.5 * np.minimum(length[1:], length[:-1])
    rounded = (reach > 1e-9) & (np.abs(jumps) <= KINK) & (motion.speed[1:-1] > 0.0)
    jumps = np.where(rounded, jumps, 0.0)
    jumps, reach = np.pad(jumps, 1), np.pad(np.maximum(reach, 1e-9), 1, constant_values=1e-9)
    off = np.zeros(len(steps))
    for at, away in ((steps, gone), (steps + 1, 1.0 - gone)):
        near = np.maximum(reach[at] - away * length[steps], 0.0)
        off += 0.25 * jumps[at] / reach[at] * near**2
    return -off * np.sin(direction[steps]), off * np.cos(direction[steps])
