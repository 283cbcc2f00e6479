"""One sentence of a log's report.

Finding("gap", "time", 3, "time: 3 gaps above 2.5 intervals of 0.1 s")
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing that a user should know about a log.

    Attributes:
        kind: "missing", "impossible", "doubled", "gap", "constant", "clipped", ...
        column: the quantity or heading concerned; "" for the whole log.
        rows: how many rows are concerned.
        sentence: what was found and what was done about it.
    """

    kind: str
    column: str
    rows: int
    sentence: str
