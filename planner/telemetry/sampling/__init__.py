"""A log of any length as a sample in memory and as chunks that pass by.

open_source gives a LogSource. Speeds of steady drives are taken at their means, and rows are
numbered by blocks.
"""

from planner.telemetry.sampling.clusters import BlockCounter, block_numbers
from planner.telemetry.sampling.sample import LogSource, open_source
from planner.telemetry.sampling.steady_drive import at_steady_speeds, stretches

__all__ = [
    "BlockCounter",
    "LogSource",
    "at_steady_speeds",
    "block_numbers",
    "open_source",
    "stretches",
]
