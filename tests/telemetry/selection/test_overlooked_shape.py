"""The shape that held-out runs ask for where the search shows none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.quantities_of_motion import STANDSTILL, motion_axes
from planner.telemetry.selection.off_catalogue import overlooked_shape
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import measured

WATTS = 3.0


def axis_asked_for(log, base) -> str | None:
    """The quantity of the shape that unseen runs of a log ask for."""
    fitted = fit(log, base)
    dictionary = Dictionary.of(log)
    examination = examine(log, DesignColumns(candidate_library(fitted.model, log), dictionary))
    floor = np.full(len(log), fitted.noise.floor_w)
    found = overlooked_shape(log, examination, floor)
    return None if found is None else dictionary.shapes[found.number].axis


def stopping(motion):
    """The drive, its first rows at rest; (n,) which."""
    stands = motion.time < np.array([15.0, 20.0, 10.0])[motion.run % 3]
    rows = motion.rows.copy()
    for name in ("vx", "vy", "wz", "ax", "ay", "yaw_acceleration"):
        rows[stands, INDEX[name]] = 0.0
    return replace(motion, rows=rows), stands


def test_what_depends_on_the_heading_is_found(motion, base):
    axes = motion_axes(motion.rows)
    pull = np.maximum(np.cos(np.nan_to_num(axes["heading"]) - 0.4), 0.0) * axes["speed"]
    assert axis_asked_for(measured(motion, base, 0.02, seed=8, extra=WATTS * pull), base) == (
        "heading"
    )


def test_noise_asks_for_no_shape(motion, base):
    assert axis_asked_for(measured(motion, base, 0.02, seed=9), base) is None


def test_what_fades_with_speed_is_found(motion, base):
    log, _ = stopping(motion)
    speed = motion_axes(log.rows)["speed"]
    extra = WATTS * np.tanh(speed / STANDSTILL) / (1.0 + (speed / 0.12) ** 2)
    assert axis_asked_for(measured(log, base, 0.02, seed=7, extra=extra), base) == "speed"


def test_a_power_at_rest_alone_asks_for_no_shape(motion, base):
    """Brakes, motors that hold, wheels that push against each other: all alike at rest."""
    log, stands = stopping(motion)
    assert axis_asked_for(measured(log, base, 0.02, seed=16, extra=WATTS * stands), base) is None
