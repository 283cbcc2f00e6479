"""The arcs of a motion whose samples are the ends of their chords.

    arcs = arcs_of(x, y, curvatures)
    arcs.begun, arcs.change         # (steps,) rad, travel where a step begins, and its change

From chord to chord the travel would change its direction at once. A wheel that hardly rolls would
then turn the other way for a moment, and its drag would load the motor. On the arcs it does not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array

SAME_DIRECTION = 1e-9
"""rad between the parts of one chord at most: rounding. Chords of an arc differ by a degree."""


class Arcs(NamedTuple):
    """Of every step (steps,), the arc that it is a part of: all parts of one chord have the same.

    Attributes:
        first: number of the chord's first step.
        chord: m, its length.
        direction: rad, azimuth of the chord.
        half: rad, half of what the arc turns by.
        before, share: shares of the chord before the step, and of the step.
    """

    first: NDArray[np.int64]
    chord: Array
    direction: Array
    half: Array
    before: Array
    share: Array

    @property
    def begun(self) -> Array:
        """(steps,) rad, azimuth of the travel where a step begins."""
        return self.direction + self.half * (2.0 * self.before - 1.0)

    @property
    def change(self) -> Array:
        """(steps,) rad, by how much the azimuth of the travel grows on a step."""
        return 2.0 * self.half * self.share


def arcs_of(x: Array, y: Array, curvatures: Array) -> Arcs:
    """Arcs through samples x and y (n,), m; ``curvatures`` (n - 1,) of the steps, 1/m."""
    ex, ey = np.diff(x), np.diff(y)
    length, direction = np.hypot(ex, ey), np.arctan2(ey, ex)
    alike = (curvatures[1:] == curvatures[:-1]) & (curvatures[1:] != 0.0) & (length[1:] > 0.0)
    parted = alike & (np.abs(np.diff(direction)) < SAME_DIRECTION)
    number = np.append(0, np.cumsum(~parted))[: len(length)]
    first = np.searchsorted(number, number)
    chord = np.bincount(number, length)[number]
    gone = np.cumsum(length) - length
    whole = np.maximum(chord, 1e-300)
    half = np.arcsin(np.clip(0.5 * curvatures * chord, -1.0, 1.0))
    return Arcs(first, chord, direction, half, (gone - gone[first]) / whole, length / whole)
