"""Alternatives to the catalogue's terms: errors of sensors, and plain shapes over the axes of
motion.

SENSORS lists the errors, each corrects a log. Dictionary.of gives the shapes that a log can show.
"""

from planner.telemetry.other_terms.sensor_errors import SENSORS, Sensor, measured_residual
from planner.telemetry.other_terms.shapes import Dictionary, Shape

__all__ = ["SENSORS", "Dictionary", "Sensor", "Shape", "measured_residual"]
