"""A robot to test against, for tests and demonstrations only.

VirtualRobot drives a Profile and gives a VirtualLog with Noise and wrong Sensors. Its equations
share no formula with the power model; only effects that it has no equation for act by theirs.
"""

from planner.telemetry.virtual.profiles import Profile
from planner.telemetry.virtual.robot import VirtualLog, VirtualRobot
from planner.telemetry.virtual.sensors import QUIET, Noise, Sensors

__all__ = ["QUIET", "Noise", "Profile", "Sensors", "VirtualLog", "VirtualRobot"]
