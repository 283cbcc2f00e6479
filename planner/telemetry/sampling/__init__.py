"""A log of any length as a sample in memory and as chunks that pass by.

open_source gives a LogSource. Speeds of steady drives are taken at their means, and rows are
numbered by clusters. noise_of_motion is what its measured channels scatter by, and
with_earlier_tilt a log whose tilt sensor is not late.
"""

from planner.telemetry.sampling.accelerations import findings_of_accelerations
from planner.telemetry.sampling.clusters import cluster_numbers
from planner.telemetry.sampling.late_odometry import with_earlier_tilt
from planner.telemetry.sampling.noisier_motion import noise_of_motion
from planner.telemetry.sampling.sample import LogSource, open_source
from planner.telemetry.sampling.steady_drive import stretches

__all__ = [
    "LogSource",
    "cluster_numbers",
    "findings_of_accelerations",
    "noise_of_motion",
    "open_source",
    "stretches",
    "with_earlier_tilt",
]
