"""What a model says for the rows of a log, and how that changes with its parameters.

predict gives watts, tangent derivatives, secants changes of real size; Nodes stand for rows that
last an interval. doubt_of says how far inputs may mislead single rows.
"""

from planner.telemetry.prediction.nodes import Nodes
from planner.telemetry.prediction.sensitivity import doubt_of, predict, secants, tangent

__all__ = ["Nodes", "doubt_of", "predict", "secants", "tangent"]
