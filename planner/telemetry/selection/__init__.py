"""The search for effects that a model lacks.

find_missing_effects chooses terms, compares competing models fitted in full, and repeats that until
the choice stays. It gives a Found with a Selection of Members.
"""

from planner.telemetry.selection.found import Found
from planner.telemetry.selection.off_catalogue import ShapeFound
from planner.telemetry.selection.select_effects import RankedTerm, Selection
from planner.telemetry.selection.single_effects import Tried, fitted_singles
from planner.telemetry.selection.subset_search import Member
from planner.telemetry.selection.whole_search import find_missing_effects

__all__ = [
    "Found",
    "Member",
    "RankedTerm",
    "Selection",
    "ShapeFound",
    "Tried",
    "find_missing_effects",
    "fitted_singles",
]
