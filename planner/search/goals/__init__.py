"""Which place to go to: checks of the places asked for, and the best one of a goal region.

reason = check_places(run, field)
for run in settled(run, "energy"):                       # its goal is now one place
"""

from planner.search.goals.goal_selection import check_places, settled

__all__ = [
    "check_places",
    "settled",
]
