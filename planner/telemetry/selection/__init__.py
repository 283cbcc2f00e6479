"""The search for what a model lacks.

find_missing chooses terms, fits rivals in full, and lays everything out anew until the choice
stays. Its answer is a Found with a Selection of Members.
"""

from planner.telemetry.selection.off_catalogue import ShapeFound
from planner.telemetry.selection.select_effects import Selection, Standing
from planner.telemetry.selection.selection_loop import Found
from planner.telemetry.selection.subset_search import Member
from planner.telemetry.selection.whole_search import find_missing

__all__ = [
    "Found",
    "Member",
    "Selection",
    "ShapeFound",
    "Standing",
    "find_missing",
]
