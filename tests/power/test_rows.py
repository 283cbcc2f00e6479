"""Rows: the vocabulary of their columns, and gravity of a tilted body."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import ModelError
from planner.power.rows import gravity_columns, rows_from
from planner.quantities import INDEX, QUANTITIES, ROW_LENGTH


def test_vocabulary_has_every_name_once() -> None:
    assert len(INDEX) == len(QUANTITIES) == ROW_LENGTH
    assert all(quantity.meaning and quantity.unit for quantity in QUANTITIES)


def test_unknown_column() -> None:
    with pytest.raises(ModelError, match=r"speed.*no such quantity.*vx"):
        rows_from(speed=1.0)


@pytest.mark.parametrize(
    ("roll", "pitch", "expected"),
    [
        (0.0, 0.0, (0.0, 0.0, 1.0)),
        # Nose down by 30°: gravity pulls forward. Left side up by 30°: it pulls to the right.
        (0.0, np.pi / 6, (0.5, 0.0, np.sqrt(0.75))),
        (np.pi / 6, 0.0, (0.0, -0.5, np.sqrt(0.75))),
    ],
)
def test_gravity_of_roll_and_pitch(
    roll: float, pitch: float, expected: tuple[float, float, float]
) -> None:
    columns = gravity_columns(roll, pitch, gravity=10.0)
    assert [float(value) for value in columns.values()] == pytest.approx(
        [10.0 * part for part in expected], abs=1e-12
    )
