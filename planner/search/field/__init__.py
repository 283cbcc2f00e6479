"""The cost of driving over a map in any direction, for compiled code.

segment_cost(field, xa, ya, xb, yb, step)                # of a straight line, best yaw
heights, gradients = sample_surface(field, points)
"""

from planner.search.field.cost_field import (
    CostField,
    masked_cost,
    passable,
    polyline_cost,
    segment_cost,
    wind_cost,
)
from planner.search.field.surface import ground_classes, sample_surface

__all__ = [
    "CostField",
    "ground_classes",
    "masked_cost",
    "passable",
    "polyline_cost",
    "sample_surface",
    "segment_cost",
    "wind_cost",
]
