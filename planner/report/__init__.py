"""Pages and pictures of all results; they need no network and no server.

write_report(diagnosis, "diagnosis.html", "Diagnosis of drive.csv")
write_report({"empty": light, "loaded": heavy}, "report.html", "Two answers on one page")
figure(diagnosis, "candidates").save("candidates.svg")
card(diagnosis)                                # HTML for notebooks
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.report.pages import card, figure, figure_names, write_report

__all__ = ["card", "figure", "figure_names", "write_report"]


def __getattr__(name: str) -> Any:
    # Loaded when asked for: sentences for a terminal need no pictures.
    if name in __all__:
        from planner.report import pages

        return getattr(pages, name)
    raise AttributeError(f"module 'planner.report' has no attribute {name!r}")
