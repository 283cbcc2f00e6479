"""A page about one or more answers that needs no network and no server.

write_report([answer], "report.html", "Across the fault")
"""

from planner.report.page import write_report

__all__ = ["write_report"]
