"""Arguments that compiled loops of several rooms take together, and their types in numba.

    step_costs(kernel, conditions.arrays, objective, steps, ...)

The kernel of a power model stays an argument of its own: numba takes no tuple that holds a function
and arrays.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array

EAGER: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True}
"""Options of loops that are compiled for the one signature that they state."""
F1 = types.Array(types.float64, 1, "C")
F2 = types.Array(types.float64, 2, "C")
F3 = types.Array(types.float64, 3, "C")
F4 = types.Array(types.float64, 4, "C")
I1 = types.Array(types.int64, 1, "C")
B1 = types.Array(types.boolean, 1, "C")
B3 = types.Array(types.boolean, 3, "C")
B2 = types.Array(types.boolean, 2, "C")


class ModelArrays(NamedTuple):
    """Numbers of a power model and its conditions.

    Attributes:
        parameters, body, wheels: of ``PowerModel``.
        class_rows, wind: of ``OperatingConditions``.
        limits: of ``OperatingConditions``, and behind them the torque that motors may give for
            good: infinite unless slopes last.
    """

    parameters: Array
    body: Array
    wheels: Array
    class_rows: Array
    limits: Array
    wind: Array


class Steps(NamedTuple):
    """Steps between the samples of a path.

    Attributes:
        directions: (n,) rad, azimuth of the travel.
        lengths: (n,) m, horizontal.
        curvatures: (n,) 1/m of the bend that a step belongs to, positive to the left.
        slopes: (n, 8) gradient in the middle, the steepest one, that late and that early.
        steep: (n,) whether a limit may be near.
        ground: (n,) class of the ground.
    """

    directions: Array
    lengths: Array
    curvatures: Array
    slopes: Array
    steep: NDArray[np.bool_]
    ground: NDArray[np.int64]

    def part(self, first: int, last: int) -> Steps:
        """The steps from one sample to another."""
        return self.some(slice(first, last))

    def some(self, chosen: slice | NDArray[np.int64]) -> Steps:
        """Some of the steps, one after the other."""
        return Steps(
            self.directions[chosen],
            self.lengths[chosen],
            self.curvatures[chosen],
            self.slopes[chosen],
            self.steep[chosen],
            self.ground[chosen],
        )


def tuple_type(kind: type, *fields: Any) -> Any:
    """Type in numba of a NamedTuple with fields of these types."""
    return types.NamedTuple(fields, kind)  # type: ignore[no-untyped-call]


MODEL_ARRAYS = tuple_type(ModelArrays, F1, F1, F2, F2, F1, F1)
STEPS = tuple_type(Steps, F1, F1, F1, F2, B1, I1)
