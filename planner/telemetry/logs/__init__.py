"""Telemetry logs as rows of the power model.

Telemetry.read and Telemetry.chunks read CSV, Parquet and rosbag2 files, check them and derive what
is missing. A log knows its runs and its stretches without gaps.
"""

from planner.telemetry.logs.log import Finding, Telemetry, pieces_of

__all__ = ["Finding", "Telemetry", "pieces_of"]
