"""Rows that the power model reads: one for each state, a column for each quantity.

rows = rows_from(vx=[0.5], **gravity_columns(0.0, [0.1], gravity=9.81))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planner.arrays import Array
from planner.errors import ModelError
from planner.quantities import DEFAULT_ROW, INDEX


def rows_from(**columns: ArrayLike) -> Array:
    """Rows for the model from columns named as in planner.quantities; the rest takes its default.

    Args:
        columns: each a number or (n,) values in SI.

    Returns:
        (n, ROW_LENGTH) float64.

    Raises:
        ModelError: a name is no quantity.
    """
    arrays = {name: np.atleast_1d(np.asarray(v, float)) for name, v in columns.items()}
    for name in arrays:
        if name not in INDEX:
            raise ModelError(name, "no such quantity", accepted=", ".join(INDEX))
    count = max((len(values) for values in arrays.values()), default=1)
    rows = np.tile(np.array(DEFAULT_ROW), (count, 1))
    for name, values in arrays.items():
        rows[:, INDEX[name]] = values
    return rows


def gravity_columns(roll: ArrayLike, pitch: ArrayLike, *, gravity: float) -> dict[str, Array]:
    """Columns of gravity in the body frame for roll and pitch in rad (REP-103), each (n,)."""
    roll, pitch = np.asarray(roll, float), np.asarray(pitch, float)
    return {
        "gravity_x": gravity * np.sin(pitch),
        "gravity_y": -gravity * np.cos(pitch) * np.sin(roll),
        "gravity_normal": gravity * np.cos(pitch) * np.cos(roll),
    }
