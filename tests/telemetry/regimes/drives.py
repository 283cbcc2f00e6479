"""Axes of a drive, drawn at random."""

import numpy as np


def drive(rows=3600, runs=24, seed=0):
    """Axes of a varied drive: motion changes every 10 rows, load and temperature by run."""
    chance = np.random.default_rng(seed)
    segments = -(-rows // 10)

    def by_segment(values):
        return np.repeat(values, 10)[:rows]

    run = np.arange(rows) * runs // rows
    axes = {
        "heading": by_segment(chance.uniform(-np.pi, np.pi, segments)),
        "speed": by_segment(chance.uniform(0.1, 0.8, segments)),
        "slope_along": by_segment(np.radians(chance.normal(0.0, 3.0, segments))),
        "slope_across": by_segment(np.radians(chance.normal(0.0, 3.0, segments))),
        "yaw_rate": by_segment(chance.normal(0.0, 0.3, segments)),
        "acceleration": chance.normal(0.0, 0.2, rows),
        "load": np.array([0.0, 2.0, 5.0])[chance.integers(0, 3, runs)][run],
        "temperature": (chance.uniform(10.0, 60.0, runs)[run] + chance.normal(0.0, 0.3, rows)),
        "time_since_start": np.arange(rows) % (rows // runs) * 0.5,
        "surface": by_segment(chance.integers(0, 3, segments)).astype(float),
    }
    return axes, run
