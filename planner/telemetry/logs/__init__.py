"""Telemetry logs as rows of the power model.

Telemetry.read and Telemetry.chunks read CSV, Parquet and rosbag2 files, and tables in memory such
as DataFrames of pandas. They check them and derive what is missing. A log knows its runs, its
stretches without gaps, and the Meter that its power was read from. join_logs makes one log of the
files that one drive left.
"""

from planner.telemetry.logs.finding import Finding
from planner.telemetry.logs.join import join_logs
from planner.telemetry.logs.log import LogLike, Telemetry, pieces_of
from planner.telemetry.logs.mapping import MappingLike
from planner.telemetry.logs.meter import Meter, same_meter

__all__ = [
    "Finding",
    "LogLike",
    "MappingLike",
    "Meter",
    "Telemetry",
    "join_logs",
    "pieces_of",
    "same_meter",
]
