"""Regimes of motion in which a residual has structure, in words.

regimes_of searches a log, find_regimes axes of any kind; each gives a list of Regime.
"""

from planner.telemetry.regimes.regimes import Regime, find_regimes, regimes_of
from planner.telemetry.regimes.units import cluster_length
from planner.telemetry.regimes.words import WORDS

__all__ = ["WORDS", "Regime", "cluster_length", "find_regimes", "regimes_of"]
