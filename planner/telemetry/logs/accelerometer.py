"""Whether measured accelerations are in another unit, or contain gravity.

    measured = MeasuredAccelerations()
    measured.add(logged, derived, gravity)      # m/s², of either axis, as often as rows come
    measured.findings(rows)

An accelerometer feels gravity along a slope, too, and some report g in place of m/s². Both show
beside the acceleration that follows from the velocity.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Array
from planner.telemetry.logs.finding import Finding

OTHER_UNIT_FACTOR = 5.0
"""Derived over logged acceleration above which the latter is in another unit: in g it is 9.8."""
CLEAR_ERRORS = 10.0
"""Standard errors that the factor must differ from 0 by, so that noise alone never makes it."""
LEAST_GRAVITY = 0.01
"""m²/s⁴, mean square along the slope below which the ground is level: tilts of 0.6 degrees."""
MOST_LEAKED = 0.5
"""Share of gravity in the acceleration above which it is not noise of the tilts."""


@dataclass
class MeasuredAccelerations:
    """Sums over rows and both axes; memory does not grow with the log."""

    leak: Array = field(default_factory=lambda: np.zeros(2))
    rates: Array = field(default_factory=lambda: np.zeros(3))

    def add(self, logged: Array, derived: Array, gravity: Array) -> None:
        """Logged and derived acceleration, and gravity on the same axis, each (n,) in m/s²."""
        good = np.isfinite(logged)
        logged, derived, gravity = logged[good], derived[good], gravity[good]
        self.leak += [float((logged - derived) @ gravity), float(gravity @ gravity)]
        self.rates += [float(logged @ derived), float(logged @ logged), float(derived @ derived)]

    def findings(self, rows: int) -> Iterator[Finding]:
        """Gravity within the acceleration, or another unit, in so many rows."""
        along, gravity = self.leak
        if gravity > LEAST_GRAVITY * rows and abs(along / gravity) > MOST_LEAKED:
            text = (
                f"ax, ay: follow gravity along the slope with a factor of {along / gravity:.2f} "
                "in addition to the change of velocity: they seem to contain gravity"
            )
            yield Finding("gravity", "ax", rows, text)
        # Noise of what is logged makes this factor smaller than 1, never larger.
        both, logged, derived = self.rates
        factor = both / logged if logged > 0.0 else 0.0
        chance = math.sqrt(logged * derived / max(rows, 1))
        if factor > OTHER_UNIT_FACTOR and both > CLEAR_ERRORS * chance:
            text = (
                f"ax, ay: the velocity changes {factor:.2g} times as fast; in g perhaps "
                '(a mapping file says so with unit = "standard_gravity")'
            )
            yield Finding("unit", "ax", rows, text)
