"""What a model says for the rows of a log, and how that changes with its parameters.

predict gives watts, tangent derivatives, secants changes of real size; Nodes stand for rows that
last an interval. input_uncertainty says how far inputs may mislead single rows. Readings are what a
meter shows of a power, meter_columns their derivatives by its numbers.
"""

from planner.telemetry.prediction.held_readings import periods_of
from planner.telemetry.prediction.meter import Readings, meter_columns
from planner.telemetry.prediction.nodes import Nodes
from planner.telemetry.prediction.sensitivity import input_uncertainty, predict, secants, tangent

__all__ = [
    "Nodes",
    "Readings",
    "input_uncertainty",
    "meter_columns",
    "periods_of",
    "predict",
    "secants",
    "tangent",
]
