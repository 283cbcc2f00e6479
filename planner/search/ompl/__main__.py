"""The program of a process that samples: ``python -m planner.search.ompl``."""

from planner.search.ompl.sampling import main

main()
