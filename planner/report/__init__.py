"""Pages about routes and about the workbench's results that need no network and no server.

write_report([answer], "report.html", "Across the fault")
write_telemetry_report(diagnosis, "diagnosis.html", "Diagnosis of drive.csv")
fragment(diagnosis)                            # a card for notebooks
figure(diagnosis, "candidates").save("candidates.svg")
"""

from planner.report.page import write_report
from planner.report.telemetry_page import (
    figure,
    figure_names,
    fragment,
    write_telemetry_report,
)

__all__ = ["figure", "figure_names", "fragment", "write_report", "write_telemetry_report"]
