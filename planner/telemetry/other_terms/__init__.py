"""Alternatives to the catalogue's terms: errors of sensors, and plain shapes over the axes of
motion.

SENSORS lists the errors, each corrects a log. Dictionary.of gives the shapes that a log can show.
given_columns are the usual small errors of data sheet and sensors, which stand beside every test.
"""

from planner.telemetry.other_terms.given_errors import (
    GIVEN,
    given_columns,
    tolerance_of,
)
from planner.telemetry.other_terms.sensor_errors import SENSORS, Sensor, measured_residual
from planner.telemetry.other_terms.shapes import Dictionary, Shape

__all__ = [
    "GIVEN",
    "SENSORS",
    "Dictionary",
    "Sensor",
    "Shape",
    "given_columns",
    "measured_residual",
    "tolerance_of",
]
